// The machine's clock with the calls of a stepped one: for a simulated device of the tests' own, in real time or in a
// time that passes more quickly.
#pragma once

#include <thread>

#include "base/clock.h"

namespace lensd::testing {

class SleepingClock final : public Clock {
 public:
  explicit SleepingClock(int times = 1) : times_(times), begin_(clock_.Now()) {}
  Instant Now() const override { return begin_ + times_ * (clock_.Now() - begin_); }
  /// What is shorter than a thread can sleep takes no time.
  void Advance(Duration by) {
    if (by / times_ >= std::chrono::microseconds(100)) std::this_thread::sleep_for(by / times_);
  }
  void AdvanceTo(Instant to) { std::this_thread::sleep_until(begin_ + (to - begin_) / times_); }

 private:
  const MonotonicClock clock_;
  const int times_;
  const Instant begin_;
};

}  // namespace lensd::testing
