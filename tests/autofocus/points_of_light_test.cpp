// A few faint points of light on black. Out of focus a camera rounds them away, and no light is left to compare with.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "autofocus/sharpness.h"
#include "whole_search.h"

namespace lensd::autofocus {
namespace {

constexpr int kSize = 96;

struct Point {
  double x, y, light;
};

/// In focus at 0; a position is a pixel of blur, here the diameter of a disk with soft edges.
drivers::Frame PictureOf(const std::array<Point, 6>& points, double position, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 3e-4);
  const double radius = std::hypot(1.0, 0.5 * position);
  std::vector<double> light(kSize * kSize, 0.0);
  for (const Point& point : points) {
    double sum = 0.0;
    for (const bool draw : {false, true}) {
      for (int i = 0; i < kSize * kSize; ++i) {
        const int row = i / kSize;
        const double r = std::hypot(i % kSize - point.x, row - point.y);
        const double share = 1.0 / (1.0 + std::exp(4.0 * (r - radius)));
        if (draw)
          light[i] += point.light * share / sum;
        else
          sum += share;
      }
    }
  }
  auto samples = std::make_shared<std::vector<std::uint16_t>>();
  for (const double value : light) {
    samples->push_back(static_cast<std::uint16_t>(std::max(0.0, std::round(255.0 * (value + normal(random))))));
  }
  drivers::Frame frame;
  frame.width = frame.height = kSize;
  frame.bits = 8;
  frame.samples = samples;
  return frame;
}

TEST(PointsOfLight, AreFoundWhereOtherFramesAreBlack) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> along(20.0, kSize - 20.0), light(0.15, 0.5), start(-60.0, 80.0);
    std::array<Point, 6> points;
    for (Point& point : points) point = {along(random), along(random), light(random)};
    const autofocus::Setup setup{
        .lowest = -60.0, .highest = 80.0, .resolution = 0.05, .blur_px = 1.0, .ascending = true};
    const auto picture = [&](double position, int n) {
      return PictureOf(points, position, 100 * seed + static_cast<unsigned>(n));
    };
    for (const char* method : {"auto", "sweep"}) {
      const testing::Ending run = testing::SearchWith(method, setup, start(random), picture);
      EXPECT_TRUE(run.verdict.focused) << seed << ", " << method << ": " << run.verdict.reason;
      EXPECT_NEAR(run.verdict.position, 0.0, 2.0) << seed << ", " << method << ": " << run.verdict.reason;
    }
  }
}

TEST(PointsOfLight, ABlackFrameIsOfNoSharpnessAndNotOfAnyNumber) {
  const double noise = NoiseVariance({}, 8);
  const Sharpness black = SharpnessOf({.mean = 0.0}, noise, 10000);
  EXPECT_NEAR(black.value, 0.0, 0.5);
  EXPECT_LT(black.sigma, 0.1);
  const double light = 1e-4;  // of full scale squared: of one step in thirty pixels
  EXPECT_GT(SharpnessOf({.gradient_energy = light, .mean = 1e-3}, noise, 10000).value, 10.0);
}

}  // namespace
}  // namespace lensd::autofocus
