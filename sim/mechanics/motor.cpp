// One motor between the controller's count and the mechanism: lost steps, stops, backlash and ringing, each in closed
// form, so that any instant can be asked for.
#include "sim/mechanics/motor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lensd::sim {
namespace {

// Of 112 bytes each; frames look back by one exposure, within which no rig sends this many commands.
constexpr std::size_t kMostLegs = 512;

double Seconds(Duration duration) {
  return static_cast<double>(duration.count()) * 1e-9;
}

double TimeOf(const Path& path) {
  double seconds = 0.0;
  for (const Stretch& stretch : path) seconds += stretch.seconds;
  return seconds;
}

double EndOf(const Path& path, double before) {
  return path.empty() ? before : path.back().position + path.back().TravelAfter(path.back().seconds);
}

/// Of a path after `seconds`.
Motion MotionAt(const Path& path, double before, double after, double seconds) {
  if (seconds < 0.0) return {before, 0.0};
  for (const Stretch& stretch : path) {
    if (seconds < stretch.seconds) {
      return {stretch.position + stretch.TravelAfter(seconds), stretch.SpeedAfter(seconds)};
    }
    seconds -= stretch.seconds;
  }
  return {after, 0.0};
}

}  // namespace

Motor::Motor(const MotorSettings& settings, double start) : settings_(settings), legs_(kMostLegs) {
  Leg& leg = newest();
  leg.count_before = leg.shaft_before = leg.place_before = leg.count_after = start;
}

Motor::Number Motor::NumberAt(Duration at) const {
  for (Number number = begun_; number-- > first();) {
    if (LegOf(number).start <= at) return number;
  }
  return first();
}

Path Motor::CountOf(const Leg& leg) const {
  if (!leg.goal) return {};
  const auto& [target, back] = *leg.goal;
  const auto plan = [this](double from, double speed, double to) {
    return PlanPath(from, speed, to, settings_.top_speed, settings_.acceleration);
  };
  Path path = plan(leg.count_before, leg.count_speed_before, target);
  const Path on = plan(target, 0.0, target + back);
  path.insert(path.end(), on.begin(), on.end());
  return path;
}

Motor::Paths Motor::PathsFrom(const Leg& leg) const {
  Paths paths;
  paths.count = CountOf(leg);
  const double inner_stop = settings_.low - settings_.backlash;
  paths.shaft = ThroughStops(paths.count, leg.shaft_before, 1.0 - leg.loss, inner_stop, settings_.high);
  paths.place = ThroughBacklash(paths.shaft, leg.place_before, settings_.backlash);
  return paths;
}

const Motor::Paths& Motor::PathsOf(Number number) const {
  if (number + 1 == begun_) return newest_paths_;
  if (asked_ != number) asked_paths_ = PathsFrom(LegOf(number));
  asked_ = number;
  return asked_paths_;
}

Motor::State Motor::Now(Duration at) const {
  const Leg& leg = LegOf(begun_ - 1);
  const Paths& paths = newest_paths_;
  const double seconds = Seconds(at - leg.start);
  return {MotionAt(paths.count, leg.count_before, leg.count_after, seconds),
          MotionAt(paths.shaft, leg.shaft_before, EndOf(paths.shaft, leg.shaft_before), seconds),
          MotionAt(paths.place, leg.place_before, EndOf(paths.place, leg.place_before), seconds), seconds};
}

Motor::Leg& Motor::Begin(Duration at, std::optional<Goal> goal) {
  const State now = Now(at);
  const Leg& last = newest();
  Leg next;
  next.start = at;
  next.goal = goal;
  next.count_before = now.count.position;
  next.count_speed_before = now.count.speed;
  next.shaft_before = now.shaft.position;
  next.place_before = now.place.position;
  next.place_speed_before = now.place.speed;
  next.loss = loss_;
  next.sway = SwayAt(begun_ - 1, now.seconds);
  next.homed_before = next.homed_after =
      now.seconds < TimeOf(newest_paths_.count) ? last.homed_before : last.homed_after;
  next.complains = stalled_ && last.complains;
  if (stalled_) {
    next.complains = next.complains || !CountOf(next).empty();
    next.goal.reset();
  }
  newest_paths_ = PathsFrom(next);
  next.count_after = EndOf(newest_paths_.count, next.count_before);
  ++begun_;
  return newest() = next;
}

void Motor::MoveTo(Duration at, double target) {
  Leg& leg = Begin(at, Goal{target});
  if (!stalled_) leg.count_after = target;
}

void Motor::Home(Duration at) {
  const State now = Now(at);
  // A reference switch ends the search, not a count: steps that get lost are made up for.
  const double made = std::max(1.0 - loss_, 0.01);
  const double inward = (now.shaft.position - settings_.low + settings_.backlash) / made;
  Leg& leg = Begin(at, Goal{now.count.position - inward, settings_.backlash / made});
  leg.homed_before = false;
  leg.homed_after = !stalled_;
  if (!stalled_) leg.count_after = settings_.low;
}

