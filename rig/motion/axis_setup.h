// What stays the same for every motion of an axis.
#pragma once

#include <optional>
#include <vector>

#include "base/clock.h"
#include "drivers/api/lens.h"
#include "rig/config.h"
#include "rig/direction.h"
#include "rig/motion/shaping.h"

namespace lensd::rig {

/// Of the range: what the backlash of a stepping motor is taken for while it is neither configured nor measured.
constexpr double kAssumedBacklash = 0.1;

struct AxisSetup {
  drivers::Axis axis = drivers::Axis::Focus;
  drivers::AxisCapabilities can;
  AxisConfig config;
  Native minimum;  ///< soft limits, inside the capabilities
  Native maximum;
  double tolerance = 1.0;       ///< native units
  std::optional<double> speed;  ///< native units per second
  Duration settle{};            ///< from standing still to a steady picture
  FocusDirection direction{};   ///< of focus
  bool approach_up = true;      ///< the last motion goes toward larger positions
  double backlash = 0.0;        ///< native units; assumed where it is not known
  bool backlash_known = true;
  double lost_travel = 0.0;       ///< part of all travel
  std::vector<Impulse> impulses;  ///< how a step is divided; empty: not at all
  int limits_set = 0;             ///< how often the soft limits have been set

  /// Its positions are counted steps: where it counts from, only its reference or a person can tell.
  bool Counts() const { return can.feedback == drivers::Feedback::Counts; }
  /// Its positions are counted steps, and it has no reference to count from.
  bool OnlyCounts() const { return Counts() && !can.can_home; }
  /// Its positions are measured, and it has no reference: wherever it went meanwhile, they hold.
  bool Measures() const { return can.feedback == drivers::Feedback::Encoder && !can.can_home; }
  /// An overshoot that takes up the backlash, native units: none where the backlash is not known.
  bool TakesUp() const { return backlash_known && backlash > 0.0; }
};

/// Soft limits: the travel, as far as the device's count reaches that, its positions being `offset` below the rig's,
/// and the configuration allows.
void SetLimits(AxisSetup& setup, Native offset);

/// Of an axis that stands `here` by its own count, anywhere on its travel: it is no more than that from either end.
void SetLimitsAround(AxisSetup& setup, Native here);

/// As it is known now; nothing: what the driver knows, or an assumption.
void SetBacklash(AxisSetup& setup, std::optional<double> backlash);

/// As it is known now, with the side from which focus is approached.
void SetDirection(AxisSetup& setup, FocusDirection direction);

/// What a configuration and a device make of it, without a calibration. `config.limits` must leave something of the
/// range.
AxisSetup MakeSetup(drivers::Axis axis, const drivers::AxisCapabilities& can, const AxisConfig& config);

}  // namespace lensd::rig
