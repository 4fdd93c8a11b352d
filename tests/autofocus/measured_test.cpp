// A lens whose slope of blur earlier runs have shown: few frames where that is true, no false answer where it is not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "defocus_scene.h"
#include "whole_search.h"

namespace lensd::autofocus {
namespace {

/// Blur in pixels by where the lens stands is `blur`, which is told as one pixel a position, with `slope_sigma`.
template <class Blur>
testing::Ending FocusOn(const std::vector<testing::Wave>& waves, double start, const Blur& blur, double slope_sigma) {
  const Setup setup{.lowest = -60.0,
                    .highest = 60.0,
                    .resolution = 0.02,
                    .blur_px = 1.0,
                    .ascending = true,
                    .slope_sigma = slope_sigma};
  return testing::SearchWith("auto", setup, start, [&](double position, int n) {
    return testing::Picture(waves, blur(position), 0.005, static_cast<unsigned>(300 + n));
  });
}

constexpr double kFocus = 3.0;
constexpr double kStarts[] = {-30.0, -6.0, 9.0, 33.0};

TEST(MeasuredLens, FocusesInFewFramesWithOneOnEachSide) {
  std::vector<std::size_t> frames;
  for (const unsigned texture : {21U, 22U}) {
    const auto waves = testing::NaturalWaves(texture);
    for (const double start : kStarts) {
      const testing::Ending run = FocusOn(waves, start, [](double at) { return at - kFocus; }, 0.05);
      ASSERT_TRUE(run.verdict.focused) << run.verdict.reason;
      EXPECT_NEAR(run.verdict.position, kFocus, 1.5) << start;
      const auto [lowest, highest] = std::ranges::minmax(run.visited);
      EXPECT_LT(lowest, kFocus - 2.0) << start;
      EXPECT_GT(highest, kFocus + 2.0) << start;
      frames.push_back(run.visited.size());
    }
  }
  std::ranges::sort(frames);
  EXPECT_LE(frames[frames.size() / 2], 5U);
}

TEST(MeasuredLens, AnotherOneInItsPlaceGivesNoWrongAnswer) {
  const auto waves = testing::NaturalWaves(24);
  for (const double slope : {0.5, 0.65, 1.5, 2.0}) {
    for (const double start : kStarts) {
      const testing::Ending run = FocusOn(waves, start, [&](double at) { return slope * (at - kFocus); }, 0.05);
      if (run.verdict.focused) {
        EXPECT_NEAR(slope * run.verdict.position, slope * kFocus, 2.0) << slope << " from " << start;
      }
    }
  }
}

/// As with spherical aberration: what is far on one side looks more blurred than as far on the other. Answers from
/// three frames, two of them beyond a near one on either side, were up to 6 px off here.
TEST(MeasuredLens, BlurThatGrowsOtherwiseOnEitherSideGivesNoWrongAnswer) {
  const auto waves = testing::NaturalWaves(25);
  for (const double uneven : {0.2, 0.3}) {
    for (const double start : kStarts) {
      const auto blur = [&](double at) { return (at - kFocus) * (at > kFocus ? 1.0 + uneven : 1.0 - uneven); };
      const testing::Ending run = FocusOn(waves, start, blur, 0.1);
      if (run.verdict.focused) {
        EXPECT_NEAR(run.verdict.position, kFocus, 4.0) << uneven << " from " << start;
      }
    }
  }
}

}  // namespace
}  // namespace lensd::autofocus
