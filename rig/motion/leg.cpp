// A leg is one command, or the parts of a shaped step; it is judged by readings from after its first command only.
// Where the speed of an axis is not known, its range is taken to need a minute.
#include "rig/motion/leg.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

namespace lensd::rig {
namespace {

constexpr Duration kStallTime = std::chrono::seconds(1);
constexpr Duration kMargin = std::chrono::seconds(2);              ///< of a deadline beyond the time the travel needs
constexpr Duration kFullTravel = std::chrono::seconds(60);         ///< where the speed is not known
constexpr Duration kSilence = std::chrono::seconds(5);             ///< by then a lens that does not answer is an error
constexpr Duration kHomingShown = std::chrono::milliseconds(100);  ///< by then a device says that it is homing
constexpr Duration kHomingUnseen = std::chrono::seconds(5);        ///< where it never does, nor is the speed known
constexpr int kShowsMotion = 3;      ///< readings on the way, each nearer: one or two may be false answers
constexpr double kOvershoot = 0.02;  ///< of a leg: a servo may pass its target by so much
constexpr Duration kLongestAway = std::chrono::seconds(5);  ///< of an axis that is led away, until that is certain

Duration TravelTime(const AxisSetup& setup, double distance) {
  const double range = (setup.can.maximum - setup.can.minimum).value;
  std::chrono::duration<double> time = kFullTravel;
  if (setup.speed) {
    time = std::chrono::duration<double>(distance / *setup.speed);
  } else if (range > 0) {
    time *= distance / range;
  }
  return std::chrono::duration_cast<Duration>(time);
}

}  // namespace

double Scatter(const AxisSetup& setup) {
  return std::max(0.5 * setup.can.resolution, 2.0 * setup.config.repeatability);
}

bool MakesNoSense(const AxisSetup& setup, Native position) {
  const Native range = setup.can.maximum - setup.can.minimum;
  return position < std::min(setup.can.lowest_count(), setup.minimum) - range ||
         position > std::max(setup.can.highest_count(), setup.maximum) + range;
}

std::string SenselessText(const AxisSetup& setup, Native position) {
  std::ostringstream text;
  text << "its position reads " << position.value << ", far outside " << setup.can.minimum.value << " to "
       << setup.can.maximum.value << ": it is no position, or a counter that wraps";
  return text.str();
}

Leg::Leg(const AxisSetup& setup, Native from, Native to, std::vector<Impulse> parts, Start start)
    : setup_(&setup),
      from_(from),
      to_(to),
      parts_(std::move(parts)),
      turns_(start == Start::MayTurn),
      progress_{from, {}} {
  if (parts_.empty()) parts_.push_back({});
}

/// Only a reading from after now can say that it stands.
Leg Leg::Stay(const AxisSetup& setup, Native place, Instant now) {
  Leg leg(setup, place, place, {}, Start::Onward);
  leg.sent_ = 1;
  leg.times_.commanded_at = leg.progress_.at = now;
  leg.times_.deadline = now + kMargin + setup.settle;
  return leg;
}

Leg Leg::Homing(const AxisSetup& setup, const drivers::AxisState& from, Instant now) {
  Leg leg = Stay(setup, from.position, now);
  leg.approach_.seen = !from.homed;
  leg.times_.deadline = now + 2 * TravelTime(setup, (setup.can.maximum - setup.can.minimum).value) + kMargin;
  return leg;
}

// ---- commands -----------------------------------------------------------------------------------------------------

std::optional<Leg::Command> Leg::Due(Instant now) const {
  std::size_t due = std::max<std::size_t>(sent_, 1);
  while (begun() && due < parts_.size() && times_.commanded_at + parts_[due].at <= now) ++due;
  if (due == sent_) return std::nullopt;
  if (due == parts_.size()) return Command{to_, due};
  double part = 0.0;
  for (std::size_t i = 0; i < due; ++i) part += parts_[i].part;
  return Command{from_ + part * (to_ - from_), due};
}

void Leg::Sent(const Command& command, Instant now) {
  const bool first = !begun();
  sent_ = command.parts;
  times_.last_sent_at = now;
  if (!first) return;
  const double distance = std::abs((to_ - from_).value);
  const double range = (setup_->can.maximum - setup_->can.minimum).value;
  const Duration travel = TravelTime(*setup_, distance + std::min(farther_, range)), shaped = parts_.back().at;
  times_.commanded_at = progress_.at = now;
  approach_ = {.closest = distance, .farthest = distance, .nearest = distance, .live = approach_.live};
  times_.deadline = now + 2 * travel + kMargin + setup_->settle + shaped;
  times_.expected_at = now + (setup_->speed ? travel : Duration::zero()) + shaped;
}

std::optional<Instant> Leg::next_part() const {
  if (sent_ >= parts_.size()) return {};
  return times_.commanded_at + parts_[sent_].at;
}

void Leg::CutShort() {
  if (!begun() || sent_ >= parts_.size()) return;
  double part = 0.0;
  for (std::size_t i = 0; i < sent_; ++i) part += parts_[i].part;
  to_ = from_ + part * (to_ - from_);
  parts_.resize(sent_);
}

void Leg::HoldBack(Duration by, Instant now) {
  progress_.at = now;
  times_.deadline += by;
  times_.expected_at += by;
}

// ---- what the readings say ----------------------------------------------------------------------------------------

double Leg::ShortOf(const drivers::AxisState& state) const {
  return std::abs((to_ - state.position).value);
}

bool Leg::Done(const drivers::AxisState& state, Instant sampled_at) const {
  if (state.moving || !state.fault.empty()) return false;
  if (!setup_->can.follows()) return sampled_at >= times_.expected_at;
  if (Unseen(state) && sampled_at < times_.expected_at) return false;
  return ShortOf(state) <= setup_->tolerance;
}

bool Leg::FoundReference(const drivers::AxisState& state, Instant sampled_at) {
  const bool changed = std::abs((state.position - from_).value) > Scatter(*setup_);
  if (sampled_at > times_.commanded_at && (state.moving || !state.homed || changed)) approach_.seen = true;
  // From an end of the range, where references mostly are, there may be nothing to see.
  const double to_end =
      std::min(std::abs((from_ - setup_->can.minimum).value), std::abs((setup_->can.maximum - from_).value));
  if (to_end <= Scatter(*setup_)) approach_.seen = true;
  const Instant unseen = setup_->speed ? times_.deadline - kMargin / 2 : times_.commanded_at + kHomingUnseen;
  return state.homed && !state.moving && sampled_at >= (approach_.seen ? times_.commanded_at + kHomingShown : unseen);
}

bool Leg::Unseen(const drivers::AxisState& state) const {
  return setup_->can.follows() && !live() && (state.moving || state.assumed);
}

double Leg::Reach(const drivers::AxisState& state) const {
  return std::max(std::abs((state.position - from_).value), ShortOf(state));
}

void Leg::Watch(const drivers::AxisState& state, Instant sampled_at) {
  const double margin = std::max(Scatter(*setup_), setup_->tolerance);
  const double to_go = ShortOf(state), gone = std::abs((state.position - from_).value);
  const bool between = to_go > margin && gone > margin && to_go + gone <= std::abs((to_ - from_).value) + margin;
  if (!between || to_go > approach_.nearest - Scatter(*setup_)) return;
  approach_.nearest = to_go;
  const std::chrono::duration<double> since = sampled_at - times_.commanded_at;
  approach_.away.pace = (std::abs((to_ - from_).value) - to_go) / since.count();
  approach_.live = approach_.live || ++approach_.nearer >= kShowsMotion;
}

/// Of a leg that is hardly longer than the readings scatter, they cannot say whether it began.
bool Leg::Moved(const drivers::AxisState& state) const {
  const double scatter = Scatter(*setup_);
  return std::abs((to_ - from_).value) <= 4.0 * std::max(scatter, setup_->tolerance) ||
         std::abs((state.position - from_).value) > scatter;
}

/// A motor that is still on its way, after a reading that was wrong, has come nearer by `margin` by then.
Duration Leg::LedAwayTime(double margin) const {
  constexpr double kSlower = 4.0;
  const double pace = setup_->speed.value_or(approach_.away.pace);
  if (pace <= 0.0) return drivers::kRegisterLag;
  const std::chrono::duration<double> time =
      std::min<std::chrono::duration<double>>(kLongestAway, std::chrono::duration<double>(kSlower * margin / pace));
  return std::max(drivers::kRegisterLag, std::chrono::duration_cast<Duration>(time));
}

bool Leg::LedAway(const drivers::AxisState& state, Instant sampled_at) {
  if (!setup_->can.follows() || turns_) return false;
  // Before, a register may show the target, or where the axis was.
  if (MayLag(sampled_at) && approach_.nearer < kShowsMotion) return false;
  const double distance = ShortOf(state), scatter = Scatter(*setup_);
  const double margin = std::max(2.0 * scatter, setup_->tolerance);
  const bool is_place = !MakesNoSense(*setup_, state.position);
  if (is_place) approach_.farthest = std::max(approach_.farthest, distance);
  // It comes nearer all the time: what was still nearer was a false reading.
  if (is_place && approach_.away.since && distance < approach_.away.from - margin) {
    approach_.closest = distance;
    approach_.away.since.reset();
  }
  approach_.seen = approach_.seen || distance < approach_.farthest - scatter;
  if (approach_.seen) approach_.closest = std::min(approach_.closest, distance);
  const double allowed = std::max({4.0 * scatter, 8.0 * setup_->tolerance, kOvershoot * approach_.farthest});
  const bool away = approach_.seen && distance > approach_.closest + allowed;
  if (!away) approach_.away.since.reset();
  if (away && !approach_.away.since) {
    approach_.away.since = sampled_at;
    approach_.away.from = distance;
  }
  return away && sampled_at >= *approach_.away.since + LedAwayTime(margin);
}

/// What fails to answer is judged by the reader of the lens, which gives up before kSilence is over.
std::optional<Trouble> Leg::WhatIsWrong(const drivers::AxisState& state, Instant sampled_at, Instant now,
                                        bool settling) {
  if (sampled_at > times_.commanded_at) Watch(state, sampled_at);
  const bool moved =
      std::abs((state.position - progress_.position).value) >= std::max(setup_->can.resolution, Scatter(*setup_));
  if (moved || Unseen(state)) progress_ = {state.position, std::max(sampled_at, times_.commanded_at)};
  const bool stalled = setup_->can.follows() && !settling && sampled_at - progress_.at > kStallTime;
  // What was there when the lens answered again has only to be seen settled.
  const bool over = (sampled_at > times_.deadline && !settling) || now > times_.deadline + kSilence;
  if (!stalled && !over) return std::nullopt;
  std::ostringstream wrong;
  if (stalled) {
    wrong << "stalled: no progress for " << std::chrono::duration<double>(kStallTime).count() << " s, ";
  } else {
    wrong << "not there by the deadline, ";
  }
  if (Unseen(state)) {
    wrong << "and no reading showed it in motion: its position is not known";
  } else {
    wrong << ShortOf(state) << " " << drivers::NativeUnitName(setup_->can.unit) << " short of the target";
  }
  if (!state.fault.empty()) wrong << " (the lens says: " << state.fault << ")";
  return Trouble{stalled ? MoveCause::Stalled : MoveCause::Late, wrong.str()};
}

}  // namespace lensd::rig
