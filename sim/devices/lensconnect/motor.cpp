// One motor of the simulated LensConnect lens: where it is at any time, by closed form.
#include <algorithm>
#include <cmath>

#include "sim/devices/lensconnect_motor.h"

namespace lensd::sim::devices {

std::uint16_t LensConnectMotor::Position(Instant now) const {
  if (!leg_) return static_cast<std::uint16_t>(std::lround(position_));
  if (now >= leg_->ends) return static_cast<std::uint16_t>(std::lround(leg_->to));
  double way = std::chrono::duration<double>(now - leg_->began).count() * speed_;
  const double first = std::abs(leg_->turn - leg_->from);
  double from = leg_->from, to = leg_->turn;
  if (way > first) {
    way -= first;
    from = leg_->turn;
    to = leg_->to;
  }
  const double at = from + std::copysign(std::min(way, std::abs(to - from)), to - from);
  return static_cast<std::uint16_t>(std::lround(at));
}

/// What is over is done with, before something new begins.
void LensConnectMotor::Rest(Instant now) {
  if (!leg_) return;
  const bool arrived = now >= leg_->ends;
  position_ = Position(now);
  if (arrived && leg_->homing) needs_home_ = false;
  leg_.reset();
}

void LensConnectMotor::Begin(double turn, double to, Purpose purpose, Instant now) {
  const bool homing = purpose == Purpose::Home;
  if (jammed_ && !homing) to = turn = std::round(0.5 * (position_ + to));
  jammed_ = false;
  const double way = std::abs(turn - position_) + std::abs(to - turn);
  const auto takes = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(way / speed_));
  leg_ = Leg{position_, turn, to, now, now + takes, homing};
}

void LensConnectMotor::Move(std::uint16_t target, Instant now) {
  if (Busy(now)) return;
  Rest(now);
  const bool inside = target >= traits_.mechanical_minimum && target <= traits_.mechanical_maximum;
  if (needs_home_ || !inside || target == Position(now)) return;
  target_ = target;
  Begin(target, target, Purpose::Move, now);
}

void LensConnectMotor::Home(Instant now) {
  if (Busy(now)) return;
  Rest(now);
  needs_home_ = true;
  target_ = traits_.home_position;
  Begin(traits_.mechanical_minimum, traits_.home_position, Purpose::Home, now);
}

void LensConnectMotor::Stop(Instant now) {
  if (traits_.can_stop) Rest(now);
}

void LensConnectMotor::SetSpeed(std::uint16_t speed) {
  if (speed >= traits_.speed_minimum && speed <= traits_.speed_maximum && !leg_) speed_ = speed;
}

void LensConnectMotor::LosePower(Instant now) {
  Rest(now);
  position_ = 0.0;
  needs_home_ = true;
}

}  // namespace lensd::sim::devices
