// A lens whose slope of blur earlier runs have shown: few frames where that is true, no false answer where it is not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "defocus_scene.h"
#include "whole_search.h"

namespace lensd::autofocus {
namespace {

/// What earlier runs are said to have shown.
Setup Measured(double slope_sigma, std::optional<double> uneven = {}, std::optional<double> last_focus = {}) {
  return {.lowest = -60.0,
          .highest = 60.0,
          .resolution = 0.02,
          .blur_px = 1.0,
          .ascending = true,
          .slope_sigma = slope_sigma,
          .uneven = uneven,
          .last_focus = last_focus};
}

/// Blur in pixels by where the lens stands is `blur`; one pixel a position is told.
template <class Blur>
testing::Ending FocusOn(const std::vector<testing::Wave>& waves, double start, const Blur& blur, const Setup& setup) {
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
      const testing::Ending run = FocusOn(waves, start, [](double at) { return at - kFocus; }, Measured(0.05));
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
      const testing::Ending run =
          FocusOn(waves, start, [&](double at) { return slope * (at - kFocus); }, Measured(0.05));
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
      const testing::Ending run = FocusOn(waves, start, blur, Measured(0.1));
      if (run.verdict.focused) {
        EXPECT_NEAR(run.verdict.position, kFocus, 4.0) << uneven << " from " << start;
      }
    }
  }
}

double Uneven(double at, double uneven) {
  return (at - kFocus) * (at > kFocus ? 1.0 + uneven : 1.0 - uneven);
}

/// One frame where the lens stands, one beyond the focus, one there: however far the first is, and wherever the focus
/// was last time.
TEST(MeasuredLens, ThreeFramesAreEnoughWhereBothSidesAreKnownToBeAlike) {
  std::vector<std::size_t> frames;
  for (const unsigned texture : {21U, 22U, 26U}) {
    const auto waves = testing::NaturalWaves(texture);
    for (const double start : {-45.0, -30.0, -17.0, -9.0, 12.0, 21.0, 33.0, 41.0}) {
      const auto blur = [](double at) { return Uneven(at, 0.0); };
      const testing::Ending run = FocusOn(waves, start, blur, Measured(0.05, 0.015, kFocus + 0.5));
      ASSERT_TRUE(run.verdict.focused) << run.verdict.reason;
      EXPECT_NEAR(run.verdict.position, kFocus, 1.0) << start;
      EXPECT_LE(std::abs(run.verdict.position - kFocus), 2.0 * run.verdict.sigma) << start;
      const auto [lowest, highest] = std::ranges::minmax(run.visited);
      EXPECT_LT(lowest, kFocus - 2.0) << start;
      EXPECT_GT(highest, kFocus + 2.0) << start;
      frames.push_back(run.visited.size());
    }
  }
  std::ranges::sort(frames);
  EXPECT_EQ(frames[frames.size() / 2], 3U);
  EXPECT_LE(frames.back(), 5U);
}

TEST(MeasuredLens, ASubjectThatIsElsewhereThanLastTimeIsFoundAllTheSame) {
  for (const double last : {-50.0, -20.0, 25.0, 55.0}) {
    for (const double start : kStarts) {
      const auto blur = [](double at) { return Uneven(at, 0.0); };
      const testing::Ending run = FocusOn(testing::NaturalWaves(27), start, blur, Measured(0.05, 0.015, last));
      ASSERT_TRUE(run.verdict.focused) << run.verdict.reason;
      EXPECT_NEAR(run.verdict.position, kFocus, 1.5) << start << " last " << last;
      EXPECT_LE(run.visited.size(), 6U) << start << " last " << last;
    }
  }
}

/// Told that both sides are alike, which they are not: another lens of the same slope.
TEST(MeasuredLens, OneThatOnlySeemedEvenGivesNoFalseAnswer) {
  for (const unsigned texture : {25U, 28U}) {
    for (const double uneven : {-0.25, -0.12, 0.12, 0.25}) {
      for (const double start : kStarts) {
        const auto blur = [&](double at) { return Uneven(at, uneven); };
        const testing::Ending run = FocusOn(testing::NaturalWaves(texture), start, blur, Measured(0.05, 0.015, kFocus));
        if (run.verdict.focused) {
          EXPECT_NEAR(run.verdict.position, kFocus, 4.0) << uneven << " from " << start;
        }
      }
    }
  }
}

/// Half the logarithm of the ratio of both slopes, as in the blur that was drawn.
TEST(MeasuredLens, RunsTellHowMuchMoreBlurGrowsOnOneSide) {
  for (const double uneven : {-0.2, -0.1, 0.0, 0.1, 0.2}) {
    const double truth = 0.5 * std::log((1.0 + uneven) / (1.0 - uneven));
    std::vector<double> shown;
    for (const unsigned texture : {21U, 29U}) {
      for (const double start : {-35.0, -22.0, 26.0, 39.0}) {
        const auto blur = [&](double at) { return Uneven(at, uneven); };
        const testing::Ending run = FocusOn(testing::NaturalWaves(texture), start, blur, Measured(0.05));
        if (run.verdict.uneven) shown.push_back(*run.verdict.uneven);
      }
    }
    ASSERT_GE(shown.size(), 5U) << uneven;
    std::ranges::sort(shown);
    EXPECT_NEAR(shown[shown.size() / 2], truth, 0.03) << uneven;
    EXPECT_NEAR(shown[shown.size() / 4], truth, 0.06) << uneven;
    EXPECT_NEAR(shown[3 * shown.size() / 4], truth, 0.06) << uneven;
  }
}

}  // namespace
}  // namespace lensd::autofocus
