// One motor of a simulated LensConnect lens.
#pragma once

#include <cstdint>
#include <optional>

#include "base/clock.h"

namespace lensd::sim::devices {

struct LensConnectMotorTraits {
  bool present = true;
  std::uint16_t mechanical_minimum = 0, mechanical_maximum = 4000;
  std::uint16_t optical_minimum = 100, optical_maximum = 3900;
  std::uint16_t home_position = 2000;
  std::uint16_t speed = 2000, speed_minimum = 100, speed_maximum = 8000;  ///< pulses per second
  bool can_stop = true;
};

/// Straight motion at its speed. Time is handed in and never goes back.
class LensConnectMotor {
 public:
  explicit LensConnectMotor(const LensConnectMotorTraits& traits) : traits_(traits), speed_(traits.speed) {}

  /// Ignored while busy, before homing, out of range, and where it stands already: busy never rises then.
  void Move(std::uint16_t target, Instant now);
  /// To its mechanical minimum and then to its home position. Ignored while busy.
  void Home(Instant now);
  void Stop(Instant now);
  void SetSpeed(std::uint16_t speed);
  /// The next motion ends half way.
  void Jam() { jammed_ = true; }
  /// As if it had been without power: where it is is not known any more.
  void LosePower(Instant now);

  bool Busy(Instant now) const { return leg_ && now < leg_->ends; }
  bool NeedsHome(Instant now) const { return needs_home_ && !(leg_ && leg_->homing && now >= leg_->ends); }
  std::uint16_t Position(Instant now) const;
  std::uint16_t target() const { return target_; }
  std::uint16_t speed() const { return speed_; }
  const LensConnectMotorTraits& traits() const { return traits_; }

 private:
  struct Leg {
    double from = 0.0, turn = 0.0, to = 0.0;  ///< by way of `turn`
    Instant began{}, ends{};
    bool homing = false;
  };
  enum class Purpose { Move, Home };
  void Begin(double turn, double to, Purpose purpose, Instant now);
  void Rest(Instant now);

  LensConnectMotorTraits traits_;
  std::uint16_t speed_;
  std::uint16_t target_ = 0;
  double position_ = 0.0;
  bool needs_home_ = true;
  bool jammed_ = false;
  std::optional<Leg> leg_;
};

}  // namespace lensd::sim::devices
