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
constexpr int kAttempts = 3;

bool IsTransient(Code code) {
  return code == Code::Timeout || code == Code::Protocol || code == Code::Busy;
}

Duration Seconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

std::optional<Result<MoveOutcome>> AxisMotion::Step(drivers::Lens& lens, const drivers::AxisState& state,
                                                    Instant sampled_at, Instant now) {
  if (state.waiting) HoldBack(now - last_step_at_, now);
  last_step_at_ = now;
  switch (phase_) {
    case Phase::Requested:
      return Launch(lens, state.position, now);
    case Phase::Homing:
      return FollowHoming(lens, state, sampled_at, now);
    case Phase::TakingUp:
    case Phase::Going:
    case Phase::Settling:
      return Follow(lens, state, sampled_at, now);
  }
  return std::nullopt;
}

/// The time another axis takes is not this one's.
void AxisMotion::HoldBack(Duration by, Instant now) {
  progress_at_ = now;
  deadline_ += by;
  leg_expected_at_ += by;
}

/// Past the target by the backlash where arrival would otherwise be from the wrong side, but never past a soft limit.
Native AxisMotion::FirstLeg(Native position) {
  const double beyond = (position - *target_).value * (setup_.approach_up ? 1.0 : -1.0);
  const bool arrives_wrong = beyond >= 0.5 * setup_.can.resolution;
  if (!arrives_wrong || take_up_ <= 0) return *target_;
  const Native past = *target_ + Native{setup_.approach_up ? -take_up_ : take_up_};
  const Native leg = std::clamp(past, setup_.minimum, setup_.maximum);
  residue_ = std::abs((leg - past).value);
  return leg;
}

AxisMotion::End AxisMotion::Launch(drivers::Lens& lens, Native position, Instant now) {
  if (target_) {
    const Native leg = FirstLeg(position);
    const Phase phase = leg == *target_ ? Phase::Going : Phase::TakingUp;
    return Command(lens, leg, phase, position, now);
  }
  auto started = lens.StartHome(setup_.axis);
  if (!started) return Retry(started.error());
  ++commands_;
  phase_ = Phase::Homing;
  commanded_at_ = progress_at_ = now;
  progress_position_ = position;
  deadline_ = now + 2 * TravelTime((setup_.can.maximum - setup_.can.minimum).value) + kMargin;
  return std::nullopt;
}

AxisMotion::End AxisMotion::Command(drivers::Lens& lens, Native leg, Phase phase, Native position, Instant now) {
  auto started = lens.StartMove(setup_.axis, leg);
  if (!started) return Retry(started.error());
  ++commands_;
  refusals_ = 0;
  leg_ = leg;
  phase_ = phase;
  commanded_at_ = progress_at_ = now;
  progress_position_ = position;
  const double distance = std::abs((leg - position).value);
  deadline_ = now + 2 * TravelTime(distance) + kMargin + setup_.settle;
  leg_expected_at_ = now + (setup_.speed ? TravelTime(distance) : Duration::zero());
  return std::nullopt;
}

/// The device may or may not have obeyed; the same command again does no harm.
AxisMotion::End AxisMotion::Retry(Error error) {
  if (IsTransient(error.code) && ++refusals_ < kAttempts) return std::nullopt;
  return std::unexpected(std::move(error));
}

AxisMotion::End AxisMotion::Follow(drivers::Lens& lens, const drivers::AxisState& state, Instant sampled_at,
                                   Instant now) {
  if (sampled_at > commanded_at_) {
    if (!LegDone(state, sampled_at)) {
      if (phase_ == Phase::Settling) phase_ = Phase::Going;
    } else if (phase_ == Phase::TakingUp) {
      return Command(lens, *target_, Phase::Going, state.position, now);
    } else {
      if (phase_ == Phase::Going) stood_since_ = sampled_at;
      phase_ = Phase::Settling;
      if (sampled_at - stood_since_ >= setup_.settle) return Outcome(state, now);
    }
  }
  if (std::string wrong = WhatIsWrong(state, sampled_at, now); !wrong.empty()) {
    return GiveUp(lens, state, std::move(wrong), now);
  }
  return std::nullopt;
}

AxisMotion::End AxisMotion::FollowHoming(drivers::Lens& lens, const drivers::AxisState& state, Instant sampled_at,
                                         Instant now) {
  if (sampled_at >= commanded_at_ + kHomingShown && state.homed && !state.moving) return Outcome(state, now);
  if (!state.fault.empty() && !state.moving) return GiveUp(lens, state, "homing failed: " + state.fault, now);
  if (now > deadline_) return GiveUp(lens, state, "found no reference in time", now);
  return std::nullopt;
}

bool AxisMotion::LegDone(const drivers::AxisState& state, Instant sampled_at) const {
  if (state.moving) return false;
  if (!setup_.can.feedback) return sampled_at >= leg_expected_at_;
  return std::abs((state.position - leg_).value) <= setup_.tolerance;
}

std::string AxisMotion::WhatIsWrong(const drivers::AxisState& state, Instant sampled_at, Instant now) {
  if (std::abs((state.position - progress_position_).value) >= setup_.can.resolution) {
    progress_position_ = state.position;
    progress_at_ = std::max(sampled_at, commanded_at_);
  }
  std::ostringstream wrong;
  const double short_of = std::abs((leg_ - state.position).value);
  const auto unit = drivers::NativeUnitName(setup_.can.unit);
  if (setup_.can.feedback && phase_ != Phase::Settling && now - progress_at_ > kStallTime) {
    wrong << "stalled: no progress for " << std::chrono::duration<double>(kStallTime).count() << " s, " << short_of
          << " " << unit << " short of the target";
  } else if (now > deadline_) {
    wrong << "not there by the deadline, " << short_of << " " << unit << " short of the target";
  }
  std::string text = wrong.str();
  if (!text.empty() && !state.fault.empty()) text += " (the lens says: " + state.fault + ")";
  return text;
}

Duration AxisMotion::TravelTime(double distance) const {
  if (setup_.speed) return Seconds(distance / *setup_.speed);
  const double range = (setup_.can.maximum - setup_.can.minimum).value;
  return range > 0 ? Seconds(std::chrono::duration<double>(kFullTravel).count() * distance / range) : kFullTravel;
}

AxisMotion::End AxisMotion::GiveUp(drivers::Lens& lens, const drivers::AxisState& state, std::string reason,
                                   Instant now) {
  // A motor that hums against an obstacle must not go on; that it cannot be stopped changes nothing about the answer.
  if (setup_.can.can_stop) (void)lens.Stop(setup_.axis);
  MoveOutcome outcome = Outcome(state, now);
  outcome.reached = outcome.settled = outcome.verified = false;
  outcome.reason = std::move(reason);
  return outcome;
}

MoveOutcome AxisMotion::Outcome(const drivers::AxisState& state, Instant now) const {
  MoveOutcome outcome;
  outcome.axis = setup_.axis;
  outcome.reached = outcome.settled = true;
  outcome.verified = setup_.can.feedback;
  outcome.position = state.position;
  outcome.bound = Native{0.5 * setup_.can.resolution + residue_};
  if (!setup_.can.feedback) {
    outcome.bound = outcome.bound + Native{setup_.tolerance};
    outcome.reason = "no position feedback";
  }
  outcome.elapsed = now - began_at_;
  return outcome;
}

}  // namespace lensd::rig
