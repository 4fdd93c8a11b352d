// One motor between the controller's count and the mechanism: lost steps, stops, backlash and ringing, each in closed
// form, so that any instant can be asked for.
#include "motor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lensd::sim {
namespace {

// A leg holds a few hundred bytes; frames look back by one exposure, within which no rig sends this many commands.
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

/// Where a path is after `seconds`, and how fast.
struct Motion {
  double position = 0.0;
  double speed = 0.0;
};
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

Motor::Motor(const MotorSettings& settings, double start) : settings_(settings) {
  Leg leg;
  leg.count_before = leg.shaft_before = leg.place_before = leg.count_after = start;
  legs_.push_back(std::move(leg));
}

const Motor::Leg& Motor::LegAt(Duration at) const {
  for (auto leg = legs_.rbegin(); leg != legs_.rend(); ++leg) {
    if (leg->start <= at) return *leg;
  }
  return legs_.front();
}

Motor::Leg& Motor::Begin(Duration at, Path count) {
  const Leg& last = legs_.back();
  const double seconds = Seconds(at - last.start);
  Leg next;
  next.start = at;
  next.count_before = MotionAt(last.count, last.count_before, last.count_after, seconds).position;
  next.shaft_before = MotionAt(last.shaft, last.shaft_before, EndOf(last.shaft, last.shaft_before), seconds).position;
  const Motion place = MotionAt(last.place, last.place_before, EndOf(last.place, last.place_before), seconds);
  next.place_before = place.position;
  next.place_speed_before = place.speed;
  next.sway = SwayAt(last, seconds);
  next.homed_before = next.homed_after = seconds < TimeOf(last.count) ? last.homed_before : last.homed_after;
  next.complains = stalled_ && last.complains;
  if (stalled_) {
    next.complains = next.complains || !count.empty();
    count.clear();
  }
  next.count_after = EndOf(count, next.count_before);
  next.count = std::move(count);
  const double inner_stop = settings_.low - settings_.backlash;
  next.shaft = ThroughStops(next.count, next.shaft_before, 1.0 - loss_, inner_stop, settings_.high);
  next.place = ThroughBacklash(next.shaft, next.place_before, settings_.backlash);
  legs_.push_back(std::move(next));
  if (legs_.size() > kMostLegs) legs_.pop_front();
  return legs_.back();
}

void Motor::MoveTo(Duration at, double target) {
  const Leg& last = legs_.back();
  const Motion now = MotionAt(last.count, last.count_before, last.count_after, Seconds(at - last.start));
  Leg& leg = Begin(at, PlanPath(now.position, now.speed, target, settings_.top_speed, settings_.acceleration));
  if (!stalled_) leg.count_after = target;
}

void Motor::Home(Duration at) {
  const Leg& last = legs_.back();
  const double seconds = Seconds(at - last.start);
  const Motion count = MotionAt(last.count, last.count_before, last.count_after, seconds);
  const double shaft = MotionAt(last.shaft, last.shaft_before, EndOf(last.shaft, last.shaft_before), seconds).position;
  // A reference switch ends the search, not a count: steps that get lost are made up for.
  const double made = std::max(1.0 - loss_, 0.01);
  const double inward = (shaft - settings_.low + settings_.backlash) / made;
  const double stop = count.position - inward;
  Path path = PlanPath(count.position, count.speed, stop, settings_.top_speed, settings_.acceleration);
  const Path back = PlanPath(stop, 0.0, stop + settings_.backlash / made, settings_.top_speed, settings_.acceleration);
  path.insert(path.end(), back.begin(), back.end());
  Leg& leg = Begin(at, std::move(path));
  leg.homed_before = false;
  leg.homed_after = !stalled_;
  if (!stalled_) leg.count_after = settings_.low;
}

void Motor::Halt(Duration at, double grid) {
  const Leg& last = legs_.back();
  const Motion now = MotionAt(last.count, last.count_before, last.count_after, Seconds(at - last.start));
  if (now.speed == 0.0) return;
  const double stop = now.position + now.speed * std::abs(now.speed) / (2.0 * settings_.acceleration);
  const double places = (stop - settings_.low) / grid;
  const double past = settings_.low + grid * (now.speed > 0.0 ? std::ceil(places) : std::floor(places));
  MoveTo(at, std::clamp(past, std::min(settings_.low, now.position), std::max(settings_.high, now.position)));
}

void Motor::SetStalled(Duration at, bool stalled) {
  const bool cuts_off = stalled && MovingAt(at);
  stalled_ = stalled;
  Leg& leg = Begin(at, {});
  leg.complains = stalled && (leg.complains || cuts_off);
}

void Motor::SetLoss(Duration at, double part) {
  loss_ = part;
  const Leg& last = legs_.back();
  const Motion now = MotionAt(last.count, last.count_before, last.count_after, Seconds(at - last.start));
  const double target = last.count_after;
  const bool moving = MovingAt(at);
  if (moving && last.homed_after && !last.homed_before) return Home(at);
  Leg& leg = Begin(
      at, moving ? PlanPath(now.position, now.speed, target, settings_.top_speed, settings_.acceleration) : Path{});
  if (moving && !stalled_) leg.count_after = target;
}

void Motor::Knock(Duration at, double by) {
  SetLoss(at, loss_);
  Leg& leg = legs_.back();
  const double low = settings_.low - settings_.backlash;
  const double moved = std::clamp(leg.shaft_before + by, low, settings_.high) - leg.shaft_before;
  leg.shaft_before += moved;
  leg.place_before = std::clamp(leg.place_before + moved, settings_.low, settings_.high);
  leg.shaft = ThroughStops(leg.count, leg.shaft_before, 1.0 - loss_, low, settings_.high);
  leg.place = ThroughBacklash(leg.shaft, leg.place_before, settings_.backlash);
}

void Motor::LosePower(Duration at) {
  Leg& leg = Begin(at, {});
  leg.count_before = leg.count_after = settings_.low;
  leg.homed_before = leg.homed_after = false;
}

double Motor::CountAt(Duration at) const {
  const Leg& leg = LegAt(at);
  return MotionAt(leg.count, leg.count_before, leg.count_after, Seconds(at - leg.start)).position;
}

bool Motor::MovingAt(Duration at) const {
  const Leg& leg = LegAt(at);
  return Seconds(at - leg.start) < TimeOf(leg.count);
}

bool Motor::HomedAt(Duration at) const {
  return MovingAt(at) ? LegAt(at).homed_before : LegAt(at).homed_after;
}

bool Motor::ComplainsAt(Duration at) const {
  return LegAt(at).complains;
}

double Motor::RestPlaceAt(Duration at) const {
  const Leg& leg = LegAt(at);
  return MotionAt(leg.place, leg.place_before, EndOf(leg.place, leg.place_before), Seconds(at - leg.start)).position;
}

double Motor::PlaceAt(Duration at) const {
  const Leg& leg = LegAt(at);
  return RestPlaceAt(at) + SwayAt(leg, Seconds(at - leg.start)).offset;
}

/// Walks the stretches up to `seconds`. On a spring, offset'' + 2 z w offset' + w^2 offset = -acceleration, and a jump
/// of the driving speed (backlash taken up, a stop hit) jumps offset' by as much the other way.
Motor::Sway Motor::SwayAt(const Leg& leg, double seconds) const {
  Sway sway = leg.sway;
  if (seconds <= 0.0) return sway;
  const bool rings = settings_.ring_hz > 0.0;
  double speed = leg.place_speed_before;
  for (const Stretch& stretch : leg.place) {
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
