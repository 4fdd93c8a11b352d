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

/// Looks for the lens' features, those of `names` first; on the link's thread. No axis at all is an answer.
/// Unsupported: a feature named in the configuration does not exist or cannot be written.
Result<LensFacts> FindLens(ArvCamera* camera, const LensNames& names);

/// Selects the lens' controller; on the link's thread, each time the camera is opened.
Result<void> SelectController(ArvCamera* camera, const LensFacts& facts);

/// Feature by feature over the control channel.
class AravisLens final : public Lens {
 public:
  AravisLens(std::shared_ptr<Link> link, LensFacts facts, const std::string& serial, const Clock& clock);
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

  const std::shared_ptr<Link> link_;
  const LensFacts facts_;
  const Clock& clock_;
  /// A command given, of which no effect has been seen yet.
  struct Pending {
    Instant since{};
    std::optional<Native> target;  ///< none: the search of the reference
  };
  bool Waits(Axis axis, const AxisState& state, Instant now);

  PerAxis<std::optional<Native>> targets_;  ///< the link's thread
  PerAxis<std::optional<Pending>> pending_;
  std::optional<Celsius> temperature_;  ///< the link's thread, as below
  Instant temperature_read_{};
};

}  // namespace lensd::drivers::aravis