void Motor::Halt(Duration at, double grid) {
  const Motion now = Now(at).count;
  if (now.speed == 0.0) return;
  const double stop = now.position + now.speed * std::abs(now.speed) / (2.0 * settings_.acceleration);
  const double places = (stop - settings_.low) / grid;
  const double past = settings_.low + grid * (now.speed > 0.0 ? std::ceil(places) : std::floor(places));
  MoveTo(at, std::clamp(past, std::min(settings_.low, now.position), std::max(settings_.high, now.position)));
}

void Motor::SetStalled(Duration at, bool stalled) {
  const bool cuts_off = stalled && MovingAt(at);
  stalled_ = stalled;
  Leg& leg = Begin(at, std::nullopt);
  leg.complains = stalled && (leg.complains || cuts_off);
}

void Motor::SetLoss(Duration at, double part) {
  loss_ = part;
  const Leg& last = newest();
  const double target = last.count_after;
  const bool moving = MovingAt(at);
  if (moving && last.homed_after && !last.homed_before) return Home(at);
  Leg& leg = Begin(at, moving ? std::optional(Goal{target}) : std::nullopt);
  if (moving && !stalled_) leg.count_after = target;
}

void Motor::Knock(Duration at, double by) {
  SetLoss(at, loss_);
  Leg& leg = newest();
  const double low = settings_.low - settings_.backlash;
  const double moved = std::clamp(leg.shaft_before + by, low, settings_.high) - leg.shaft_before;
  leg.shaft_before += moved;
  leg.place_before = std::clamp(leg.place_before + moved, settings_.low, settings_.high);
  newest_paths_ = PathsFrom(leg);
}

void Motor::LosePower(Duration at) {
  Leg& leg = Begin(at, std::nullopt);
  leg.count_before = leg.count_after = settings_.low;
  leg.homed_before = leg.homed_after = false;
}

double Motor::CountAt(Duration at) const {
  const Number number = NumberAt(at);
  const Leg& leg = LegOf(number);
  return MotionAt(PathsOf(number).count, leg.count_before, leg.count_after, Seconds(at - leg.start)).position;
}

bool Motor::MovingAt(Duration at) const {
  const Number number = NumberAt(at);
  return Seconds(at - LegOf(number).start) < TimeOf(PathsOf(number).count);
}

bool Motor::HomedAt(Duration at) const {
  return MovingAt(at) ? LegAt(at).homed_before : LegAt(at).homed_after;
}

bool Motor::ComplainsAt(Duration at) const {
  return LegAt(at).complains;
}

double Motor::RestPlaceAt(Duration at) const {
  const Number number = NumberAt(at);
  const Leg& leg = LegOf(number);
  const Path& path = PathsOf(number).place;
  return MotionAt(path, leg.place_before, EndOf(path, leg.place_before), Seconds(at - leg.start)).position;
}

double Motor::PlaceAt(Duration at) const {
  const Number number = NumberAt(at);
  return RestPlaceAt(at) + SwayAt(number, Seconds(at - LegOf(number).start)).offset;
}

/// Walks the stretches up to `seconds`. On a spring, offset'' + 2 z w offset' + w^2 offset = -acceleration, and a jump
/// of the driving speed (backlash taken up, a stop hit) jumps offset' by as much the other way.
Motor::Sway Motor::SwayAt(Number number, double seconds) const {
  const Leg& leg = LegOf(number);
  Sway sway = leg.sway;
  if (seconds <= 0.0) return sway;
  const bool rings = settings_.ring_hz > 0.0;
  double speed = leg.place_speed_before;
  for (const Stretch& stretch : PathsOf(number).place) {
    const double part = std::min(seconds, stretch.seconds);
    if (rings) sway.speed -= stretch.speed - speed;
    rings ? Spring(sway, stretch.acceleration, part) : Creep(sway, stretch, part);
    speed = stretch.SpeedAfter(stretch.seconds);
    seconds -= part;
    if (seconds <= 0.0) return sway;
  }
  if (rings) sway.speed += speed;
  rings ? Spring(sway, 0.0, seconds) : Creep(sway, {}, seconds);
  return sway;
}

void Motor::Spring(Sway& sway, double acceleration, double seconds) const {
  const double w = 2.0 * std::numbers::pi * settings_.ring_hz;
  const double z = settings_.ring_damping;
  const double wd = w * std::sqrt(1.0 - z * z);
  const double rest = -acceleration / (w * w);
  const double u = sway.offset - rest;
  const double along = (sway.speed + z * w * u) / wd;
  const double decay = std::exp(-z * w * seconds);
  const double c = std::cos(wd * seconds);
  const double s = std::sin(wd * seconds);
  sway.offset = rest + decay * (u * c + along * s);
  sway.speed = decay * (wd * (along * c - u * s) - z * w * (u * c + along * s));
}

/// offset' = -offset/T - driving speed.
void Motor::Creep(Sway& sway, const Stretch& stretch, double seconds) const {
  const double t = settings_.creep_s;
  if (t <= 0.0) return;
  const double at_start = -t * stretch.speed + t * t * stretch.acceleration;
  const double at_end = at_start - t * stretch.acceleration * seconds;
  sway.offset = at_end + (sway.offset - at_start) * std::exp(-seconds / t);
}

}  // namespace lensd::sim
