// What is learned of a lens' slope of blur: the spread that it claims is held against lenses drawn here, whose runs
// scatter as those on recorded stacks do.
#include "autofocus/slope_learner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "autofocus/method.h"

namespace lensd::autofocus {
namespace {

TEST(SlopeLearner, NeedsThreeRuns) {
  SlopeLearner learner;
  learner.Add({0.3});
  learner.Add({0.4});
  EXPECT_FALSE(learner.Known());
  learner.Add({0.35});
  ASSERT_TRUE(learner.Known());
  EXPECT_NEAR(learner.Known()->log_factor, 0.35, 1e-12);
}

/// Of what it claims to 95 %, 93 to 99 % hold: lenses with a slope of their own, runs that scatter by e^0.1 to e^0.3.
TEST(SlopeLearner, SaysHonestlyWhatTheNextRunWillShow) {
  std::mt19937_64 random(19);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> scatter(0.1, 0.3);
  for (const int runs : {3, 5, 10}) {
    int held = 0;
    for (int lens = 0; lens < 200; ++lens) {
      const double slope = 0.35 * normal(random), spread = scatter(random);
      std::vector<SlopeLearner::Shown> shown;
      for (int i = 0; i < runs; ++i) shown.push_back({slope + spread * normal(random)});
      const auto known = SlopeLearner(shown).Known();
      const double next = slope + spread * normal(random);
      held += std::abs(next - known->log_factor) <= 1.96 * known->sigma;
    }
    EXPECT_GE(held, 186) << runs << " runs";
    EXPECT_LE(held, 198) << runs << " runs";
  }
}

TEST(SlopeLearner, AnotherLensEndsWhatWasLearned) {
  SlopeLearner learner;
  for (const double shown : {0.0, 0.02, -0.02, 0.01}) EXPECT_EQ(learner.Add({shown}), SlopeLearner::Learned::Added);
  EXPECT_EQ(learner.Add({std::log(2.0)}), SlopeLearner::Learned::AnotherLens);
  EXPECT_FALSE(learner.Known());
  EXPECT_EQ(learner.shown().size(), 1U);
}

TEST(SlopeLearner, KeepsTheNewestTenRuns) {
  SlopeLearner learner;
  for (int i = 0; i < 30; ++i) learner.Add({0.001 * i});
  EXPECT_EQ(learner.shown().size(), SlopeLearner::kMost);
  EXPECT_DOUBLE_EQ(learner.shown().front().log_slope, 0.02);
}

/// The mean counts as well as the spread: a lens that is uneven for certain is not known to be even.
TEST(SlopeLearner, TellsHowUnevenBothSidesMayBeOnceThreeRunsHaveShownIt) {
  SlopeLearner learner;
  for (const std::optional<double> uneven : {std::optional(0.01), std::optional<double>(), std::optional(-0.01)}) {
    learner.Add({0.0, uneven});
  }
  ASSERT_TRUE(learner.Known());
  EXPECT_FALSE(learner.Known()->uneven);
  learner.Add({0.0, 0.0});
  // Three runs of standard deviation 0.01: the next is expected within 4.303 of 0.01 sqrt(4/3), with 95 %.
  EXPECT_NEAR(*learner.Known()->uneven, 0.01 * std::sqrt(4.0 / 3.0) * 4.303 / 1.96, 1e-9);
  SlopeLearner bent;
  for (const double uneven : {0.2, 0.2, 0.2, 0.2}) bent.Add({0.0, uneven});
  EXPECT_NEAR(*bent.Known()->uneven, 0.2, 1e-9);
}

TEST(SlopeLearner, ASetupGoesByIt) {
  autofocus::Setup setup;
  setup.blur_px = 4e-6;
  GoBy({.log_factor = std::log(2.0), .sigma = 0.1}, setup);
  EXPECT_NEAR(*setup.blur_px, 2e-6, 1e-18);  // blur grows twice as fast: half the way for a px
  EXPECT_DOUBLE_EQ(setup.slope_sigma, 0.1);
}

}  // namespace
}  // namespace lensd::autofocus
