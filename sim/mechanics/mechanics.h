// The lens as a body: its motors, what the fault script does to them, and the optics that follow from where they are.
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "base/clock.h"
#include "drivers/api/lens.h"
#include "sim/mechanics/fault_line.h"
#include "sim/mechanics/motor.h"
#include "sim/scene.h"
#include "sim/world.h"

namespace lensd::sim {

/// The capabilities of the lens a scene describes.
drivers::Capabilities CapabilitiesOf(const LensSettings& lens);

/// Every call takes the time from the clock and locks: any thread.
class Mechanics {
 public:
  Mechanics(std::shared_ptr<const Scene> scene, const Clock& clock, double focus_start);

  /// Time since the making of the world.
  Duration Now() const { return clock_.Now() - epoch_; }
  Instant InstantOf(Duration time) const { return epoch_ + time; }

  void MoveTo(drivers::Axis axis, double target);
  void Home(drivers::Axis axis);
  void Halt(drivers::Axis axis);
  /// What the controller says of its axes; an axis in `frozen` as it was then.
  drivers::LensState Report(const drivers::PerAxis<std::optional<Duration>>& frozen);

  /// How things were at a time not after now and not before Earliest().
  TrueState StateAt(Duration at);
  /// How far back StateAt() knows: to the beginning, unless many hundred commands have come since.
  Duration Earliest();

  /// The fault of that kind in force at `at`; `axis` where the kind is about one.
  std::optional<Fault> FaultAt(FaultKind kind, Duration at, std::optional<drivers::Axis> axis = std::nullopt);
  bool Disconnected();
  /// From now on, whatever `fault` says of its beginning.
  void Inject(Fault fault);

  const Scene& scene() const { return *scene_; }
  const drivers::Capabilities& capabilities() const { return capabilities_; }

 private:
  /// Of the lens, which has its power from the plug that is pulled.
  void LosePower(Duration at);
  /// Brings the fault script up to date and returns the time now. Call with the lock held.
  Duration Advance();
  void Happen(const FaultLine::Event& event);
  TrueState StateOf(Duration at) const;
  double TemperatureAt(Duration at) const;  ///< degrees Celsius
  double Grid(drivers::Axis axis) const;
  double PositionAt(drivers::Axis axis, Duration at) const;

  const std::shared_ptr<const Scene> scene_;
  const Clock& clock_;
  const Instant epoch_;
  const drivers::Capabilities capabilities_;
  const double focus_off_m_;  ///< of the truth region from the frame's middle

  std::mutex mutex_;
  FaultLine faults_;
  drivers::PerAxis<std::optional<Motor>> motors_;
  drivers::PerAxis<std::optional<double>> told_;  ///< the last target, where positions are no more than that
};

}  // namespace lensd::sim
