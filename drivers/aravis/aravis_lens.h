// The lens' part of a GenICam device.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "control_link.h"
#include "drivers/api/arrival_watch.h"
#include "drivers/api/device.h"
#include "drivers/api/lens.h"
#include "lens_names.h"

namespace lensd::drivers::aravis {

/// Whether what went wrong with one feature concerns the whole camera: one that leaves a register unanswered for as
/// long as Aravis asks does not answer at all.
inline bool CameraIsGone(const Error& error) {
  return ConcernsAll(error) || error.code == Code::Timeout;
}

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
  Findings findings;  ///< axes that are listed and cannot be used

  bool any() const;
};

/// Selects the lens' controller and looks for its features, those of `names` first; on the link's thread. No axis at
/// all is an answer; one that is listed and cannot be used is left out. Unsupported: a feature named in the
/// configuration does not exist or cannot be written. Errors of the whole device.
Result<LensFacts> FindLens(ArvCamera* camera, const LensNames& names);

/// What the link's thread does with the lens, and what it knows of it. Shared with every task, as the camera may be
/// slow to answer one whose caller, and with it the lens, is long gone.
class LensControl {
 public:
  LensControl(LensFacts facts, const Clock& clock);
  const LensFacts& facts() const { return facts_; }

  /// `times_opened`: the camera, so far. Of what was under way before it was opened again nothing is known.
  Result<LensState> Read(ArvCamera* camera, int times_opened);
  Result<void> StartHome(ArvCamera* camera, Axis axis);
  Result<void> StartMove(ArvCamera* camera, Axis axis, Native target);
  Result<void> Stop(ArvCamera* camera, Axis axis);

 private:
  /// What is known of an axis' way.
  struct Way {
    explicit Way(const drivers::ArrivalWatch& by) : watch(by) {}
    drivers::ArrivalWatch watch;
    std::optional<Native> target;    ///< last sent; none: the search of the reference, or a stop
    std::optional<Native> from;      ///< where it rested before that
    std::optional<Native> believed;  ///< last position that was no echo
    std::optional<Native> cut;       ///< the target of a motion stopped before anything was seen of it
    bool under_way = false;          ///< sent, and not seen to rest
    bool live = false;               ///< it has been read on its way to a target: no echo
    bool there_at_once = false;      ///< the target was read before Busy was, since the command
    bool assumed = false;            ///< nothing has been seen of the last motion
  };
  Result<AxisState> ReadAxis(ArvCamera* camera, Axis axis, std::optional<Condition> controller);
  Result<std::optional<Condition>> ReadCondition(ArvCamera* camera, const std::string& feature) const;
  bool Moves(Axis axis, Native& position, bool busy, Instant now);
  void Told(Axis axis, std::optional<Native> target);
  void ForgetCut(Axis axis);
  void ForgetMotions();
  Result<LensState> ReadAll(ArvCamera* camera);

  const LensFacts facts_;
  const Clock& clock_;
  PerAxis<std::optional<Way>> ways_;  ///< of the axes there are
  Instant temperature_read_{};
  int times_opened_ = 1;
};

/// Feature by feature over the control channel.
class AravisLens final : public Lens {
 public:
  /// @param clock Outlives the link.
  AravisLens(std::shared_ptr<AravisLink> link, LensFacts facts, const std::string& serial, const Clock& clock);
  ~AravisLens() override;

 private:
  Result<void> DoStartHome(Axis axis) override;
  Result<void> DoStartMove(Axis axis, Native target) override;
  Result<LensState> DoRead() override;
  Result<void> DoStop(Axis axis) override;
  void DoInterrupt() override { link_->Interrupt(); }

  const std::shared_ptr<AravisLink> link_;
  const std::shared_ptr<LensControl> control_;
};

}  // namespace lensd::drivers::aravis
