#include "axis_motion.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace lensd::rig {
namespace {

constexpr Duration kStallTime = std::chrono::seconds(1);
constexpr Duration kMargin = std::chrono::seconds(2);              ///< of a deadline beyond the time the travel needs
constexpr Duration kFullTravel = std::chrono::seconds(60);         ///< where the speed is not known
constexpr Duration kHomingShown = std::chrono::milliseconds(100);  ///< by then a device says that it is homing
constexpr Duration kRest = std::chrono::milliseconds(50);          ///< what stands so long elsewhere goes nowhere
constexpr Duration kSteady = std::chrono::milliseconds(20);        ///< where settling is judged by readback
constexpr double kOvershoot = 0.02;                                ///< of a leg: a servo may pass its target by so much
constexpr int kAttempts = 3;

bool IsTransient(Code code) {
  return code == Code::Timeout || code == Code::Protocol || code == Code::Busy;
}

Duration Seconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

std::optional<Result<MoveOutcome>> AxisMotion::Step(Motor& motor, const drivers::AxisState& state, Instant sampled_at,
                                                    Instant now) {
  if (state.waiting) HoldBack(now - last_step_at_, now);
  last_step_at_ = now;
  switch (phase_) {
    case Phase::Requested:
      return target_ ? Launch(motor, state, now) : LaunchHoming(motor, state.position, now);
    case Phase::Homing:
      return FollowHoming(motor, state, sampled_at, now);
    case Phase::TakingUp:
    case Phase::Going:
    case Phase::Settling:
      if (auto end = SendParts(motor, now); end || parts_sent_ == 0) return end;
      return Follow(motor, state, sampled_at, now);
  }
  return std::nullopt;
}

/// The time another axis takes is not this one's.
void AxisMotion::HoldBack(Duration by, Instant now) {
  progress_at_ = now;
  deadline_ += by;
  leg_expected_at_ += by;
}

// ---- the way there ------------------------------------------------------------------------------------------------

/// Moving would gain nothing: within the dead band, and arrived from the right side.
bool AxisMotion::StandsThere(const drivers::AxisState& state) const {
  if (state.moving || !setup_.can.feedback || tries_ > 0) return false;
  const double nearly = std::max(setup_.config.deadband, 0.5 * setup_.can.resolution - 1e-9);
  return std::abs((state.position - *target_).value) <= nearly && (overshoot_ <= 0.0 || track_.slack().left() <= 0.0);
}

/// Behind the target by the overshoot where the travel to it would not take up the backlash, but never past a soft
/// limit.
Native AxisMotion::FirstLeg(const drivers::AxisState& state) const {
  if (overshoot_ <= 0.0) return *target_;
  const double sign = setup_.approach_up ? 1.0 : -1.0;
  const double ahead = sign * (*target_ - state.position).value;
  const bool taken_up = take_up_ == TakeUp::Always ? !state.moving && ahead >= track_.slack().left() && ahead >= 0.0
                                                   : ahead > -0.5 * setup_.can.resolution;
  if (taken_up) return *target_;
  const Native leg = std::clamp(*target_ - Native{sign * overshoot_}, setup_.minimum, setup_.maximum);
  const bool stands_there = !state.moving && std::abs((leg - state.position).value) < 0.5 * setup_.can.resolution;
  return stands_there ? *target_ : leg;
}

AxisMotion::End AxisMotion::Launch(Motor& motor, const drivers::AxisState& state, Instant now) {
  if (StandsThere(state)) {
    Stay(state.position, now);
    return std::nullopt;
  }
  const Native leg = FirstLeg(state);
  launched_moving_ = state.moving;
  return Command(motor, leg, leg == *target_ ? Phase::Going : Phase::TakingUp, state.position, now);
}

/// Only a reading from after now can say that it stands.
void AxisMotion::Stay(Native position, Instant now) {
  leg_ = leg_start_ = position;
  phase_ = Phase::Going;
  parts_sent_ = std::max<std::size_t>(parts_.size(), 1);
  commanded_at_ = progress_at_ = now;
  deadline_ = now + kMargin + setup_.settle;
}

AxisMotion::End AxisMotion::LaunchHoming(Motor& motor, Native position, Instant now) {
  auto started = motor.Home();
  if (!started) return Refused(started.error());
  refusals_ = 0;
  ++commands_;
  phase_ = Phase::Homing;
  commanded_at_ = progress_at_ = now;
  progress_position_ = position;
  deadline_ = now + 2 * TravelTime((setup_.can.maximum - setup_.can.minimum).value) + kMargin;
  return std::nullopt;
}

AxisMotion::End AxisMotion::Command(Motor& motor, Native leg, Phase phase, Native position, Instant now) {
  leg_ = leg;
  leg_start_ = position;
  phase_ = phase;
  parts_sent_ = 0;
  refusals_ = 0;
  return SendParts(motor, now);
}

/// The motor has taken the leg's first command.
void AxisMotion::LegBegins(Instant now) {
  ++commands_;
  commanded_at_ = progress_at_ = now;
  progress_position_ = leg_start_;
  const double distance = std::abs((leg_ - leg_start_).value);
  closest_ = farthest_ = distance;
  approaches_ = false;
  readings_away_ = 0;
  rests_since_.reset();
  const Duration shaped = parts_.empty() ? Duration::zero() : parts_.back().at;
  deadline_ = now + 2 * TravelTime(distance) + kMargin + setup_.settle + shaped;
  leg_expected_at_ = now + (setup_.speed ? TravelTime(distance) : Duration::zero()) + shaped;
}

std::optional<Instant> AxisMotion::next_part() const {
  if (phase_ == Phase::Requested || phase_ == Phase::Homing || parts_sent_ >= parts_.size()) return {};
  return commanded_at_ + parts_[parts_sent_].at;
}

/// Those parts of the step that are due, as one command; a step that is not shaped is one part.
AxisMotion::End AxisMotion::SendParts(Motor& motor, Instant now) {
  const std::size_t parts = std::max<std::size_t>(parts_.size(), 1);
  std::size_t due = std::max<std::size_t>(parts_sent_, 1);
  while (parts_sent_ > 0 && due < parts && commanded_at_ + parts_[due].at <= now) ++due;
  if (due == parts_sent_) return std::nullopt;
  double part = 0.0;
  for (std::size_t i = 0; i < due && due < parts; ++i) part += parts_[i].part;
  const Native on_the_way = leg_start_ + part * (leg_ - leg_start_);
  auto started = motor.Go(due == parts ? leg_ : on_the_way, parts_sent_ == 0);
  if (!started) return Refused(started.error());
  refusals_ = 0;
  if (parts_sent_ == 0) LegBegins(now);
  parts_sent_ = due;
  return std::nullopt;
}

/// The device may or may not have obeyed; the same command again does no harm.
AxisMotion::End AxisMotion::Refused(Error error) {
  if (IsTransient(error.code) && ++refusals_ < kAttempts) return std::nullopt;
  return std::unexpected(std::move(error));
}

// ---- what the readings say ----------------------------------------------------------------------------------------

AxisMotion::End AxisMotion::Follow(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now) {
  if (sampled_at > commanded_at_ && !next_part()) {
    if (LegDone(state, sampled_at)) {
      // Without feedback a position is the last target somebody gave.
      if (!setup_.can.feedback && ShortOf(state) > setup_.tolerance) return TakenAway(state, now);
      if (auto end = Arrived(motor, state, sampled_at, now); end || phase_ != Phase::Settling) return end;
    } else {
      if (phase_ == Phase::Settling) phase_ = Phase::Going;
      if (LedAway(state)) return TakenAway(state, now);
      const int commands = commands_;
      if (auto end = Elsewhere(motor, state, sampled_at, now); end || commands_ != commands) return end;
    }
  }
  if (std::string wrong = WhatIsWrong(state, sampled_at, now); !wrong.empty()) {
    // A motor that hums against an obstacle must not go on.
    motor.Halt();
    return Failed(state, std::move(wrong), now);
  }
  return std::nullopt;
}

AxisMotion::End AxisMotion::FollowHoming(Motor& motor, const drivers::AxisState& state, Instant sampled_at,
                                         Instant now) {
  if (sampled_at >= commanded_at_ + kHomingShown && state.homed && !state.moving) {
    drivers::AxisState stands = state;
    stands.position = motor.AtReference(state.position);
    return Outcome(stands, now);
  }
  std::string wrong;
  if (!state.fault.empty() && !state.moving) wrong = "homing failed: " + state.fault;
  if (now > deadline_) wrong = "found no reference in time";
  if (wrong.empty()) return std::nullopt;
  motor.Halt();
  return Failed(state, std::move(wrong), now);
}

bool AxisMotion::LegDone(const drivers::AxisState& state, Instant sampled_at) const {
  if (state.moving) return false;
  if (!setup_.can.feedback) return sampled_at >= leg_expected_at_;
  return ShortOf(state) <= setup_.tolerance;
}

AxisMotion::End AxisMotion::Arrived(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now) {
  if (!rests_since_) rests_since_ = sampled_at;
  launched_moving_ = false;
  if (phase_ == Phase::TakingUp) return Command(motor, *target_, Phase::Going, state.position, now);
  if (phase_ == Phase::Going) {
    stood_since_ = sampled_at;
    stood_at_ = state.position;
    phase_ = Phase::Settling;
    return std::nullopt;
  }
  if (!Settled(state, sampled_at)) return std::nullopt;
  return Outcome(state, now);
}

/// One reading alone may be an answer to an earlier question.
bool AxisMotion::Settled(const drivers::AxisState& state, Instant sampled_at) {
  if (setup_.config.settle_by_readback && std::abs((state.position - stood_at_).value) > Scatter()) {
    stood_since_ = sampled_at;
    stood_at_ = state.position;
  }
  const Duration settle = setup_.config.settle_by_readback ? kSteady : setup_.settle;
  return sampled_at > stood_since_ && sampled_at - stood_since_ >= settle;
}

/// Stands where it was not sent, and not because it cannot move: that is for WhatIsWrong() to say.
AxisMotion::End AxisMotion::Elsewhere(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now) {
  // Of a leg that is hardly longer than the readings scatter, they cannot say whether it began.
  const bool short_leg = std::abs((leg_ - leg_start_).value) <= 4.0 * std::max(Scatter(), setup_.tolerance);
  const bool moved = tries_ > 0 || short_leg || std::abs((state.position - leg_start_).value) > Scatter();
  if (state.moving || !setup_.can.feedback || !state.fault.empty() || !moved) {
    rests_since_.reset();
    return std::nullopt;
  }
  if (!rests_since_) rests_since_ = sampled_at;
  if (sampled_at - *rests_since_ < std::max(kRest, setup_.settle)) return std::nullopt;
  if (phase_ == Phase::TakingUp) return Command(motor, *target_, Phase::Going, state.position, now);
  if (tries_ < setup_.config.retries) {
    ++tries_;
    return Launch(motor, state, now);
  }
  std::ostringstream reason;
  reason << "missed: stands " << ShortOf(state) << " " << drivers::NativeUnitName(setup_.can.unit)
         << " from the target after " << tries_ << (tries_ == 1 ? " retry" : " retries");
  MoveOutcome outcome = Failed(state, reason.str(), now);
  outcome.missed = true;
  return outcome;
}

/// It came nearer and now goes away again, by more than overshooting or a missed target explains: somebody else
/// commands it.
bool AxisMotion::LedAway(const drivers::AxisState& state) {
  // What was moving already may have to turn first.
  if (!setup_.can.feedback || launched_moving_) return false;
  const double distance = ShortOf(state);
  farthest_ = std::max(farthest_, distance);
  approaches_ = approaches_ || distance < farthest_ - Scatter();
  if (approaches_) closest_ = std::min(closest_, distance);
  const double allowed = std::max({4.0 * Scatter(), 8.0 * setup_.tolerance, kOvershoot * farthest_});
  readings_away_ = approaches_ && distance > closest_ + allowed ? readings_away_ + 1 : 0;
  return readings_away_ >= 2;
}

std::string AxisMotion::WhatIsWrong(const drivers::AxisState& state, Instant sampled_at, Instant now) {
  if (std::abs((state.position - progress_position_).value) >= std::max(setup_.can.resolution, Scatter())) {
    progress_position_ = state.position;
    progress_at_ = std::max(sampled_at, commanded_at_);
  }
  std::ostringstream wrong;
  const auto unit = drivers::NativeUnitName(setup_.can.unit);
  if (setup_.can.feedback && phase_ != Phase::Settling && now - progress_at_ > kStallTime) {
    wrong << "stalled: no progress for " << std::chrono::duration<double>(kStallTime).count() << " s, "
          << ShortOf(state) << " " << unit << " short of the target";
  } else if (now > deadline_) {
    wrong << "not there by the deadline, " << ShortOf(state) << " " << unit << " short of the target";
  }
  std::string text = wrong.str();
  if (!text.empty() && !state.fault.empty()) text += " (the lens says: " + state.fault + ")";
  return text;
}

/// Readings of one place differ by up to this.
double AxisMotion::Scatter() const {
  return std::max(0.5 * setup_.can.resolution, 2.0 * setup_.config.repeatability);
}

double AxisMotion::ShortOf(const drivers::AxisState& state) const {
  return std::abs((leg_ - state.position).value);
}

Duration AxisMotion::TravelTime(double distance) const {
  if (setup_.speed) return Seconds(distance / *setup_.speed);
  const double range = (setup_.can.maximum - setup_.can.minimum).value;
  return range > 0 ? Seconds(std::chrono::duration<double>(kFullTravel).count() * distance / range) : kFullTravel;
}

// ---- the truth ----------------------------------------------------------------------------------------------------

MoveOutcome AxisMotion::TakenAway(const drivers::AxisState& state, Instant now) const {
  MoveOutcome outcome = Failed(state, "moved by another program", now);
  outcome.moved_by_another = true;
  return outcome;
}

MoveOutcome AxisMotion::Failed(const drivers::AxisState& state, std::string reason, Instant now) const {
  MoveOutcome outcome = Outcome(state, now);
  outcome.reached = outcome.settled = outcome.verified = false;
  outcome.reason = std::move(reason);
  return outcome;
}

MoveOutcome AxisMotion::Outcome(const drivers::AxisState& state, Instant now) const {
  MoveOutcome outcome;
  outcome.axis = setup_.axis;
  outcome.reached = outcome.settled = true;
  outcome.verified = setup_.can.feedback && (track_.known() || homing());
  outcome.position = state.position;
  outcome.bound = Native{track_.Bound()};
  outcome.reason = Remark();
  outcome.elapsed = now - began_at_;
  return outcome;
}

/// What a reader of a good result should know all the same.
std::string AxisMotion::Remark() const {
  if (!setup_.can.feedback) return "no position feedback";
  if (!track_.known() && !homing()) return "the position is not known: lensd ended in mid-move";
  if (homing() || track_.slack().residue() <= 0.0) return "";
  std::ostringstream remark;
  if (setup_.backlash_known) {
    remark << track_.slack().residue() << " " << drivers::NativeUnitName(setup_.can.unit)
           << " of backlash not taken up: the soft limits leave no room";
  } else {
    remark << "backlash not known: the bound allows for 10 % of the range";
  }
  return remark.str();
}

}  // namespace lensd::rig
