// One axis of a lens. What its motor is told goes to disk first, so that a crash in mid-move is known as one; what its
// readings say is kept until the next one, in the rig's own count, which a remembered position may set off from the
// device's.
#include "rig/motion/axis_controller.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rig/common/retries.h"

namespace lensd::rig {
namespace {

constexpr int kStopAttempts = 3;
/// One reading of zero may be a false answer, and a register may be renewed as seldom as every 400 ms.
/// So long after a command a register that was live at first may still show something else: it does so for
/// drivers::kRegisterLag at most, and begins by then.
constexpr Duration kMayTurnFalse = 2 * drivers::kRegisterLag;
constexpr Duration kFallShown = std::chrono::milliseconds(500);
/// A question that fails, and a count that no motion leads to, have one cause if they are no farther apart: the reading
/// before may still be one from before, and a driver may notice only afterwards that its device was gone.
constexpr Duration kSameCause = std::chrono::seconds(2);

}  // namespace

AxisController::AxisController(drivers::Axis axis, const drivers::AxisCapabilities& can, const AxisConfig& config,
                               drivers::Lens& lens, RememberedPositions& remembered, const Clock& clock)
    : lens_(lens), remembered_(remembered), clock_(clock), setup_(MakeSetup(axis, can, config)), track_(setup_) {}

void AxisController::SetBacklash(std::optional<double> backlash) {
  rig::SetBacklash(setup_, backlash);
  track_.BacklashChanged();
}

void AxisController::SetDirection(FocusDirection direction) {
  const bool up = setup_.approach_up;
  rig::SetDirection(setup_, std::move(direction));
  if (setup_.approach_up != up) track_.BacklashChanged();
}

AxisStatus AxisController::Describe(bool problem) const {
  return {.unit = setup_.can.unit,
          .position = state_->position,
          .target = target_.value_or(state_->position),
          .minimum = setup_.minimum,
          .maximum = setup_.maximum,
          .moving = !problem && moving(),
          .homed = !problem && state_->homed && known(),
          .last_known = problem,
          .bound = Native{track_.Bound() + track_.adrift()},
          .arrival = track_.NextArrival(state_->position),
          .moved_by_us = track_.moved_by_us(),
          .moved_by_another = track_.moved_by_another(),
          .fault = state_->fault,
          .lost = track_.lost(),
          .referenced = setup_.OnlyCounts() ? std::optional(track_.said()) : std::nullopt};
}

// ---- targets ------------------------------------------------------------------------------------------------------

Result<Native> AxisController::Ahead(double by) const {
  if (!target_ && !state_) return Fail(Code::Disconnected, "the lens has not reported its position");
  return (target_ ? *target_ : state_->position) + Native{by};
}

Result<Native> AxisController::Land(Native wanted) const {
  const double resolution = setup_.can.resolution;
  const double steps = std::round((wanted - setup_.can.minimum).value / resolution);
  const Native on_grid = setup_.can.minimum + Native{steps * resolution};
  if (!std::isfinite(wanted.value) || on_grid.value < setup_.minimum.value - 0.5 * resolution ||
      on_grid.value > setup_.maximum.value + 0.5 * resolution) {
    return Fail(Code::OutOfRange, "this is outside what " + std::string(AxisName(setup_.axis)) + " may reach");
  }
  return std::clamp(on_grid, setup_.minimum, setup_.maximum);
}

std::pair<Native, Native> AxisController::SearchEnds() const {
  if (!track_.lost()) return {setup_.minimum, setup_.maximum};
  return {std::max(setup_.minimum, setup_.can.minimum), std::min(setup_.maximum, setup_.can.maximum)};
}

std::optional<Error> AxisController::WhyUnknown() const {
  if (known() || !setup_.can.can_home || setup_.config.home_on_demand) return std::nullopt;
  const std::string name(AxisName(setup_.axis));
  if (track_.known()) return Error{Code::NotHomed, name + " has no reference yet: home it first"};
  return Error{Code::NotHomed, "the position of " + name +
                                   " is not known: lensd ended in mid-move, or the lens was gone or without power; "
                                   "home it first"};
}

std::optional<Error> AxisController::WhyNotSaid() const {
  const std::string name(AxisName(setup_.axis));
  const ErrorFacts facts{.axis = name};
  const auto unsupported = [&](const std::string& why) { return Fail(Code::Unsupported, why, facts).error(); };
  if (setup_.can.feedback == drivers::Feedback::Encoder) {
    return unsupported("where " + name + " stands is measured, by an encoder: nobody has to say it");
  }
  if (setup_.can.can_home)
    return unsupported(name + " has a reference: home it (lensctl home) instead of saying where it stands");
  if (!setup_.OnlyCounts()) {
    return unsupported(name + " counts no steps: its position is what it was last sent to, wherever it stands");
  }
  if (!moving() && !cut_.coasting) return std::nullopt;
  return Fail(Code::Busy, name + " is moving: wait until it has come to rest, or stop it",
              {.axis = name, .activity = "moving"})
      .error();
}

Result<void> AxisController::Say(Native position) {
  if (auto better = WhyNotSaid()) return PassOn(*std::move(better));
  const double resolution = setup_.can.resolution;
  const Native low = setup_.can.minimum, high = setup_.can.maximum;
  const Native place = low + Native{std::round((position - low).value / resolution) * resolution};
  if (!std::isfinite(position.value) || place < low || place > high) {
    return Fail(Code::OutOfRange, "this is outside the travel of " + std::string(AxisName(setup_.axis)),
                {.axis = std::string(AxisName(setup_.axis)),
                 .parameter = "position",
                 .minimum = low.value,
                 .maximum = high.value,
                 .unit = std::string(drivers::NativeUnitName(setup_.can.unit))});
  }
  if (gone_) {
    return Fail(
        Code::Timeout,
        "what the device counts has just changed without a motion, and is not certain yet: try again in a second",
        {.axis = std::string(AxisName(setup_.axis))});
  }
  const Native device = state_->position - track_.offset();
  AxisTrack said = track_;
  said.Say(place, device);
  if (auto saved = remembered_.Save(setup_.axis, said.Remember(place)); !saved) {
    if (saved.error().code == Code::Cancelled) return saved;
    return Fail(Code::NotKept, "nothing has changed, because the change could not be saved: " + saved.error().message);
  }
  track_.Say(place, device);
  leap_.reset();
  AdoptLimits(device);
  cut_.rest.departed.reset();
  state_->position = place;
  target_.reset();
  return {};
}

// ---- readings -----------------------------------------------------------------------------------------------------

std::optional<drivers::AxisState> AxisController::Note(std::optional<drivers::AxisState> reading, Instant sampled_at) {
  if (reading && Distrusts(*reading, sampled_at)) return state_;
  if (reading) HoldPosition(*reading, sampled_at);
  cut_.rest.before = state_ ? std::optional(state_->position - track_.offset()) : std::nullopt;
  const auto before = gone_ ? std::nullopt : std::exchange(state_, std::nullopt);  // after a gap it has to stand anew
  state_ = std::move(reading);
  if (!state_) return std::nullopt;
  if (cut_.halt_is_due && Halt()) Coast();
  if (gone_) Return(*state_);
  if (motion_) motion_->NoteReading();
  state_->position = state_->position + track_.offset();
  drivers::AxisState noted = *state_;
  const bool stood = before && !before->moving && !noted.moving &&
                     std::abs((noted.position - before->position).value) <= setup_.tolerance;
  // It came to rest at this reading at the latest.
  if (!stood) steady_since_ = sampled_at + setup_.settle;
  const bool was_moved = track_.moved_by_another();
  cut_.rest.follows = !cut_.rest.at_target && sampled_at < cut_.rest.commanded_at + kMayTurnFalse;
  track_.Note(noted, sampled_at,
              motion_ != nullptr || cut_.coasting || sampled_at < cut_.rest.doubted_until || cut_.rest.follows);
  if (track_.moved_by_another() && !was_moved) target_.reset();
  if (cut_.coasting && !noted.moving && sampled_at > *cut_.coasting) cut_.coasting.reset();
  if (!motion_ && !cut_.coasting && !noted.moving) RememberRest();
  // A reading from before the stop says nothing of it.
  if (cut_.coasting) state_->moving = true;
  return noted;
}

/// A single reading of another place is no motion: until more of them show one, the axis is where it rests.
void AxisController::HoldPosition(drivers::AxisState& reading, Instant sampled_at) {
  const bool young = sampled_at < cut_.rest.commanded_at + kMayTurnFalse;
  const bool sent = (motion_ && motion_->may_turn()) || cut_.coasting || (young && !cut_.rest.at_target);
  const bool rests = state_ && !gone_ && !sent && (young || !state_->moving);
  const Native place = reading.position + track_.offset();
  const double scatter = std::max(setup_.tolerance, 2.0 * setup_.config.repeatability);
  const bool senseless = state_ && !gone_ && MakesNoSense(setup_, place) && !MakesNoSense(setup_, state_->position);
  if (senseless && !rests && !cut_.rest.departed) {
    // Once, it moves nothing. What stays in a motion ends that.
    cut_.rest.departed = RestDoubt::Departed{.place = place, .since = sampled_at, .readings = RestDoubt::kShown};
    reading.position = state_->position - track_.offset();
    return;
  }
  const bool loses_reference = state_ && state_->homed && !reading.homed;
  if (!rests || loses_reference || std::abs((place - state_->position).value) <= scatter) {
    cut_.rest.departed.reset();
    return;
  }
  const bool shown = ShowsDeparture(place, reading.moving, sampled_at);
  if (senseless) {
    if (shown && reading.fault.empty()) reading.fault = SenselessText(setup_, place);
  } else if (shown) {
    cut_.rest.departed.reset();
    return;
  }
  reading.position = state_->position - track_.offset();
}

/// Two readings that agree do, or a second one that is farther; right after a command only what stays.
bool AxisController::ShowsDeparture(Native place, bool moving, Instant sampled_at) {
  const bool again = cut_.rest.departed.has_value();
  if (!again) cut_.rest.departed = RestDoubt::Departed{.place = place, .since = sampled_at};
  const Native before = std::exchange(cut_.rest.departed->place, place);
  ++cut_.rest.departed->readings;
  if (!again) return false;
  if (sampled_at < cut_.rest.commanded_at + kMayTurnFalse)
    return sampled_at >= cut_.rest.departed->since + drivers::kRegisterLag;
  const double scatter = std::max(setup_.tolerance, 2.0 * setup_.config.repeatability);
  const double farther = (place - before).value * (before - state_->position).value;
  return moving || farther > 0.0 || std::abs((place - before).value) <= scatter ||
         cut_.rest.departed->readings >= RestDoubt::kShown;
}

/// A motion that was cut short, and has not been seen to stand since, may well stop there, whatever registers have
/// shown meanwhile.
bool AxisController::StopsAt(Native device, Instant sampled_at) const {
  const auto& swept = remembered_[setup_.axis];
  const bool just_cut = cut_.coasting || sampled_at < cut_.rest.doubted_until;
  const bool cut_short = just_cut && !(motion_ && motion_->commands() > 0);
  const Native place = device + track_.offset(), room{setup_.tolerance};
  return cut_short && swept && swept->in_motion && place >= swept->lowest - room && place <= swept->highest + room;
}

/// What was, if this reading looks as if the device had been without power since.
std::optional<GoneAxis> AxisController::Fallen(Native device, Instant sampled_at) {
  const bool homes = motion_ && motion_->homing();
  if (!state_ || homes || StopsAt(device, sampled_at)) return std::nullopt;
  const auto ours = motion_ ? motion_->heading() : std::nullopt;
  GoneAxis before{AsLastKnown(), {}, state_->homed, sampled_at, device};
  if (track_.FellToZero(device, sampled_at, ours)) return before;
  if (!track_.Strays(device, sampled_at, ours, remembered_[setup_.axis])) return std::nullopt;
  before.strays = true;
  if (failed_at_ && sampled_at < *failed_at_ + kSameCause) return before;
  leap_ = Leap{before.memory, sampled_at};
  return std::nullopt;
}

/// Whether the next reading still looks so.
bool AxisController::StillFallen(Native device, Instant sampled_at) {
  const auto ours = motion_ ? motion_->heading() : std::nullopt;
  if (gone_->strays) {
    return std::abs((device - gone_->fallen_to).value) <= setup_.tolerance ||
           track_.Strays(device, sampled_at, ours, remembered_[setup_.axis]);
  }
  const bool zero = track_.AtZero(device);
  // A slow motor passes zero for a while; one that has lost its power stands there.
  if (zero && !track_.StandsAtZero(device, gone_->fallen_to)) {
    gone_->fallen_since = sampled_at;
    gone_->fallen_to = device;
  }
  return zero;
}

/// Whether the reading is left out, because no motion explains it. One that stays is believed: it has lost count.
bool AxisController::Distrusts(const drivers::AxisState& reading, Instant sampled_at) {
  if (!gone_) {
    // The one reading in between was wrong.
    const bool came_back = cut_.rest.before && track_.AtZero(*cut_.rest.before) &&
                           track_.StandsAtZero(reading.position, *cut_.rest.before);
    if (!came_back) gone_ = Fallen(reading.position, sampled_at);
    return gone_.has_value();
  }
  if (!gone_->fallen_since) return false;
  const bool fallen = StillFallen(reading.position, sampled_at);
  // A register may show the place from before for a while, and that may be zero.
  const bool may_lag = sampled_at < cut_.rest.doubted_until || (motion_ && motion_->MayLag(sampled_at));
  if (fallen && (may_lag || sampled_at - *gone_->fallen_since < kFallShown)) return true;
  gone_.reset();
  if (!fallen) return false;
  if (!motion_) target_.reset();  // of another count
  track_.LoseCount();
  AdoptLimits(reading.position);
  if (state_) state_->position = reading.position + track_.offset();
  return false;
}

/// What its position means has changed, or whether it means anything.
void AxisController::AdoptLimits(Native device) {
  track_.lost() ? SetLimitsAround(setup_, device + track_.offset()) : SetLimits(setup_, track_.offset());
}

/// The lens answers again.
void AxisController::Return(const drivers::AxisState& reading) {
  GoneAxis gone = *std::exchange(gone_, std::nullopt);
  const double moved = std::abs((reading.position + track_.offset() - gone.memory.position).value);
  if (gone.in_doubt) gone.memory.in_motion = reading.moving || moved > setup_.tolerance;
  // A device that was opened anew, or was without power, says itself that it has no reference.
  const bool says_so = gone.homed && !reading.homed && setup_.can.can_home;
  says_so ? track_.Forget() : track_.Return(gone.memory, gone.target, reading);
  if (setup_.OnlyCounts()) AdoptLimits(reading.position);
}

void AxisController::Lose(Loss loss) {
  failed_at_ = clock_.Now();
  if (loss == Loss::Answer) return;
  if (state_ && (!gone_ || gone_->fallen_since)) {
    gone_ = GoneAxis{AsLastKnown(), target_, state_->homed};
    gone_->in_doubt = motion_ && motion_->commands() == 0 && !cut_.coasting && !state_->moving;
    if (leap_ && clock_.Now() < leap_->at + kSameCause) {
      leap_->before.in_motion = leap_->before.in_motion || gone_->memory.in_motion;
      gone_->memory = leap_->before;
      track_.TakenAway(false);
    }
  }
  target_.reset();
}

AxisMemory AxisController::AsLastKnown() const {
  AxisMemory memory = track_.Remember(state_->position);
  const bool sent = motion_ && remembered_[setup_.axis] && remembered_[setup_.axis]->in_motion;
  memory.in_motion = sent || cut_.coasting || state_->moving;
  const Native room{track_.slack().whole()};  // it may have gone past its target by so much
  memory.lowest = std::min(state_->position, target_.value_or(state_->position)) - room;
  memory.highest = std::max(state_->position, target_.value_or(state_->position)) + room;
  if (motion_ && motion_->homing()) memory.known = false;
  return memory;
}

// ---- motions ------------------------------------------------------------------------------------------------------

void AxisController::Move(Native target, std::optional<double> take_up, MoveCallback done) {
  if (take_up) {
    return Start({.target = target, .overshoot = *take_up, .take_up = TakeUp::FromBeyond, .done = std::move(done)});
  }
  const auto every = setup_.config.check_reference_every;
  Start({.target = target,
         .overshoot = setup_.TakesUp() ? track_.slack().whole() : 0.0,
         .home_first = every && setup_.can.can_home && track_.travel() >= *every,
         .done = std::move(done)});
}

void AxisController::Start(MotionRequest request) {
  if (!request.parts) request.parts = setup_.impulses;
  const bool referenced = known() && state_ && state_->homed;
  if (setup_.config.home_on_demand && setup_.can.can_home && !referenced) request.home_first = true;
  request.known = track_.known();
  target_ = request.target;
  motion_ = std::make_unique<AxisMotion>(setup_, track_, std::move(request), clock_.Now());
}

std::optional<Result<MoveOutcome>> AxisController::Advance(Instant sampled_at) {
  if (!motion_ || !state_ || gone_ || !motion_->may_begin()) return std::nullopt;
  // Asked for while the lens did not answer: it may have lost its reference meanwhile.
  const bool begins = motion_->commands() == 0 && !motion_->homing();
  if (begins && !known() && setup_.config.home_on_demand && setup_.can.can_home) motion_->HomeFirst();
  if (const auto unknown = begins ? WhyUnknown() : std::nullopt) return PassOn(*unknown);
  return motion_->Step(*this, *state_, sampled_at, clock_.Now());
}

std::optional<EndedMotion> AxisController::End(Outcome outcome) {
  if (!motion_) return std::nullopt;
  const auto motion = std::exchange(motion_, nullptr);
  commands_ += motion->commands();
  if (outcome == Outcome::Reached) {
    cut_.coasting.reset();
    cut_.rest.at_target = true;
    track_.Arrived();
    RememberRest(RememberedPositions::Try::Now);
  } else {
    target_.reset();
    LoseSightOf(*motion);
    if (motion->commands() > 0) Coast();
    if (outcome == Outcome::TakenAway) track_.TakenAway(true);
  }
  return EndedMotion{motion->TakeCallback(), motion->commands()};
}

/// Of a motion that was not seen under way it is not known how far it came.
void AxisController::LoseSightOf(const AxisMotion& motion) {
  if (motion.adrift().by > 0.0) return track_.LoseSight(motion.adrift());
  const double reach = state_ ? motion.UnseenReach(*state_) : 0.0;
  const auto until = setup_.can.follows() ? AxisTrack::Until::SeenAtRest : AxisTrack::Until::Arrival;
  if (reach > 0.0 || motion.live()) track_.LoseSight({reach, until});
}

/// It is not stopped by us, or not at once.
void AxisController::Coast() {
  cut_.coasting = clock_.Now();
  cut_.rest.doubted_until = *cut_.coasting + drivers::kRegisterLag;
  cut_.rest.commanded_at = *cut_.coasting;
  cut_.rest.at_target = false;
  track_.Disturbed(clock_.Now());
}

Result<void> AxisController::Stop() {
  if (runs_out()) {
    motion_->LetRunOut();
    return Fail(Code::Unsupported,
                std::string(AxisName(setup_.axis)) + " cannot stop midway: it travels on until it rests");
  }
  Result<void> stopped;
  for (int attempt = 0; attempt < kStopAttempts && (setup_.can.can_stop || moving()); ++attempt) {
    stopped = lens_.Stop(setup_.axis);
    if (stopped || stopped.error().code != Code::Timeout) break;
  }
  cut_.halt_is_due = !stopped && setup_.can.can_stop && stopped.error().code != Code::Unsupported;
  if (moving()) Coast();
  target_.reset();
  return stopped;
}

Result<Instant> AxisController::Go(Native target, bool begins) {
  const Native room{track_.slack().whole()};
  auto remembered =
      RememberMotion(std::min(state_->position, target) - room, std::max(state_->position, target) + room);
  if (!remembered) return PassOn(remembered);
  if (begins) {
    const double ahead = (target - state_->position).value * (setup_.approach_up ? 1.0 : -1.0);
    const bool turns = state_->moving || ahead < 0.0;
    track_.Commanded(turns ? AxisTrack::Way::MayTurn : AxisTrack::Way::Onward, clock_.Now());
  }
  if (auto started = lens_.StartMove(setup_.axis, target - track_.offset()); !started) {
    const Code code = started.error().code;
    if (IsTransient(code) || code == Code::Disconnected) Lose(Loss::Answer);
    return PassOn(started);
  }
  cut_.halt_is_due = cut_.rest.at_target = false;
  return cut_.rest.commanded_at = clock_.Now();
}

Result<Instant> AxisController::Home() {
  if (auto remembered = RememberMotion(setup_.minimum, setup_.maximum); !remembered) return PassOn(remembered);
  track_.Commanded(AxisTrack::Way::MayTurn, clock_.Now());
  if (auto started = lens_.StartHome(setup_.axis); !started) return PassOn(started);
  cut_.halt_is_due = cut_.rest.at_target = false;
  return cut_.rest.commanded_at = clock_.Now();
}

Result<void> AxisController::Halt() {
  if (!setup_.can.can_stop) return Fail(Code::Unsupported, "it cannot stop midway");
  auto stopped = lens_.Stop(setup_.axis);
  cut_.halt_is_due = !stopped && stopped.error().code != Code::Unsupported;
  return stopped;
}

Error AxisController::GivenUp(Error why) {
  if (motion_ && motion_->may_turn()) why.message += HaltText(Halt());
  return why;
}

Native AxisController::AtReference(Native position) {
  const Native stands = position - track_.offset();
  track_.Homed(clock_.Now());
  SetLimits(setup_, {});
  state_->position = stands;
  return stands;
}

// ---- memory -------------------------------------------------------------------------------------------------------

void AxisController::Recall(const drivers::AxisState& reading) {
  const auto& memory = remembered_[setup_.axis];
  const bool homes_anyway = setup_.config.home_on_demand && setup_.can.can_home;
  if (memory && remembered_.readable()) {
    track_.Recall(*memory, reading);
  } else if (homes_anyway || !remembered_.readable()) {
    track_.Forget();
  }
  AdoptLimits(reading.position);
}

/// The motor may turn, somewhere from `lowest` to `highest`. NotKept: the disk does not take it, and it must not turn.
/// Cancelled.
Result<void> AxisController::RememberMotion(Native lowest, Native highest) {
  const auto& before = remembered_[setup_.axis];
  const auto covered = [&](const AxisMemory& motion) {
    return before && before->in_motion && before->lowest <= motion.lowest && before->highest >= motion.highest;
  };
  AxisMemory motion = track_.Remember(state_->position);
  motion.in_motion = true;
  motion.lowest = lowest;
  motion.highest = highest;
  if (covered(motion)) return {};
  motion.lowest = std::max(lowest, setup_.minimum);
  motion.highest = std::min(highest, setup_.maximum);
  if (before && before->in_motion) {
    // Sent elsewhere in mid-move: where it turns is not known, and more of this shall not cost a write each.
    motion.position = before->position;
    motion.lowest = setup_.minimum;
    motion.highest = setup_.maximum;
    if (covered(motion)) return {};
  }
  if (auto saved = remembered_.Save(setup_.axis, motion); !saved) {
    if (saved.error().code == Code::Cancelled) return saved;  // by a stop that did not wait for the disk
    return Fail(Code::NotKept,
                "nothing was moved, because the position could not be remembered: " + saved.error().message);
  }
  return {};
}

/// It stands. Where the disk does not take that now, a later reading tries again; until then it counts as in motion.
void AxisController::RememberRest(RememberedPositions::Try when) {
  const AxisMemory rest = track_.Remember(state_->position);
  const auto& before = remembered_[setup_.axis];
  const bool same = before && !before->in_motion && before->known == rest.known && before->offset == rest.offset &&
                    std::abs((before->position - rest.position).value) <= setup_.tolerance;
  same ? remembered_.Agrees(setup_.axis) : remembered_.SaveRest(setup_.axis, rest, clock_.Now(), when);
}

}  // namespace lensd::rig
