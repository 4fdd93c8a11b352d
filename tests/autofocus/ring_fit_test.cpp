// The sums over rings, taken several at a time: the same on every instruction set this machine has, whatever fills the
// last vector, and as a textbook's formula has them where nothing is blurred.
#include "autofocus/defocus/ring_fit.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace lensd::autofocus::defocus {
namespace {

/// Rings as frames of a falling texture give them, each mean a little off by chance.
RingStack DrawnStack(std::mt19937_64& random, int frames, int rings) {
  std::uniform_real_distribution<double> part(0.7, 1.3);
  RingStack stack;
  stack.frames = frames;
  for (int i = 0; i < frames; ++i) stack.noise[static_cast<std::size_t>(i)] = part(random);
  for (int r = 0; r < rings; ++r) {
    Ring ring;
    ring.frequency = 0.01 + 0.008 * r;
    ring.spread = 0.004;
    ring.count = 5.0 * part(random);
    const double light = 4.0 * std::pow(ring.frequency, -1.2) * part(random);
    for (std::size_t i = 0; i < static_cast<std::size_t>(frames); ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        const double shared = light / (1.0 + static_cast<double>(i)) / (1.0 + static_cast<double>(j));
        ring.power[i * kMostFrames + j] = ring.power[j * kMostFrames + i] = shared + (i == j ? stack.noise[i] : 0.0);
      }
    }
    stack.rings.push_back(ring);
  }
  return stack;
}

std::array<double, kMostFrames> DrawnBlur(std::mt19937_64& random) {
  std::uniform_real_distribution<double> blur(-80.0, 80.0);
  return {blur(random), blur(random), 0.02 * blur(random), blur(random)};
}

void ExpectAlike(const Fit& one, const Fit& other, double scale) {
  EXPECT_NEAR(one.log_likelihood, other.log_likelihood, scale * std::abs(one.log_likelihood));
  EXPECT_NEAR(one.log_prior, other.log_prior, scale * (1.0 + std::abs(one.log_prior)));
  EXPECT_NEAR(one.excess, other.excess, scale * (1.0 + std::abs(one.excess)));
}

TEST(RingFit, EveryInstructionSetFindsTheSame) {
  constexpr int kDrawn = 200;
  std::vector<std::vector<Fit>> found;
  for (std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    std::mt19937_64 random(11);
    found.emplace_back();
    for (int i = 0; i < kDrawn; ++i) {
      const RingColumns rings(DrawnStack(random, 1 + i % kMostFrames, 4 + i % 37));
      found.back().push_back(FitRings(rings, DrawnBlur(random)));
      ASSERT_TRUE(std::isfinite(found.back().back().log_likelihood));
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  ASSERT_FALSE(found.empty());
  for (const std::vector<Fit>& other : found) {
    for (std::size_t i = 0; i < other.size(); ++i) ExpectAlike(found.front()[i], other[i], 1e-9);
  }
}

TEST(RingFit, WhatFillsTheLastVectorCountsForNothing) {
  std::mt19937_64 random(12);
  for (int i = 0; i < 100; ++i) {
    RingStack stack = DrawnStack(random, 1 + i % kMostFrames, 17);
    const auto blur = DrawnBlur(random);
    const Fit fit = FitRings(RingColumns(stack), blur);
    while (stack.rings.size() < 24)
      stack.rings.push_back({stack.rings[3].frequency, 0.004, 1e-13, stack.rings[3].power});
    Fit filled = FitRings(RingColumns(stack), blur);
    ExpectAlike(fit, filled, 1e-6);
  }
}

TEST(RingFit, FramesWithoutARingSayNothing) {
  RingStack stack;
  stack.frames = 2;
  const Fit fit = FitRings(RingColumns(stack), {3.0, 4.0});
  EXPECT_EQ(fit.log_likelihood, 0.0);
  EXPECT_EQ(fit.excess, 0.0);
  EXPECT_TRUE(std::isfinite(fit.log_prior));
}

/// One sharp frame, many modes: what is left is a normal distribution's -n (ln v + 1) with v the power that was seen,
/// which the response's model error only renames.
TEST(RingFit, ASharpFrameIsExplainedByItsOwnPower) {
  std::mt19937_64 random(13);
  RingStack stack = DrawnStack(random, 1, 24);
  double expected = 0.0;
  for (Ring& ring : stack.rings) {
    ring.count = 1e6;
    expected -= ring.count * (std::log(ring.power[0]) + 1.0);
  }
  const Fit fit = FitRings(RingColumns(stack), {});
  EXPECT_NEAR(fit.log_likelihood, expected, 1e-6 * std::abs(expected));
  EXPECT_NEAR(fit.excess, 0.0, 1e-3);
}

}  // namespace
}  // namespace lensd::autofocus::defocus
