// What the history says of an exposure, against all readings kept and looked through one by one; and what it takes.
#include "rig/frames/history.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "test_level.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

class DrawnReadings {
 public:
  explicit DrawnReadings(unsigned seed) : random_(seed) {}

  double Uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  drivers::LensState Next() {
    state_.sampled_at += Duration(std::llround(1e6 * (Uniform(0.0, 1.0) < 0.01 ? Uniform(0.0, 900.0) : 3.0)));
    for (const Axis axis : {Axis::Focus, Axis::Iris}) {
      auto& one = state_.axes[axis];
      if (!one || Uniform(0.0, 1.0) < 0.02) one.emplace().moving = Uniform(0.0, 1.0) < 0.5;
      if (one->moving) one->position.value += Uniform(-5.0, 5.0);
    }
    return state_;
  }

 private:
  std::mt19937 random_;
  drivers::LensState state_;
};

TEST(History, SaysWhatItsReadingsSay) {
  constexpr double kTolerance = 0.5;
  drivers::PerAxis<double> tolerances;
  for (const Axis axis : drivers::kAxes) tolerances[axis] = kTolerance;
  long asked = 0;
  const long histories = testing::ByLevel(2, 5, 500);
  for (long seed = 0; seed < histories; ++seed) {
    DrawnReadings drawn(static_cast<unsigned>(seed));
    History history(tolerances);
    std::vector<drivers::LensState> all;
    for (int i = 0; i < 3000; ++i) {
      const auto reading = drawn.Next();
      if (!all.empty() && reading.sampled_at <= all.back().sampled_at) continue;
      history.Add(reading);
      all.push_back(reading);
      const Instant begin = reading.sampled_at - Duration(std::llround(1e6 * drawn.Uniform(-50.0, 4000.0)));
      const Instant end = begin + Duration(std::llround(1e6 * drawn.Uniform(0.0, 300.0)));
      const auto sampled = &drivers::LensState::sampled_at;
      auto first = std::ranges::upper_bound(all, begin, {}, sampled);
      if (first != all.begin()) --first;
      auto last = std::ranges::lower_bound(all, end, {}, sampled);
      const bool covered = first->sampled_at <= begin && last != all.end();
      if (last != all.end()) ++last;
      const auto during = history.During(begin, end);
      for (const Axis axis : {Axis::Focus, Axis::Iris}) {
        const auto position = [axis](const drivers::LensState& one) { return one.axes[axis]->position; };
        const auto [low, high] = std::ranges::minmax_element(first, last, {}, position);
        const bool moving = !covered || (position(*high) - position(*low)).value > kTolerance ||
                            std::any_of(first, last, [axis](const auto& one) { return one.axes[axis]->moving; });
        ASSERT_TRUE(during[axis]);
        ASSERT_EQ(during[axis]->lowest, position(*low)) << "seed " << seed << ", reading " << i;
        ASSERT_EQ(during[axis]->highest, position(*high)) << "seed " << seed << ", reading " << i;
        ASSERT_EQ(during[axis]->moving, moving) << "seed " << seed << ", reading " << i;
        ++asked;
      }
      ASSERT_FALSE(during[Axis::Zoom]);
    }
  }
  std::printf("%ld exposures of %ld histories\n", asked, histories);
}

std::size_t HeapBytes() {
  const auto info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

TEST(History, TakesWhatItTookAtFirst) {
  constexpr std::size_t kMost = std::size_t{400} << 10;  // for 3,333 readings: ten seconds of one lens that moves
  const std::size_t before = HeapBytes();
  History history(drivers::PerAxis<double>{});
  drivers::LensState state;
  const auto pass = [&](int seconds) {
    for (int i = 0; i < seconds * 1000 / 3; ++i) {
      state.sampled_at += std::chrono::milliseconds(3);
      for (const Axis axis : drivers::kAxes) state.axes[axis].emplace().position.value = i;
      history.Add(state);
    }
  };
  pass(15);
  const std::size_t at_first = HeapBytes();
  EXPECT_LT(at_first, before + kMost);
  pass(300);
  EXPECT_EQ(HeapBytes(), at_first);
}

}  // namespace
}  // namespace lensd::rig
