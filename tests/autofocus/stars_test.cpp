// Stars against what a formula says of a disk, a ring and a Gaussian, drawn here; and the method that focuses by them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "autofocus/session.h"
#include "autofocus/stars.h"
#include "autofocus/stars/star_curve.h"

namespace lensd::autofocus {
namespace {

/// A picture in full scales, to which light is added; every function draws what its name says, all of `flux` in it.
struct Canvas {
  int width = 160;
  int height = 120;
  std::vector<double> light =
      std::vector<double>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0.05);

  void Put(int x, int y, double value) {
    if (x >= 0 && y >= 0 && x < width && y < height) light[static_cast<std::size_t>(y * width + x)] += value;
  }
  void Gaussian(double x, double y, double sigma, double flux) {
    const auto part = [&](double from) {
      return 0.5 *
             (std::erf((from + 1) / (sigma * std::numbers::sqrt2)) - std::erf(from / (sigma * std::numbers::sqrt2)));
    };
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) Put(i, j, flux * part(i - x) * part(j - y));
    }
  }
  /// Even between the two radii.
  void Ring(double x, double y, double inner, double outer, double flux) {
    const int parts = outer < 15.0 ? 16 : 4;
    const double each = flux / (std::numbers::pi * (outer * outer - inner * inner) * parts * parts);
    for (int j = static_cast<int>(y - outer) - 1; j <= y + outer + 1; ++j) {
      for (int i = static_cast<int>(x - outer) - 1; i <= x + outer + 1; ++i) {
        int inside = 0;
        for (int part = 0; part < parts * parts; ++part) {
          const int across = part % parts, down = part / parts;
          const double r = std::hypot(i + (across + 0.5) / parts - x, j + (down + 0.5) / parts - y);
          inside += r >= inner && r < outer ? 1 : 0;
        }
        Put(i, j, each * inside);
      }
    }
  }
  drivers::Frame Taken(std::mt19937& random, double noise, int bits = 16) const {
    std::normal_distribution<double> normal(0.0, 1.0);
    const double full = std::pow(2.0, bits) - 1.0;
    auto samples = std::make_shared<std::vector<std::uint16_t>>();
    for (const double value : light) {
      samples->push_back(
          static_cast<std::uint16_t>(std::clamp(std::floor((value + noise * normal(random)) * full + 0.5), 0.0, full)));
    }
    drivers::Frame frame;
    frame.width = width;
    frame.height = height;
    frame.bits = bits;
    frame.samples = samples;
    return frame;
  }
};

constexpr Window kAll{0, 0, 160, 120};
constexpr drivers::Region kWhole{0.0, 0.0, 1.0, 1.0};

std::vector<Star> Found(const Canvas& canvas, double noise = 1e-4, unsigned seed = 1) {
  std::mt19937 random(seed);
  return FindStars(canvas.Taken(random, noise), kAll);
}

TEST(Stars, AnEvenDiskHoldsHalfItsLightWithinItsRadiusOverRootTwo) {
  for (const double radius : {2.0, 3.3, 6.0, 12.0, 20.0}) {
    Canvas canvas;
    canvas.Ring(80.3, 60.6, 0.0, radius, 0.1 * radius * radius);
    const auto stars = Found(canvas);
    ASSERT_EQ(stars.size(), 1u) << radius;
    EXPECT_NEAR(stars[0].hfr_px, radius / std::numbers::sqrt2, 0.015 * radius + 0.03) << radius;
    EXPECT_NEAR(stars[0].flux, 0.1 * radius * radius, 0.02 * stars[0].flux);
    EXPECT_NEAR(stars[0].x, 80.3, 0.05);
    EXPECT_NEAR(stars[0].y, 60.6, 0.05);
    EXPECT_FALSE(stars[0].clipped || stars[0].lone_pixel);
  }
}

TEST(Stars, ARingThatAnObstructionLeavesHoldsHalfAtTheMeanSquareOfItsRadii) {
  Canvas canvas;
  canvas.Ring(80.0, 60.0, 5.0, 12.0, 20.0);
  const auto stars = Found(canvas);
  ASSERT_EQ(stars.size(), 1u);
  EXPECT_NEAR(stars[0].hfr_px, std::sqrt(0.5 * (25.0 + 144.0)), 0.1);
}

TEST(Stars, AGaussianHasTheRadiusAndTheWidthOfItsFormula) {
  for (const double sigma : {1.5, 2.0, 3.0, 5.0}) {
    Canvas canvas;
    canvas.Gaussian(80.4, 60.7, sigma, 2.0 * sigma * sigma);
    const auto stars = Found(canvas);
    ASSERT_EQ(stars.size(), 1u) << sigma;
    // A pixel's own width is in it: variances add.
    const double wide = std::sqrt(sigma * sigma + 1.0 / 12.0);
    EXPECT_NEAR(stars[0].hfr_px / (1.1774 * wide), 1.0, 0.025) << sigma;
    ASSERT_TRUE(stars[0].fwhm_px) << sigma;
    EXPECT_NEAR(*stars[0].fwhm_px / (2.3548 * wide), 1.0, 0.02) << sigma;
  }
}

