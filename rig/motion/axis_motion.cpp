// A motion is a search of the reference where one is due, then a leg that takes up backlash where one is due, then a
// leg to the target, and settling. Each begins from what the readings say of the one before.
#include "rig/motion/axis_motion.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "rig/common/retries.h"

namespace lensd::rig {
namespace {

constexpr Duration kRest = std::chrono::milliseconds(50);    ///< what stands so long elsewhere goes nowhere
constexpr Duration kFault = std::chrono::milliseconds(300);  ///< a fault that stands so long ends the motion
constexpr Duration kSteady = std::chrono::milliseconds(20);  ///< where settling is judged by readback

std::string LostText(const AxisSetup& setup, const std::string& why) {
  const std::string name(AxisName(setup.axis));
  return "where " + name + " stands is not known: " + why +
         (setup.can.can_home ? "; home it: lensctl home " + name : "; say it with lensctl here " + name + " @N");
}

}  // namespace

std::string HaltText(const Result<void>& halted) {
  if (halted) return "; the motor was commanded to stop";
  if (halted.error().code == Code::Unsupported) return "; the motor cannot be stopped midway";
  return "; the motor is not stopped yet: the stop will be sent as soon as the lens answers (" +
         halted.error().message + ")";
}

std::optional<Result<MoveOutcome>> AxisMotion::Step(Motor& motor, const drivers::AxisState& state, Instant sampled_at,
                                                    Instant now) {
  if (state.waiting) leg_.HoldBack(now - last_step_at_, now);
  last_step_at_ = now;
  if (LostCount()) {
    // A counter that wraps may come to zero too.
    const bool faulty = !state.fault.empty();
    std::string why = (faulty ? "the lens reports: " + state.fault + "; " : "") +
                      LostText(setup_, "it lost count on the way, as after a loss of power") + HaltText(motor.Halt());
    return Failed(state, {faulty ? MoveCause::Fault : MoveCause::PositionUnknown, std::move(why)}, now);
  }
  auto end = Advance(motor, state, sampled_at, now);
  if (!end || !runs_out_ || !*end) return end;
  return std::unexpected(RanOut(state, **end));
}

bool AxisMotion::LostCount() const {
  return setup_.Counts() && !track_.known() && request_.known && attempts_.commands > 0 && !homing();
}

std::optional<AxisTrack::Heading> AxisMotion::heading() const {
  if (attempts_.commands == 0 || homing()) return std::nullopt;
  return AxisTrack::Heading{leg_.to(), leg_.live()};
}

/// That it rests is said only where it has been seen.
Error AxisMotion::RanOut(const drivers::AxisState& state, const MoveOutcome& end) const {
  std::ostringstream text;
  text << "stopped, but " << AxisName(setup_.axis) << " cannot stop midway: ";
  if (end.cause == MoveCause::Late || leg_.Unseen(state)) {
    text << "it was sent to " << leg_.to().value << ", and nothing shows whether it has come to rest";
  } else {
    text << "it travelled on and rests at " << end.position.value;
  }
  return {Code::Cancelled, text.str()};
}

AxisMotion::End AxisMotion::Advance(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now) {
  switch (phase_) {
    case Phase::Requested:
      return homing() ? LaunchHoming(motor, state, now) : Launch(motor, state, now);
    case Phase::Homing:
      return FollowHoming(motor, state, sampled_at, now);
    case Phase::TakingUp:
    case Phase::Going:
    case Phase::Settling:
      if (auto end = SendParts(motor, now); end || !leg_.begun()) return end;
      return Follow(motor, state, sampled_at, now);
  }
  return std::nullopt;
}

double AxisMotion::UnseenReach(const drivers::AxisState& state) const {
  const bool under_way = phase_ == Phase::TakingUp || phase_ == Phase::Going || phase_ == Phase::Settling;
  const bool unseen = !setup_.can.follows() || leg_.Unseen(state);
  return under_way && leg_.begun() && unseen ? leg_.Reach(state) + track_.adrift() : 0.0;
}

void AxisMotion::LetRunOut() {
  runs_out_ = true;
  leg_.CutShort();
}

// ---- the way there ------------------------------------------------------------------------------------------------

/// Moving would gain nothing: within the dead band, and arrived from the right side. Where the lens still complains of
/// an earlier command, or the last motion did not arrive, only a new one tells whether it obeys: its reading may be an
/// echo.
bool AxisMotion::StandsThere(const drivers::AxisState& state) const {
  if (state.moving || !state.fault.empty() || !setup_.can.follows() || attempts_.tries > 0) return false;
  if (!track_.arrived()) return false;
  const double nearly = std::max(setup_.config.deadband, 0.5 * setup_.can.resolution - 1e-9);
  return std::abs((state.position - *request_.target).value) <= nearly &&
         (request_.overshoot <= 0.0 || track_.slack().left() <= 0.0);
}

/// Behind the target by the overshoot where the travel to it would not take up the backlash, but never past a soft
/// limit.
Native AxisMotion::FirstLeg(const drivers::AxisState& state) const {
  if (request_.overshoot <= 0.0) return *request_.target;
  const double sign = setup_.approach_up ? 1.0 : -1.0;
  const double ahead = sign * (*request_.target - state.position).value;
  const bool taken_up = request_.take_up == TakeUp::Always
                            ? !state.moving && ahead >= track_.slack().left() && ahead >= 0.0
                            : ahead > -0.5 * setup_.can.resolution;
  if (taken_up) return *request_.target;
  const Native leg = std::clamp(*request_.target - Native{sign * request_.overshoot}, setup_.minimum, setup_.maximum);
  const bool stands_there = !state.moving && std::abs((leg - state.position).value) < 0.5 * setup_.can.resolution;
  return stands_there ? *request_.target : leg;
}

AxisMotion::End AxisMotion::Launch(Motor& motor, const drivers::AxisState& state, Instant now) {
  if (StandsThere(state)) {
    leg_ = Leg::Stay(setup_, state.position, now);
    phase_ = Phase::Going;
    return std::nullopt;
  }
  const Native to = FirstLeg(state);
  const Phase phase = to == *request_.target ? Phase::Going : Phase::TakingUp;
  const auto start = state.moving ? Leg::Start::MayTurn : Leg::Start::Onward;
  Leg leg(setup_, state.position, to, *request_.parts, start);
  leg.MayBeFarther(track_.adrift());
  return Begin(motor, std::move(leg), phase, now);
}

AxisMotion::End AxisMotion::LaunchHoming(Motor& motor, const drivers::AxisState& state, Instant now) {
  if (now < attempts_.again_at) return std::nullopt;
  auto started = motor.Home();
  if (!started) return Refused(motor, started.error(), now);
  Taken();
  ++attempts_.commands;
  phase_ = Phase::Homing;
  leg_ = Leg::Homing(setup_, state, *started);
  return std::nullopt;
}

AxisMotion::End AxisMotion::Begin(Motor& motor, Leg leg, Phase phase, Instant now) {
  if (leg_.live()) leg.TakeAsLive();
  leg_ = std::move(leg);
  phase_ = phase;
  Taken();
  return SendParts(motor, now);
}

/// The backlash has been taken up.
AxisMotion::End AxisMotion::GoOnToTarget(Motor& motor, Native from, Instant now) {
  return Begin(motor, Leg(setup_, from, *request_.target, *request_.parts, Leg::Start::Onward), Phase::Going, now);
}

std::optional<Instant> AxisMotion::next_part() const {
  if (phase_ == Phase::Requested || phase_ == Phase::Homing) return {};
  return leg_.next_part();
}

AxisMotion::End AxisMotion::SendParts(Motor& motor, Instant now) {
  const auto due = leg_.Due(now);
  if (!due || now < attempts_.again_at) return std::nullopt;
  const bool begins = !leg_.begun();
  auto started = motor.Go(due->place, begins);
  if (!started) return Refused(motor, started.error(), now);
  Taken();
  leg_.Sent(*due, *started);
  if (begins) {
    ++attempts_.commands;
    rest_.since.reset();
  }
  return std::nullopt;
}

void AxisMotion::Taken() {
  attempts_.refusals = 0;
  attempts_.busy_since.reset();
}

/// The device may or may not have obeyed; the same command again does no harm. Where it is given up, the motor must not
/// turn on unwatched.
AxisMotion::End AxisMotion::Refused(Motor& motor, Error error, Instant now) {
  const bool busy = error.code == Code::Busy;
  if (busy && !attempts_.busy_since) attempts_.busy_since = now;
  if (busy || error.code == Code::Protocol) attempts_.again_at = now + kBusyAgain;
  if (IsTransient(error.code) || error.code == Code::Disconnected) attempts_.in_doubt = true;
  if (!busy && attempts_.refusals++ == 0) attempts_.refused_at = now;
  // An answer that is lost is no refusal, and is asked for again as a busy device is. One that is broken may be one.
  const bool patient = (error.code == Code::Timeout && now - attempts_.refused_at < kBusyPatience) ||
                       (error.code == Code::Protocol && now - attempts_.refused_at < kBrokenPatience);
  const bool again = busy ? now - *attempts_.busy_since < kBusyPatience
                          : IsTransient(error.code) && (patient || attempts_.refusals < kAttempts);
  if (again) return std::nullopt;
  error = StillBusy(std::move(error));
  if (may_turn()) error.message += HaltText(motor.Halt());
  return PassOn(std::move(error));
}

// ---- what the readings say ----------------------------------------------------------------------------------------

AxisMotion::End AxisMotion::Follow(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now) {
  if (sampled_at > leg_.commanded_at() && Faulty(state, sampled_at)) {
    return Failed(state, {MoveCause::Fault, "the lens reports: " + state.fault}, now);
  }
  if (sampled_at > leg_.commanded_at() && !next_part()) {
    if (leg_.Done(state, sampled_at)) {
      // Without feedback a position is the last target that any program gave.
      if (!setup_.can.follows() && leg_.ShortOf(state) > setup_.tolerance) return TakenAway(state, now);
      if (auto end = Arrived(motor, state, sampled_at, now); end || phase_ != Phase::Settling) return end;
    } else {
      if (phase_ == Phase::Settling) phase_ = Phase::Going;
      // What the lens complains of explains where it goes.
      if (state.fault.empty() && leg_.LedAway(state, sampled_at)) return TakenAway(state, now);
      const int commands = attempts_.commands;
      auto end = leg_.MayBeLedAway() ? std::nullopt : Elsewhere(motor, state, sampled_at, now);
      if (end || attempts_.commands != commands) return end;
    }
  }
  if (auto wrong = leg_.WhatIsWrong(state, sampled_at, now, phase_ == Phase::Settling)) {
    // A motor that hums against an obstacle must not go on.
    wrong->reason += HaltText(motor.Halt());
    adrift_ = AdriftAfter(*wrong, state);
    return Failed(state, *std::move(wrong), now);
  }
  return std::nullopt;
}

/// Readings that cease to change are those of a motor that is stuck or of a register that is: where the device does not
/// say itself that it stalled, the axis may be anywhere from there to where it was sent.
AxisTrack::Adrift AxisMotion::AdriftAfter(const Trouble& trouble, const drivers::AxisState& state) const {
  if (leg_.Unseen(state)) return {leg_.Reach(state) + track_.adrift(), AxisTrack::Until::Arrival};
  if (trouble.cause != MoveCause::Stalled || !state.fault.empty()) return {};
  return {std::max(leg_.ShortOf(state), track_.adrift()), AxisTrack::Until::SeenToChange};
}

AxisMotion::End AxisMotion::FollowHoming(Motor& motor, const drivers::AxisState& state, Instant sampled_at,
                                         Instant now) {
  if (leg_.FoundReference(state, sampled_at)) {
    drivers::AxisState stands = state;
    stands.position = motor.AtReference(state.position);
    if (!request_.target || runs_out_) return Outcome(stands, now);
    request_.home_first = false;
    return Launch(motor, stands, now);
  }
  Trouble wrong;
  if (!state.fault.empty() && !state.moving) wrong = {MoveCause::Fault, "homing failed: " + state.fault};
  if (leg_.late(now)) wrong = {MoveCause::NoReference, "found no reference in time"};
  if (wrong.cause == MoveCause::None) return std::nullopt;
  wrong.reason += HaltText(motor.Halt());
  return Failed(state, std::move(wrong), now);
}

/// A device that complains and stands still does not get there; that it says its target proves nothing.
bool AxisMotion::Faulty(const drivers::AxisState& state, Instant sampled_at) {
  if (state.fault.empty() || state.moving) {
    rest_.faulty_since.reset();
    return false;
  }
  if (!rest_.faulty_since) rest_.faulty_since = sampled_at;
  return sampled_at - *rest_.faulty_since >= kFault;
}

AxisMotion::End AxisMotion::Arrived(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now) {
  if (!rest_.since) rest_.since = sampled_at;
  if (phase_ == Phase::TakingUp && !runs_out_) return GoOnToTarget(motor, state.position, now);
  if (phase_ != Phase::Settling) {
    rest_.stood_since = sampled_at;
    rest_.stood_at = state.position;
    phase_ = Phase::Settling;
    return std::nullopt;
  }
  if (!Settled(state, sampled_at)) return std::nullopt;
  return Outcome(state, now);
}

/// One reading alone may be an answer to an earlier question.
bool AxisMotion::Settled(const drivers::AxisState& state, Instant sampled_at) {
  if (setup_.config.settle_by_readback && std::abs((state.position - rest_.stood_at).value) > Scatter(setup_)) {
    rest_.stood_since = sampled_at;
    rest_.stood_at = state.position;
  }
  const Duration settle = setup_.config.settle_by_readback ? kSteady : setup_.settle;
  return sampled_at > rest_.stood_since && sampled_at - rest_.stood_since >= settle;
}

/// Stands where it was not sent, and not because it cannot move: that is for Leg::WhatIsWrong() to say.
AxisMotion::End AxisMotion::Elsewhere(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now) {
  const bool moved = attempts_.tries > 0 || leg_.Moved(state);
  if (state.moving || leg_.Unseen(state) || !setup_.can.follows() || !state.fault.empty() || !moved) {
    rest_.since.reset();
    return std::nullopt;
  }
  // What still changes its place does not stand, whatever the device says.
  const double margin = std::max(Scatter(setup_), setup_.tolerance);
  if (!rest_.since || std::abs((state.position - rest_.elsewhere).value) > margin) {
    rest_.since = sampled_at;
    rest_.elsewhere = state.position;
  }
  if (sampled_at - *rest_.since < std::max(kRest, setup_.settle)) return std::nullopt;
  if (runs_out_) return Outcome(state, now);
  if (phase_ == Phase::TakingUp) return GoOnToTarget(motor, state.position, now);
  if (attempts_.tries < setup_.config.retries) {
    ++attempts_.tries;
    return Launch(motor, state, now);
  }
  std::ostringstream reason;
  reason << "missed: stands " << leg_.ShortOf(state) << " " << drivers::NativeUnitName(setup_.can.unit)
         << " from the target after " << attempts_.tries << (attempts_.tries == 1 ? " retry" : " retries");
  MoveOutcome outcome = Failed(state, {MoveCause::Missed, reason.str()}, now);
  outcome.missed = true;
  return outcome;
}

// ---- the truth ----------------------------------------------------------------------------------------------------

/// Only what can be a place of the axis shows that somebody brought it there.
MoveOutcome AxisMotion::TakenAway(const drivers::AxisState& state, Instant now) const {
  if (MakesNoSense(setup_, state.position)) {
    return Failed(state, {MoveCause::Fault, SenselessText(setup_, state.position)}, now);
  }
  MoveOutcome outcome = Failed(state, {MoveCause::External, "moved by another program"}, now);
  outcome.moved_by_another = true;
  return outcome;
}

MoveOutcome AxisMotion::Failed(const drivers::AxisState& state, Trouble trouble, Instant now) const {
  MoveOutcome outcome = Outcome(state, now);
  outcome.reached = outcome.settled = outcome.verified = false;
  outcome.bound = outcome.bound + Native{std::max(adrift_.by, live() ? 0.0 : track_.adrift())};
  outcome.cause = trouble.cause;
  outcome.reason = std::move(trouble.reason);
  return outcome;
}

MoveOutcome AxisMotion::Outcome(const drivers::AxisState& state, Instant now) const {
  MoveOutcome outcome;
  outcome.axis = setup_.axis;
  outcome.reached = outcome.settled = true;
  outcome.verified = Measured(state);
  outcome.position = state.position;
  outcome.bound = track_.lost() || LostCount() ? setup_.can.maximum - setup_.can.minimum : Native{track_.Bound()};
  Trouble remark = Remark(state);
  outcome.cause = remark.cause;
  outcome.reason = std::move(remark.reason);
  outcome.elapsed = now - began_at_;
  return outcome;
}

/// An encoder has seen it there, or it stands at its reference. Steps that are counted may have been lost on the way.
bool AxisMotion::Measured(const drivers::AxisState& state) const {
  if (!setup_.can.follows() || state.assumed || !state.homed || !track_.known()) return false;
  return setup_.can.feedback == drivers::Feedback::Encoder || track_.travel() <= 0.0;
}

/// What a reader of a good result should know all the same.
Trouble AxisMotion::Remark(const drivers::AxisState& state) const {
  std::ostringstream behind;
  const bool counts = setup_.can.feedback != drivers::Feedback::None;
  if (counts && !setup_.backlash_known && !homing() && track_.slack().residue() > 0.0) {
    behind << "; the mechanism may be up to " << std::ceil(track_.slack().residue()) << " "
           << drivers::NativeUnitName(setup_.can.unit) << " behind the motor, whose backlash is not known";
  }
  if (!setup_.can.follows()) {
    const bool echo = setup_.can.feedback == drivers::Feedback::Echo;
    return {
        MoveCause::NoFeedback,
        std::string("no position feedback") + (echo ? ": the device repeats its target" : "") +
            (setup_.speed || setup_.settle > Duration::zero() ? ""
                                                              : ", and no speed is known: it may still be on its way") +
            behind.str()};
  }
  if (track_.lost()) {
    return {MoveCause::PositionUnknown, LostText(setup_, "it counts from wherever it was")};
  }
  if (!track_.known() || !state.homed) {
    return {MoveCause::PositionUnknown, "the position is not known: no reference"};
  }
  if (state.assumed) {
    return {MoveCause::NoFeedback, "nothing has shown that it moved: the position may repeat the target"};
  }
  const bool measured = Measured(state);
  const std::string counted = measured ? "" : "steps counted, not measured";
  if (homing() || track_.slack().residue() <= 0.0) return {measured ? MoveCause::None : MoveCause::Counted, counted};
  if (setup_.backlash_known) {
    behind << "; " << track_.slack().residue() << " " << drivers::NativeUnitName(setup_.can.unit)
           << " of backlash not taken up: the soft limits leave no room";
  }
  constexpr std::size_t kSemicolon = 2;
  return {MoveCause::Backlash, measured ? behind.str().substr(kSemicolon) : counted + behind.str()};
}

}  // namespace lensd::rig
