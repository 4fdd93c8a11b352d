// What a simulated lens remembers takes no more memory however long it runs.
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "motor.h"
#include "test_level.h"

namespace lensd::sim {
namespace {

/// In use of the heap.
std::size_t LiveBytes() {
  return mallinfo2().uordblks;
}

/// Sanitizers have allocators of their own, of which mallinfo2() knows nothing.
bool LiveBytesAreCounted() {
  const std::size_t before = LiveBytes();
  const std::vector<char> trial(std::size_t{64} << 10);
  return LiveBytes() >= before + trial.size();
}

Duration FromSeconds(double seconds) {
  return Duration(std::llround(seconds * 1e9));
}

/// A motor and commands and faults at random.
class DrawnMotor {
 public:
  explicit DrawnMotor(unsigned seed) : random_(seed), motor_(Settings(), 3000.0) {}

  const Motor& motor() const { return motor_; }
  /// Of the last command, and the next.
  Duration last() const { return last_; }
  Duration next() const { return next_; }

  void Command() {
    last_ = next_;
    next_ += FromSeconds(Uniform(0.001, 0.4));
    const double kind = Uniform(0.0, 1.0);
    if (kind < 0.55) return motor_.MoveTo(last_, std::round(Uniform(0.0, 8191.0)));
    if (kind < 0.75) return motor_.Halt(last_, 1.0);
    if (kind < 0.80) return motor_.Home(last_);
    if (kind < 0.85) return motor_.SetLoss(last_, Uniform(0.0, 1.0) < 0.5 ? 0.0 : Uniform(0.0, 1.0));
    if (kind < 0.90) return motor_.Knock(last_, Uniform(-200.0, 200.0));
    if (kind < 0.95) return motor_.LosePower(last_);
    motor_.SetStalled(last_, Uniform(0.0, 1.0) < 0.5);
  }
  double Uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

 private:
  MotorSettings Settings() {
    MotorSettings settings;
    settings.high = 8191.0;
    settings.top_speed = Uniform(1000.0, 20000.0);
    settings.acceleration = Uniform(20000.0, 400000.0);
    settings.backlash = Uniform(0.0, 1.0) < 0.3 ? 0.0 : Uniform(0.0, 60.0);
    settings.creep_s = Uniform(0.0, 0.01);
    settings.ring_hz = Uniform(0.0, 1.0) < 0.5 ? 0.0 : Uniform(10.0, 80.0);
    return settings;
  }

  std::mt19937 random_;
  Motor motor_;
  Duration last_{}, next_ = FromSeconds(0.1);
};

/// All that a motor says of one instant.
struct Seen {
  Duration at;
  double count, place, rest;
  bool moving, homed, complains;
  bool operator==(const Seen&) const = default;
};
Seen Look(const Motor& motor, Duration at) {
  return {at,
          motor.CountAt(at),
          motor.PlaceAt(at),
          motor.RestPlaceAt(at),
          motor.MovingAt(at),
          motor.HomedAt(at),
          motor.ComplainsAt(at)};
}

TEST(Memory, AMotorsPastStaysAsItWas) {
  constexpr int kCommands = 700;
  constexpr int kRemembered = 400;  // at least
  const long motors = testing::ByLevel(5, 20, 1000);
  long asked = 0;
  for (long seed = 0; seed < motors; ++seed) {
    DrawnMotor drawn(static_cast<unsigned>(seed));
    std::vector<Seen> seen;  // while the command was the newest
    for (int i = 0; i < kCommands; ++i) {
      drawn.Command();
      const auto until_next = static_cast<double>((drawn.next() - drawn.last()).count() - 1);
      for (int k = 0; k < 3; ++k) {
        seen.push_back(Look(drawn.motor(), drawn.last() + Duration(std::llround(drawn.Uniform(0.0, until_next)))));
      }
    }
    EXPECT_LE(drawn.motor().earliest(), seen[3 * (kCommands - kRemembered)].at) << "seed " << seed;
    std::ranges::shuffle(seen, std::mt19937(static_cast<unsigned>(seed)));
    for (const Seen& one : seen) {
      if (one.at < drawn.motor().earliest()) continue;
      ++asked;
      ASSERT_EQ(Look(drawn.motor(), one.at), one) << "seed " << seed << " at " << one.at.count();
    }
  }
  std::printf("%ld instants of the past of %ld motors\n", asked, motors);
}

TEST(Memory, AMotorTakesWhatItTookAtFirst) {
  if (!LiveBytesAreCounted()) GTEST_SKIP() << "another allocator";
  for (unsigned seed = 0; seed < 10; ++seed) {
    DrawnMotor drawn(seed);
    for (int i = 0; i < 20; ++i) drawn.Command();
    const std::size_t before = LiveBytes();
    for (int i = 0; i < 1000; ++i) drawn.Command();
    EXPECT_LT(LiveBytes(), before + 4096) << "seed " << seed;
  }
}

}  // namespace
}  // namespace lensd::sim
