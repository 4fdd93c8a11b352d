// A motor behind registers that do not say the truth at once, as this test's own model of the world: it shares nothing
// with the drivers. Whoever plays its wire steps the clock.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <random>
#include <utility>

#include "base/clock.h"

namespace lensd::testing {

/// How one device is. Times in milliseconds.
struct DeviceKind {
  enum class Busy { True, Late, Early, Absent };
  double range = 1000.0;  ///< positions are 0 to this
  double speed = 1000.0;  ///< a second
  double starts_after = 0.0;
  double echo = 0.0;        ///< so long after a write the register shows the target
  double stale = 0.0;       ///< so long it shows the place from before
  bool stale_first = true;  ///< where both are: which wins
  /// After it was live, the position register shows something else for a while, or once.
  enum class Lie { Nothing, Target, Before, Near, Far };
  Lie lie = Lie::Nothing;
  bool lies_once = false;
  double lie_begins = 0.0;  ///< after a write
  double lie_lasts = 0.0;   ///< unless it is one reading
  bool varies = false;      ///< all this, and what is wrong with Busy, are drawn anew, up to these, at each write
  Busy busy = Busy::True;
  double busy_off = 0.0;  ///< late: rises and falls so much later; early: ends so much before the motion does

  bool truthful() const { return echo == 0.0 && stale == 0.0 && busy == Busy::True && lie == Lie::Nothing; }
};

class RegisterDevice {
 public:
  RegisterDevice(DeviceKind kind, std::mt19937_64& random) : kind_(kind), now_(kind), random_(random) {}
  const DeviceKind& kind() const { return kind_; }

  void Write(double target, Instant at) { Go(std::clamp(std::round(target), 0.0, kind_.range), target, at); }
  void Stop(Instant at) {
    const double here = Shaft(at);
    Go(here, target_, at);  // a register that echoes shows the target it knows
  }
  double Shaft(Instant at) const {
    const double gone = std::max(0.0, Ms(at) - now_.starts_after) * 1e-3 * kind_.speed;
    return gone >= std::abs(to_ - from_) ? to_ : from_ + std::copysign(gone, to_ - from_);
  }
  bool Turns(Instant at) const { return Shaft(at) != to_; }
  double PositionRegister(Instant at) {
    if (Lies(at)) return Lied(at);
    const bool echoes = Ms(at) < now_.echo, lags = Ms(at) < now_.stale;
    if (echoes && (!lags || !now_.stale_first)) return std::round(target_);
    if (lags) return std::round(from_);
    return std::round(Shaft(at));
  }
  bool BusyRegister(Instant at) const {
    const double ends = now_.starts_after + 1e3 * std::abs(to_ - from_) / kind_.speed, since = Ms(at);
    switch (now_.busy) {
      case DeviceKind::Busy::True:
        return since < ends;
      case DeviceKind::Busy::Late:
        return since >= now_.busy_off && since < ends + now_.busy_off;
      case DeviceKind::Busy::Early:
        return since < ends - now_.busy_off;
      case DeviceKind::Busy::Absent:
        return false;
    }
    return false;
  }

 private:
  bool Lies(Instant at) {
    if (now_.lie == DeviceKind::Lie::Nothing || Ms(at) < now_.lie_begins) return false;
    if (now_.lies_once) return !std::exchange(lied_, true);
    return Ms(at) < now_.lie_begins + now_.lie_lasts;
  }
  double Lied(Instant at) {
    if (now_.lie == DeviceKind::Lie::Target) return std::round(target_);
    if (now_.lie == DeviceKind::Lie::Before) return std::round(from_);
    const double by = now_.lie == DeviceKind::Lie::Near ? 40.0 : 1e6;
    if (!lies_at_) lies_at_ = std::round(Shaft(at)) + std::copysign(by, side_);
    return *lies_at_;
  }
  double Ms(Instant at) const { return std::chrono::duration<double, std::milli>(at - written_).count(); }
  void Go(double to, double target, Instant at) {
    from_ = Shaft(at);
    to_ = to;
    target_ = target;
    written_ = at;
    now_ = kind_;
    lied_ = false;
    lies_at_.reset();
    side_ = -side_;
    if (!kind_.varies) return;
    std::uniform_real_distribution<double> part(0.0, 1.0);
    now_.echo *= part(random_);
    now_.stale *= part(random_);
    now_.stale_first = part(random_) < 0.5;
    now_.busy = static_cast<DeviceKind::Busy>(static_cast<int>(4.0 * part(random_)));
    now_.busy_off *= part(random_);
    now_.lie_begins *= part(random_);
    now_.lie_lasts *= part(random_);
  }

  const DeviceKind kind_;
  DeviceKind now_;  ///< of this write
  std::mt19937_64& random_;
  bool lied_ = true;  ///< since the last write; what it says first is true
  std::optional<double> lies_at_;
  double side_ = -1.0;  ///< to which a place beside the true one lies
  double from_ = 0.0, to_ = 0.0, target_ = 0.0;
  Instant written_{Duration::min() / 2};
};

}  // namespace lensd::testing
