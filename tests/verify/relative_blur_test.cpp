// Truth here is a sum of sinusoids: blurred by a disk, each keeps its place and is scaled by 2 J1(x)/x, so pictures of
// any blur are written down directly, without convolving anything.
#include "verify/relative_blur.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace lensd::verify {
namespace {

constexpr int kSize = 128;

struct Wave {
  double fx, fy, phase, amplitude;
};

std::vector<Wave> Texture(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Wave> waves;
  for (int i = 0; i < 60; ++i) {
    const double f = 0.02 + 0.4 * unit(random), angle = std::numbers::pi * unit(random);
    waves.push_back({f * std::cos(angle), f * std::sin(angle), 2 * std::numbers::pi * unit(random), 0.2 / f});
  }
  return waves;
}

Plane Picture(const std::vector<Wave>& waves, double diameter, double gain, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, std::max(noise, 1e-9));
  Plane plane{kSize, kSize, std::vector<float>(kSize * kSize)};
  for (int i = 0; i < kSize * kSize; ++i) {
    const int column = i % kSize, row = i / kSize;
    double value = 100;
    for (const Wave& wave : waves) {
      const double x = std::numbers::pi * diameter * std::hypot(wave.fx, wave.fy);
      const double kept = x < 1e-9 ? 1.0 : 2 * std::cyl_bessel_j(1.0, x) / x;
      value += kept * wave.amplitude * std::cos(2 * std::numbers::pi * (wave.fx * column + wave.fy * row) + wave.phase);
    }
    plane.values[i] = static_cast<float>(gain * value + (noise > 0 ? normal(random) : 0.0));
  }
  return plane;
}

class KnownBlur : public ::testing::TestWithParam<double> {};

TEST_P(KnownBlur, IsFoundWithinItsStatedError) {
  const double diameter = GetParam(), edges[] = {1.0, 2.0};
  const std::vector<float> depth(kSize * kSize, 1.5f);
  for (unsigned seed = 0; seed < 2; ++seed) {
    const auto waves = Texture(seed);
    const FramesToCompare frames{Picture(waves, 0.0, 1.0, 0.5, seed * 3 + 1),
                                 Picture(waves, 0.0, 1.0, 0.5, seed * 3 + 2),
                                 Picture(waves, diameter, 9.0, 1.0, seed * 3 + 3)};
    const auto found = BlurBetween(frames, depth, edges, 14.0);
    ASSERT_TRUE(found.has_value()) << found.error().message;
    const SliceBlur& slice = found->front();
    EXPECT_GE(slice.pixels, kFewestPixels);
    EXPECT_NEAR(slice.gain, 9.0, 0.05);
    EXPECT_LE(slice.low_px, diameter) << "seed " << seed;
    EXPECT_GE(slice.high_px, diameter) << "seed " << seed;
    EXPECT_EQ(slice.at_most(), diameter < 0.1);
    EXPECT_LT(slice.high_px - slice.low_px, diameter < 0.5 ? 0.4 : 0.1);
  }
}
INSTANTIATE_TEST_SUITE_P(Diameters, KnownBlur, ::testing::Values(0.0, 0.8, 1.0, 2.3, 4.0, 6.7, 10.0));

TEST(BlurBetween, KeepsDepthsApart) {
  const auto waves = Texture(7);
  const Plane sharp = Picture(waves, 0.0, 1.0, 0.0, 0), little = Picture(waves, 2.0, 1.0, 0.0, 0),
              much = Picture(waves, 6.0, 1.0, 0.0, 0);
  Plane picture = little;
  std::vector<float> depth(kSize * kSize, 1.5f);
  for (int i = kSize * kSize / 2; i < kSize * kSize; ++i) {
    picture.values[i] = much.values[i];
    depth[i] = 2.5f;
  }
  const double edges[] = {1.0, 2.0, 3.0, 4.0};
  const auto found = BlurBetween({sharp, sharp, picture}, depth, edges, 8.0);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR((*found)[0].diameter_px, 2.0, 0.05);
  EXPECT_NEAR((*found)[1].diameter_px, 6.0, 0.05);
  EXPECT_EQ((*found)[2].pixels, 0);
}

TEST(BlurBetween, RefusesFramesOfDifferentSizes) {
  const Plane small{2, 2, std::vector<float>(4)}, large{3, 2, std::vector<float>(6)};
  const double edges[] = {1.0, 2.0};
  EXPECT_FALSE(BlurBetween({small, small, large}, std::vector<float>(4), edges, 4.0).has_value());
}

}  // namespace
}  // namespace lensd::verify
