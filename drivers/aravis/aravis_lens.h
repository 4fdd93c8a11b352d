// The lens' part of a GenICam device.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "control_link.h"
#include "drivers/api/lens.h"
#include "lens_names.h"

namespace lensd::drivers::aravis {

/// One axis as this camera offers it; empty names: there is none.
struct AxisFeature {
  std::string feature;
  bool is_integer = true;
  std::string status;
  std::string initialize;
  AxisCapabilities can;
};

/// The lens as this camera offers it.
struct LensFacts {
  std::string model;
  std::string selector;
  std::string controller;  ///< entry of the selector
  std::string status;
  std::string initialize;
  std::string abort;
  std::string temperature;
  PerAxis<std::optional<AxisFeature>> axes;

  bool any() const;
};

/// Selects the lens' controller and looks for its features, those of `names` first; on the link's thread. No axis at
/// all is an answer. Unsupported: a feature named in the configuration does not exist or cannot be written.
Result<LensFacts> FindLens(ArvCamera* camera, const LensNames& names);

/// Feature by feature over the control channel.
class AravisLens final : public Lens {
 public:
  AravisLens(std::shared_ptr<AravisLink> link, LensFacts facts, const std::string& serial, const Clock& clock);
  ~AravisLens() override;

 private:
  Result<void> DoStartHome(Axis axis) override;
  Result<void> DoStartMove(Axis axis, Native target) override;
  Result<LensState> DoRead() override;
  Result<void> DoStop(Axis axis) override;
  void DoInterrupt() override { link_->Interrupt(); }

  Result<LensState> ReadAll(ArvCamera* camera);
  Result<AxisState> ReadAxis(ArvCamera* camera, Axis axis, std::optional<Condition> controller);
  Result<std::optional<Condition>> ReadCondition(ArvCamera* camera, const std::string& feature) const;

  const std::shared_ptr<AravisLink> link_;
  const LensFacts facts_;
  const Clock& clock_;
  /// What is known of an axis' way.
  struct Way {
    std::optional<Instant> commanded;  ///< of a command of which no effect has been seen yet
    std::optional<Native> target;      ///< last told; none: the search of the reference, or a stop
    std::optional<Native> from;        ///< where it rested before that
    std::optional<Native> seen;        ///< last read
    std::optional<Native> cut;         ///< the target of a motion stopped before anything was seen of it
    Instant changed{};                 ///< when that last did
    int approaching = 0;               ///< readings in a row on the way to the target, each nearer
    int busy_readings = 0;             ///< in a row
    bool live = false;                 ///< it has been read on its way to a target: no echo
    bool watched = false;              ///< the same since the command
    bool there_at_once = false;        ///< the target was read before Busy was, since the command
    bool busy_seen = false;            ///< since the command
    bool assumed = false;              ///< nothing has been seen of the last motion
  };
  static bool Approaches(const Way& way, Native position, double resolution);
  bool Moves(Axis axis, Native position, bool busy, Instant now);
  void Told(Axis axis, std::optional<Native> target);
  void ForgetCut(Axis axis);

  PerAxis<Way> ways_;                   ///< the link's thread
  std::optional<Celsius> temperature_;  ///< the link's thread, as below
  Instant temperature_read_{};
};

}  // namespace lensd::drivers::aravis
