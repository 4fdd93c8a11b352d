// One motion of one axis, from the command to the truth about how it ended.
//
// A motion is followed through readings only: it is done when the device is not busy *and* stands at the target, which
// does not depend on ever having seen it busy. Readings taken before the command was given prove nothing and are
// ignored. What does not get on is reported after kStallTime, what gets on too slowly at the deadline; what comes to
// rest elsewhere is sent again a few times and then reported as missed; what goes away from where it was sent is
// somebody else's motion. Arrival is always from one side, with the backlash taken up: where it would not be, the
// motion first overshoots. The rules are those of the EPICS motor record where it has them.
#pragma once

#include <optional>
#include <utility>

#include "axis_setup.h"
#include "axis_track.h"
#include "base/clock.h"
#include "base/result.h"
#include "drivers/api/lens.h"
#include "rig/motion.h"

namespace lensd::rig {

/// The motor of one axis, as a motion commands it.
class Motor {
 public:
  virtual ~Motor() = default;
  /// `begins`: a leg of its own, not a later part of a shaped step.
  virtual Result<void> Go(Native target, bool begins) = 0;
  virtual Result<void> Home() = 0;
  virtual void Halt() = 0;
  /// The reference has been found. What a reading taken before this call means now.
  virtual Native AtReference(Native position) = 0;
};

/// When an arrival must be preceded by an overshoot.
enum class TakeUp {
  Always,     ///< unless travelling to the target takes up all backlash anyway
  FromBeyond  ///< only when coming from beyond the target: enough while nothing else has moved the axis
};

class AxisMotion {
 public:
  /// To `target`, or to the reference where there is none. `overshoot`: native units. `parts`: how each leg is divided;
  /// empty: not at all.
  AxisMotion(const AxisSetup& setup, const AxisTrack& track, std::optional<Native> target, double overshoot,
             TakeUp take_up, MoveCallback done, Instant now, std::vector<Impulse> parts)
      : setup_(setup),
        track_(track),
        target_(target),
        overshoot_(overshoot),
        take_up_(take_up),
        parts_(std::move(parts)),
        done_(std::move(done)),
        began_at_(now),
        last_step_at_(now) {}

  /// Commands the motor where that is due and judges the newest reading. The end, once there is one: an outcome, or
  /// an error where the device would not take the command.
  std::optional<Result<MoveOutcome>> Step(Motor& motor, const drivers::AxisState& state, Instant sampled_at,
                                          Instant now);

  bool homing() const { return !target_; }
  /// Motions the device was asked for so far; the parts of a shaped step are one.
  int commands() const { return commands_; }
  /// When the next part of a shaped step is due.
  std::optional<Instant> next_part() const;
  MoveCallback TakeCallback() { return std::move(done_); }

 private:
  enum class Phase { Requested, TakingUp, Going, Settling, Homing };
  using End = std::optional<Result<MoveOutcome>>;

  void HoldBack(Duration by, Instant now);
  bool StandsThere(const drivers::AxisState& state) const;
  Native FirstLeg(const drivers::AxisState& state) const;
  End Launch(Motor& motor, const drivers::AxisState& state, Instant now);
  End LaunchHoming(Motor& motor, Native position, Instant now);
  void Stay(Native position, Instant now);
  End Command(Motor& motor, Native leg, Phase phase, Native position, Instant now);
  End SendParts(Motor& motor, Instant now);
  void LegBegins(Instant now);
  End Refused(Error error);
  End Follow(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now);
  End FollowHoming(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now);
  End Arrived(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now);
  End Elsewhere(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now);
  bool LegDone(const drivers::AxisState& state, Instant sampled_at) const;
  bool Settled(const drivers::AxisState& state, Instant sampled_at);
  bool LedAway(const drivers::AxisState& state);
  std::string WhatIsWrong(const drivers::AxisState& state, Instant sampled_at, Instant now);
  double Scatter() const;
  double ShortOf(const drivers::AxisState& state) const;
  Duration TravelTime(double distance) const;
  MoveOutcome TakenAway(const drivers::AxisState& state, Instant now) const;
  MoveOutcome Failed(const drivers::AxisState& state, std::string reason, Instant now) const;
  MoveOutcome Outcome(const drivers::AxisState& state, Instant now) const;
  std::string Remark() const;

  const AxisSetup& setup_;
  const AxisTrack& track_;
  std::optional<Native> target_;
  double overshoot_;
  TakeUp take_up_;
  std::vector<Impulse> parts_;
  MoveCallback done_;
  Phase phase_ = Phase::Requested;
  Native leg_;
  Native leg_start_;
  std::size_t parts_sent_ = 0;  ///< of a shaped step
  double closest_ = 0.0;        ///< to the end of the leg, so far
  double farthest_ = 0.0;
  bool approaches_ = false;  ///< has been seen to come nearer
  int readings_away_ = 0;
  bool launched_moving_ = false;
  Native progress_position_;
  Instant progress_at_{};
  Instant began_at_;
  Instant last_step_at_;
  Instant commanded_at_{};
  Instant leg_expected_at_{};  ///< when a device without feedback will have got there
  Instant deadline_{};
  Instant stood_since_{};
  Native stood_at_;
  std::optional<Instant> rests_since_;  ///< elsewhere
  int commands_ = 0;
  int refusals_ = 0;
  int tries_ = 0;
};

}  // namespace lensd::rig
