// The shaft of a simulated drive: a trapezoid of speed evaluated at any time.
#include <algorithm>
#include <cmath>

#include "sim/devices/modbus_drive.h"
#include "sim/mechanics/motor.h"

namespace lensd::sim {
namespace {

constexpr double kBackOff = 200.0;  // counts

double Seconds(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

double Shaft::CountAt(Duration at) const {
  double left = Seconds(at - since_);
  for (const Stretch& stretch : path_) {
    if (left < stretch.seconds) {
      return stretch.position + (stretch.speed + 0.5 * stretch.acceleration * left) * left - zero_;
    }
    left -= stretch.seconds;
  }
  return (path_.empty() ? place_ : target_) - zero_;
}

double Shaft::SpeedAt(Duration at) const {
  double left = Seconds(at - since_);
  for (const Stretch& stretch : path_) {
    if (left < stretch.seconds) return stretch.speed + stretch.acceleration * left;
    left -= stretch.seconds;
  }
  return 0.0;
}

bool Shaft::MovingAt(Duration at) const {
  double whole = 0.0;
  for (const Stretch& stretch : path_) whole += stretch.seconds;
  return Seconds(at - since_) < whole;
}

void Shaft::Go(Duration at, double target, double speed, double acceleration) {
  const double from = CountAt(at) + zero_;
  const double now = SpeedAt(at);
  path_.clear();
  for (const sim::Stretch& stretch : PlanPath(from, now, target, std::max(speed, 1e-3), std::max(acceleration, 1e-3))) {
    path_.push_back({stretch.seconds, stretch.position, stretch.speed, stretch.acceleration});
  }
  place_ = from;
  target_ = target;
  since_ = at;
}

void Shaft::MoveTo(Duration at, double target, double speed, double acceleration) {
  Go(at, target + zero_, speed, acceleration);
}

/// From close by, it backs off first, as drives do to come upon the sensor from one side.
void Shaft::MoveToReference(Duration at, double speed, double acceleration) {
  const bool close = std::abs(CountAt(at) + zero_) < kBackOff;
  Go(at, close ? kBackOff : 0.0, speed, acceleration);
  if (!close) return;
  for (const sim::Stretch& stretch :
       PlanPath(kBackOff, 0.0, 0.0, std::max(speed, 1e-3), std::max(acceleration, 1e-3))) {
    path_.push_back({stretch.seconds, stretch.position, stretch.speed, stretch.acceleration});
  }
  target_ = 0.0;
}

/// On a whole count, as a counter has nothing between.
void Shaft::Stop(Duration at, double deceleration) {
  const double speed = SpeedAt(at);
  const double way = speed * std::abs(speed) / (2.0 * std::max(deceleration, 1e-3));
  const double count = speed > 0 ? std::ceil(CountAt(at) + way) : std::floor(CountAt(at) + way);
  Go(at, (speed == 0.0 ? std::round(CountAt(at)) : count) + zero_, std::max(std::abs(speed), 1.0), deceleration);
}

void Shaft::StopDead(Duration at) {
  place_ = target_ = std::round(CountAt(at)) + zero_;
  path_.clear();
  since_ = at;
}

void Shaft::Call(Duration at, double counts) {
  zero_ += CountAt(at) - counts;
}

}  // namespace lensd::sim
