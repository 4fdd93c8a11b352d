// What the positions of the axes mean for the picture, under the conditions of the moment.
#pragma once

#include <memory>
#include <optional>

#include "rig/motion/axis_controller.h"
#include "rig/rig.h"

namespace lensd::rig {

/// Calibration, optics and what follows from them; nothing of it commands the lens.
class OpticalState {
 public:
  /// The optics under this configuration; nothing where they are not known. Errors as Rig::Create().
  static Result<std::optional<OpticsTable>> TableFor(const RigConfig& config, const drivers::Device& device,
                                                     std::shared_ptr<const Calibration> calibration);

  /// `axes` must outlive it; `table` is TableFor() of the same lens.
  OpticalState(RigConfig config, const AxisControllers& axes, std::optional<OpticsTable> table,
               std::shared_ptr<const Calibration> calibration);

  /// nullptr: not known. Stays where it is until the calibration changes.
  const OpticsTable* table() const { return table_ ? &*table_ : nullptr; }
  /// The same where it says what the positions of focus mean; nullptr: it does not, or nobody knows where focus stands.
  const OpticsTable* focus_table() const;
  const std::shared_ptr<const Calibration>& calibration() const { return calibration_; }
  /// Another calibration, and TableFor() of it.
  void Adopt(std::optional<OpticsTable> table, std::shared_ptr<const Calibration> calibration);
  /// Another direction that was seen, and TableFor() with it.
  void Adopt(std::optional<OpticsTable> table, std::optional<drivers::Direction> seen);
  const RigConfig& config() const { return config_; }
  /// Zoom and filter are taken from the axes.
  void NoteConditions(std::optional<Celsius> temperature);
  Backlash BacklashOf(drivers::Axis axis) const;

  /// Where a target that optics decide lies, native units. Errors as Rig::Resolve().
  Result<Native> Aim(drivers::Axis axis, const Target& target) const;
  /// What targets of this kind the axis can take, in the unit in which a caller gives them.
  ErrorFacts ReachOf(drivers::Axis axis, const Target& target) const;
  /// Where the iris stands or goes; nothing where that is not known.
  std::optional<FNumber> f_number() const;
  /// Adds what the position means, and how surely.
  void Describe(MoveOutcome& outcome) const;
  void Describe(LensedFrame& frame) const;
  /// `problem`: the lens does not answer.
  void Describe(Status& status, bool problem) const;

  /// What focus is held at as the temperature changes: where it was last brought. Nothing: it was not.
  void Hold(std::optional<Metres> extension) { held_ = extension; }
  std::optional<Metres> held() const { return held_; }
  /// Where focus belongs by now, if that is worth a move.
  std::optional<Native> Drifted() const;

 private:
  void DescribeBounds(Status& status) const;
  void AdoptBacklash();
  void AdoptDirection();
  bool Compensates() const;
  Result<Metres> ExtensionOf(const Target& target) const;
  optics::FocusScale ScaleOf(const Target& target) const;
  std::pair<double, double> ReachOfFocus(const Target& target, Native low, Native high) const;
  Metres ExtensionBound(Native position, Native bound) const;
  FNumber FNumberBound(Native position, Native bound) const;
  const AxisController* Known(drivers::Axis axis) const;
  bool Lost(drivers::Axis axis) const;

  RigConfig config_;  ///< before the calibration fills in what it leaves open
  const AxisControllers& axes_;
  std::optional<OpticsTable> table_;
  std::shared_ptr<const OpticsTable> shared_table_;  ///< the same, for those on other threads
  std::shared_ptr<const Calibration> calibration_;
  std::optional<Metres> held_;
};

}  // namespace lensd::rig
