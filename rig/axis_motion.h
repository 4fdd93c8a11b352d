// One motion of one axis, from the command to the truth about how it ended.
//
// A motion is followed through readings only: it is done when the device is not busy *and* stands at the target, which
// does not depend on ever having seen it busy. Readings taken before the command was given prove nothing and are
// ignored. What does not get on is reported after kStallTime, what gets on too slowly at the deadline. Where arrival
// must come from one side, a motion from the other side first overshoots by the backlash.
#pragma once

#include <optional>
#include <utility>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/api/lens.h"
#include "rig/config.h"
#include "rig/motion.h"

namespace lensd::rig {

/// What stays the same for every motion of an axis.
struct AxisSetup {
  drivers::Axis axis = drivers::Axis::Focus;
  drivers::AxisCapabilities can;
  AxisConfig config;
  Native minimum;  ///< soft limits, inside the capabilities
  Native maximum;
  double tolerance = 1.0;       ///< native units
  std::optional<double> speed;  ///< native units per second
  Duration settle{};            ///< from standing still to a steady picture
  bool approach_up = true;      ///< the last motion goes toward larger positions
};

class AxisMotion {
 public:
  /// To `target`, or to the reference where there is none. `take_up`: how far to overshoot when coming from the wrong
  /// side, native units.
  AxisMotion(const AxisSetup& setup, std::optional<Native> target, double take_up, MoveCallback done, Instant now)
      : setup_(setup), target_(target), take_up_(take_up), done_(std::move(done)), began_at_(now), last_step_at_(now) {}

  /// Commands the device where that is due and judges the newest reading. The end, once there is one: an outcome, or
  /// an error where the device would not take the command.
  std::optional<Result<MoveOutcome>> Step(drivers::Lens& lens, const drivers::AxisState& state, Instant sampled_at,
                                          Instant now);

  bool homing() const { return !target_; }
  /// Motions the device was asked for so far.
  int commands() const { return commands_; }
  MoveCallback TakeCallback() { return std::move(done_); }

 private:
  enum class Phase { Requested, TakingUp, Going, Settling, Homing };
  using End = std::optional<Result<MoveOutcome>>;

  void HoldBack(Duration by, Instant now);
  Native FirstLeg(Native position);
  End Launch(drivers::Lens& lens, Native position, Instant now);
  End Command(drivers::Lens& lens, Native leg, Phase phase, Native position, Instant now);
  End Retry(Error error);
  End Follow(drivers::Lens& lens, const drivers::AxisState& state, Instant sampled_at, Instant now);
  End FollowHoming(drivers::Lens& lens, const drivers::AxisState& state, Instant sampled_at, Instant now);
  bool LegDone(const drivers::AxisState& state, Instant sampled_at) const;
  std::string WhatIsWrong(const drivers::AxisState& state, Instant sampled_at, Instant now);
  Duration TravelTime(double distance) const;
  End GiveUp(drivers::Lens& lens, const drivers::AxisState& state, std::string reason, Instant now);
  MoveOutcome Outcome(const drivers::AxisState& state, Instant now) const;

  const AxisSetup& setup_;
  std::optional<Native> target_;
  double take_up_;
  double residue_ = 0.0;  ///< backlash the overshoot could not take up, native units
  MoveCallback done_;
  Phase phase_ = Phase::Requested;
  Native leg_;
  Native progress_position_;
  Instant progress_at_{};
  Instant began_at_;
  Instant last_step_at_;
  Instant commanded_at_{};
  Instant leg_expected_at_{};  ///< when a device without feedback will have got there
  Instant deadline_{};
  Instant stood_since_{};
  int commands_ = 0;
  int refusals_ = 0;
};

}  // namespace lensd::rig