TEST(Stars, TheFlanksOfAClippedStarStillHaveItsWidth) {
  Canvas canvas;
  canvas.Gaussian(80.4, 60.7, 3.0, 200.0);  // 3.5 times full scale in its middle
  const auto stars = Found(canvas);
  ASSERT_EQ(stars.size(), 1u);
  EXPECT_TRUE(stars[0].clipped);
  ASSERT_TRUE(stars[0].fwhm_px);
  EXPECT_NEAR(*stars[0].fwhm_px / (2.3548 * 3.0), 1.0, 0.03);
  const StarFigures figures = FiguresOf(stars);
  EXPECT_EQ(figures.count, 1);
  EXPECT_EQ(figures.clipped, 1);
  EXPECT_FALSE(figures.hfr_px);  // what was cut off is not known
}

TEST(Stars, SigmaIsTheScatterFromFrameToFrame) {
  Canvas canvas;
  canvas.Gaussian(80.4, 60.7, 2.5, 3.0);
  double sum = 0.0, squares = 0.0, claimed = 0.0;
  constexpr int kTrials = 60;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    const auto stars = Found(canvas, 0.004, seed);
    ASSERT_FALSE(stars.empty()) << seed;
    sum += stars[0].hfr_px / kTrials;
    squares += stars[0].hfr_px * stars[0].hfr_px / kTrials;
    claimed += stars[0].hfr_sigma / kTrials;
  }
  const double scatter = std::sqrt(squares - sum * sum);
  EXPECT_GT(claimed / scatter, 0.6);
  EXPECT_LT(claimed / scatter, 1.7);
}

TEST(Stars, WhatIsNoStarIsLeftOut) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    EXPECT_TRUE(Found(Canvas{}, 0.01, seed).empty()) << "noise, seed " << seed;
    Canvas ramp;
    for (int i = 0; i < ramp.width * ramp.height; ++i)
      ramp.Put(i % ramp.width, i / ramp.width, 0.004 * (i % ramp.width));
    EXPECT_TRUE(Found(ramp, 0.01, seed).empty()) << "ramp, seed " << seed;
  }
  Canvas edge, bar, pair;
  edge.Gaussian(2.0, 60.0, 2.0, 5.0);
  EXPECT_TRUE(Found(edge).empty());
  for (int i = 40; i < 100; ++i) bar.Gaussian(i, 60.0, 2.0, 0.5);
  EXPECT_TRUE(Found(bar).empty());
  pair.Gaussian(76.0, 60.0, 2.0, 5.0);
  pair.Gaussian(85.0, 60.0, 2.0, 5.0);
  EXPECT_TRUE(Found(pair).empty());
  Canvas hot;
  hot.Put(80, 60, 0.5);
  const auto stars = Found(hot);
  EXPECT_TRUE(stars.empty() || stars[0].lone_pixel);
}

TEST(StarCurve, FindsTheVertexOfAHyperbolaAndItsSigmaIsHonest) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 1.0);
  double squares = 0.0, claimed = 0.0;
  constexpr int kTrials = 300;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<HfrPoint> points;
    for (int i = -4; i <= 4; ++i) {
      const double off = 2.5 * i - 1.3;
      points.push_back({2.5 * i, std::hypot(1.1, 0.4 * off) + 0.1 * normal(random), 0.08});
    }
    const auto fit = FitHfr(points, 1.0);
    ASSERT_TRUE(fit);
    squares += std::pow(fit->position - 1.3, 2) / kTrials;
    claimed += fit->sigma / kTrials;
    EXPECT_NEAR(fit->slope, 0.4, 0.1);
  }
  EXPECT_NEAR(claimed / std::sqrt(squares), 1.4, 0.5);  // shapes of real stars are left room
  const std::vector<HfrPoint> level(9, HfrPoint{0.0, 2.0, 0.1});
  EXPECT_FALSE(FitHfr(level, 1.0));
}

/// Stars on a lens whose blur is a disk.
struct Sky {
  double sharp_at = 0.5e-3;  // metres of extension
  double px = 7e-6;          // metres of extension a pixel of blur
  double flux = 0.8;
  int stars = 5;
  double second_at = 0.0;  // half of the stars are sharp there
  double noise = 0.003;
  bool hot = false;

