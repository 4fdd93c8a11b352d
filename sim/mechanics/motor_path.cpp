// Trapezoids of speed as stretches of constant acceleration, and what end stops and backlash make of them.
#include <algorithm>
#include <cmath>

#include "sim/mechanics/motor.h"

namespace lensd::sim {
namespace {

/// When the stretch has travelled `distance`, which has the sign of its travel and is no longer than it.
double TimeToTravel(const Stretch& stretch, double distance) {
  if (distance == 0.0) return 0.0;
  const double root = std::sqrt(std::max(0.0, stretch.speed * stretch.speed + 2.0 * stretch.acceleration * distance));
  const double time = 2.0 * distance / (stretch.speed + std::copysign(root, distance));
  return std::clamp(time, 0.0, stretch.seconds);
}

void Append(Path& path, const Stretch& stretch) {
  if (stretch.seconds > 0.0) path.push_back(stretch);
}

/// Appends `stretch` in two halves of its time: before `time` and after it, either standing at `place` or following.
void AppendHoldThenFollow(Path& path, const Stretch& stretch, double time, double place) {
  Append(path, {time, place, 0.0, 0.0});
  Append(path, {stretch.seconds - time, place, stretch.SpeedAfter(time), stretch.acceleration});
}

}  // namespace

Path PlanPath(double position, double speed, double target, double top_speed, double acceleration) {
  Path path;
  const double direction = target >= position ? 1.0 : -1.0;
  const double toward = speed * direction;
  const double stopping = speed * speed / (2.0 * acceleration);
  // A path taken up again while braking ends a rounding error off its target: that is no reason to come back.
  const double room = std::abs(target - position) + 1e-9 * stopping;
  if (toward < 0.0 || stopping > room) {
    const Stretch brake{std::abs(speed) / acceleration, position, speed, -std::copysign(acceleration, speed)};
    Append(path, brake);
    const Path rest = PlanPath(position + std::copysign(stopping, speed), 0.0, target, top_speed, acceleration);
    path.insert(path.end(), rest.begin(), rest.end());
    return path;
  }
  const double distance = std::abs(target - position);
  if (distance == 0.0) return path;
  const double peak = std::min(top_speed, std::sqrt(acceleration * distance + 0.5 * toward * toward));
  const double gain_s = std::max(0.0, (peak - toward) / acceleration);
  const double gain = 0.5 * (toward + peak) * gain_s;
  const double brake_s = peak / acceleration;
  const double brake = 0.5 * peak * brake_s;
  const double cruise = std::max(0.0, distance - gain - brake);
  Append(path, {gain_s, position, speed, direction * acceleration});
  Append(path, {cruise / peak, position + direction * gain, direction * peak, 0.0});
  Append(path, {brake_s, target - direction * brake, direction * peak, -direction * acceleration});
  return path;
}

Path ThroughBacklash(const Path& shaft, double place, double gap) {
  Path path;
  for (const Stretch& push : shaft) {
    const double travel = push.TravelAfter(push.seconds);
    const double slack =
        travel >= 0.0 ? std::max(0.0, place - push.position) : std::min(0.0, place - (push.position + gap));
    if (std::abs(travel) <= std::abs(slack)) {
      Append(path, {push.seconds, place, 0.0, 0.0});
      continue;
    }
    AppendHoldThenFollow(path, push, TimeToTravel(push, slack), place);
    place += travel - slack;
  }
  return path;
}

Path ThroughStops(const Path& count, double shaft, double part, double low, double high) {
  Path path;
  for (const Stretch& driven : count) {
    const Stretch moved{driven.seconds, shaft, driven.speed * part, driven.acceleration * part};
    const double travel = moved.TravelAfter(moved.seconds);
    const double room = travel >= 0.0 ? std::max(0.0, high - shaft) : std::min(0.0, low - shaft);
    if (std::abs(travel) <= std::abs(room)) {
      Append(path, moved);
      shaft += travel;
      continue;
    }
    const double time = TimeToTravel(moved, room);
    shaft += room;
    Append(path, {time, moved.position, moved.speed, moved.acceleration});
    Append(path, {moved.seconds - time, shaft, 0.0, 0.0});
  }
  return path;
}

}  // namespace lensd::sim
