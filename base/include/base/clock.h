// Time as an injected dependency, so that a thousand autofocus runs take seconds and tests never sleep.
#pragma once

#include <atomic>
#include <chrono>

namespace lensd {

using Duration = std::chrono::nanoseconds;
/// A point on CLOCK_MONOTONIC (std::chrono::steady_clock on Linux).
using Instant = std::chrono::time_point<std::chrono::steady_clock, Duration>;

/// Where "now" comes from. Thread-safe.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual Instant Now() const = 0;
};

/// The machine's monotonic clock.
class MonotonicClock final : public Clock {
 public:
  Instant Now() const override { return std::chrono::steady_clock::now(); }
};

/// A clock that moves only when told to. Starts at 0.
class SteppedClock final : public Clock {
 public:
  Instant Now() const override { return Instant{Duration{now_ns_.load()}}; }
  void Advance(Duration by) { now_ns_ += by.count(); }
  /// Moves forward to `to`; never backward.
  void AdvanceTo(Instant to) {
    const Duration by = to - Now();
    if (by > Duration::zero()) Advance(by);
  }

 private:
  std::atomic<Duration::rep> now_ns_{0};
};

}  // namespace lensd