  drivers::Frame At(double position, std::mt19937& random) const {
    Canvas canvas;
    for (int i = 0; i < stars; ++i) {
      const double at = second_at > 0.0 && i % 2 == 1 ? second_at : sharp_at;
      const double radius = 0.5 * std::hypot((position - at) / px, 1.5);
      const int column = i % 3, row = i / 3;
      canvas.Ring(30.3 + 47.1 * column, 32.7 + 52.3 * row, 0.0, radius, flux);
    }
    if (hot) canvas.Put(20, 90, 0.6), canvas.Put(110, 60, 0.9);
    return canvas.Taken(random, noise, 12);
  }
};

Setup Travel() {
  return {.lowest = 0.0, .highest = 1e-3, .resolution = 0.25e-6, .blur_px = 7e-6, .ascending = true};
}

struct End {
  Verdict verdict;
  int frames = 0;
};

End Drive(const Sky& sky, const Setup& setup, double start, unsigned seed) {
  std::mt19937 random(seed);
  auto session = Session::Create("stars", setup);
  EXPECT_TRUE(session);
  double position = start;
  for (int frames = 1; frames < 200; ++frames) {
    const auto advice = session->Next(position, sky.At(position, random), kWhole);
    EXPECT_TRUE(advice);
    if (const auto* verdict = std::get_if<Verdict>(&*advice)) return {*verdict, frames};
    position = std::get<GoAndLook>(*advice).position;
    EXPECT_GE(position, setup.lowest);
    EXPECT_LE(position, setup.highest);
  }
  ADD_FAILURE() << "never came to an end";
  return {};
}

TEST(StarFocus, FindsTheFocusOfStarsAndSaysHowLargeTheyAre) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(0.05e-3, 0.95e-3);
  int inside = 0;
  constexpr int kRuns = 20;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    Sky sky;
    sky.sharp_at = anywhere(random);
    sky.hot = seed % 2 == 1;
    sky.flux = seed % 4 == 3 ? 300.0 : 0.8;  // clipped all through the curve
    sky.stars = 1 + static_cast<int>(seed % 5);
    const End end = Drive(sky, Travel(), anywhere(random), seed);
    ASSERT_TRUE(end.verdict.focused) << seed << ": " << end.verdict.reason;
    const double off = end.verdict.position - sky.sharp_at;
    EXPECT_LT(std::abs(off), 2.0 * sky.px) << seed;
    inside += std::abs(off) <= 1.96 * end.verdict.sigma ? 1 : 0;
    ASSERT_TRUE(end.verdict.stars);
    EXPECT_EQ(end.verdict.found_by, FoundBy::Stars);
    EXPECT_EQ(end.verdict.stars->count, sky.stars) << seed;
    EXPECT_EQ(end.verdict.stars->hfr_px.has_value(), sky.flux < 100.0);
    if (end.verdict.stars->hfr_px) {
      EXPECT_NEAR(*end.verdict.stars->hfr_px, 0.53 + 0.1, 0.2) << seed;
    }
  }
  EXPECT_GE(inside, 0.85 * kRuns);
}

TEST(StarFocus, WithoutOpticsTheStepFollowsTheStars) {
  Sky sky;
  sky.sharp_at = 1234.0;
  sky.px = 28.0;
  const autofocus::Setup setup{.lowest = 0.0, .highest = 4000.0, .resolution = 1.0, .blur_px = {}, .ascending = true};
  const End end = Drive(sky, setup, 3000.0, 1);
  ASSERT_TRUE(end.verdict.focused) << end.verdict.reason;
  EXPECT_NEAR(end.verdict.position, 1234.0, 56.0);
}

TEST(StarFocus, RefusesWithTheCause) {
  for (unsigned seed = 0; seed < 2; ++seed) {
    Sky none, two, beyond, at_end;
    none.stars = 0;
    none.hot = true;
    two.second_at = two.sharp_at + 9 * two.px;
    two.stars = 4;
    beyond.sharp_at = 1e-3 + 6 * beyond.px;
    at_end.sharp_at = 1e-3;
    const Verdict nothing = Drive(none, Travel(), 0.3e-3, seed).verdict;
    EXPECT_FALSE(nothing.focused);
    EXPECT_EQ(nothing.cause, Cause::NoTexture) << nothing.reason;
    const Verdict depths = Drive(two, Travel(), 0.3e-3, seed).verdict;
    EXPECT_FALSE(depths.focused);
    EXPECT_EQ(depths.cause, Cause::SeveralDepths) << depths.reason;
    EXPECT_GE(depths.candidates.size(), 2u);
    for (const Sky& sky : {beyond, at_end}) {
      const Verdict end = Drive(sky, Travel(), 0.3e-3, seed).verdict;
      EXPECT_FALSE(end.focused);
      EXPECT_EQ(end.cause, Cause::EndOfTravel) << end.reason;
    }
  }
}

}  // namespace
}  // namespace lensd::autofocus
