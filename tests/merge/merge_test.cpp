// The parts: what is refused, how pictures are found to grow, what near and unknown mean. Pictures are formulas here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "merge/compose.h"
#include "merge/depth.h"
#include "merge/drift.h"

namespace lensd::merge {
namespace {

constexpr int kWidth = 200, kHeight = 150;

/// Sums of waves of many periods: texture at every scale.
double Texture(double x, double y) {
  double sum = 0.0;
  for (int k = 1; k <= 12; ++k) {
    const double angle = 1.7 * k, period = 2.5 * std::pow(1.45, k);
    sum += std::sin(6.2831853 / period * (x * std::cos(angle) + y * std::sin(angle)) + k);
  }
  return 500.0 + 60.0 * sum;
}

Picture Of(const std::function<double(double, double)>& light) {
  Picture picture{kWidth, kHeight, 1, {}};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) picture.samples.push_back(static_cast<float>(light(x - 99.5, y - 74.5)));
  }
  return picture;
}

/// Fine texture of that contrast, which falls as a bell curve with `off` in the right half, and left of it with
/// `off_left`; with noise.
Picture Frame(double off_left, double off, double contrast, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss(0.0, std::max(noise, 1e-9));
  const double left = contrast * std::exp(-2.0 * off_left * off_left), right = contrast * std::exp(-2.0 * off * off);
  auto picture = Of([=](double x, double y) {
    return 500.0 + (x < 0.0 ? left : right) * 100.0 * std::sin(1.9 * x + 0.3 * y) * std::cos(1.7 * y - 0.4 * x);
  });
  for (float& sample : picture.samples) sample += static_cast<float>(gauss(random));
  return picture;
}

/// The left half is sharp at 2.4, the right one at `top`, frames standing at 0, 1, 2 ...
DepthMap MapOf(double top, double contrast, double noise, std::size_t frames) {
  std::vector<Station> stations;
  for (std::size_t i = 0; i < frames; ++i) stations.push_back({static_cast<double>(i), 1.0});
  auto finder = DepthFinder::Create(stations).value();
  for (std::size_t i = 0; i < frames; ++i) {
    const auto here = static_cast<double>(i);
    EXPECT_TRUE(finder.Add(Frame(here - 2.4, here - top, contrast, noise, static_cast<unsigned>(i))));
  }
  return finder.Finish().value();
}
constexpr auto kRight = static_cast<std::size_t>(kHeight / 2 * kWidth + 3 * kWidth / 4);

TEST(Depth, LiesBetweenFramesWhereTheTopOfTheCurveIs) {
  for (const double top : {2.0, 2.25, 2.5, 2.8, 4.9, 5.3}) {
    const DepthMap map = MapOf(top, 1.0, 1.0, 6);
    EXPECT_NEAR(map.place[kRight], top, 0.25) << top;
    EXPECT_NEAR(map.place[kRight], top, 2.0F * map.sigma[kRight]) << top;
    EXPECT_GT(map.known, 0.95) << top;
    EXPECT_GT(map.confidence[kRight], 0.8F);
  }
}

TEST(Depth, IsUnknownWhereThereIsNoTextureAndBeyondTheStack) {
  EXPECT_LT(MapOf(2.5, 0.0, 3.0, 8).known, 0.002);
  EXPECT_LT(MapOf(2.5, 0.0, 0.0, 8).known, 0.002);
  EXPECT_LT(MapOf(7.4, 1.0, 1.0, 6).known, 0.55);
}

TEST(Depth, SigmaGrowsAsTextureSinksIntoTheNoise) {
  EXPECT_GT(MapOf(2.3, 0.1, 1.0, 6).sigma[kRight], MapOf(2.3, 1.0, 1.0, 6).sigma[kRight]);
}

TEST(Depth, OfTwoPlacesTheLaterOneOnRequest) {
  std::vector<Station> stations;
  for (int i = 0; i < 10; ++i) stations.push_back({0.1 * i, 1.0});
  for (const auto& [prefer, place] : {std::pair(Prefer::Sharper, 0.2), std::pair(Prefer::Later, 0.7)}) {
    auto finder = DepthFinder::Create(stations, prefer).value();
    for (int i = 0; i < 10; ++i) {
      const double there = std::exp(-2.0 * (i - 2) * (i - 2)), later = 0.7 * std::exp(-2.0 * (i - 7) * (i - 7));
      ASSERT_TRUE(finder.Add(Of([=](double x, double y) {
        return 500.0 + 100.0 * (there + later) * std::sin(1.9 * x) * std::cos(1.7 * y);
      })));
    }
    const auto map = finder.Finish().value();
    EXPECT_NEAR(map.place[static_cast<std::size_t>(75 * kWidth + 100)], place, 0.02);
  }
}

TEST(Depth, RefusesWhatIsNoStack) {
  EXPECT_FALSE(DepthFinder::Create({{1.0, 1.0}}));
  EXPECT_FALSE(DepthFinder::Create({{1.0, 1.0}, {2.0, 1.0}, {1.5, 1.0}}));
  EXPECT_FALSE(DepthFinder::Create({{1.0, 1.0}, {1.0, 1.0}}));
  EXPECT_FALSE(DepthFinder::Create({{1.0, 1.0}, {2.0, 0.0}}));
  auto finder = DepthFinder::Create({{2.0, 1.0}, {1.0, 1.0}}).value();
  EXPECT_TRUE(finder.Add(Frame(0.0, 0.0, 1.0, 1.0, 1)));
  EXPECT_FALSE(finder.Finish());
  EXPECT_FALSE(finder.Add({10, 10, 1, std::vector<float>(100)}));
  EXPECT_FALSE(finder.Add({kWidth, kHeight, 1, std::vector<float>(100)}));
  EXPECT_TRUE(finder.Add(Frame(1.0, 1.0, 1.0, 1.0, 2)));
  EXPECT_FALSE(finder.Add(Frame(1.0, 1.0, 1.0, 1.0, 2)));
  EXPECT_TRUE(finder.Finish());
}

TEST(Compose, KeepsColourAndEvensLight) {
  const std::vector<Station> stations = {{0.0, 1.0}, {1.0, 1.0}};
  DepthMap map;
  map.width = kWidth;
  map.height = kHeight;
  map.everywhere.assign(static_cast<std::size_t>(kWidth * kHeight), 0.5F);
  Composer composer(stations, map);
  for (const float light : {1.0F, 1.5F}) {
    Picture picture{kWidth, kHeight, 3, {}};
    for (int i = 0; i < kWidth * kHeight; ++i) {
      for (const float channel : {100.0F, 200.0F, 50.0F}) picture.samples.push_back(light * channel);
    }
    ASSERT_TRUE(composer.Add(picture));
  }
  const Picture merged = composer.Finish();
  for (const std::size_t pixel : {std::size_t{0}, std::size_t{12345}}) {
    EXPECT_NEAR(merged.samples[3 * pixel], 100.0F, 0.1F);
    EXPECT_NEAR(merged.samples[3 * pixel + 1], 200.0F, 0.1F);
    EXPECT_NEAR(merged.samples[3 * pixel + 2], 50.0F, 0.1F);
  }
}

TEST(Drift, FindsGrowthAndMovement) {
  const Picture first = Of(Texture);
  for (const double scale : {0.99, 1.0, 1.004, 1.02}) {
    const Picture second =
        Of([scale](double x, double y) { return 1.1 * Texture((x - 0.8) / scale, (y + 0.5) / scale); });
    const Drift drift = MeasureDrift(first, second);
    EXPECT_NEAR(drift.scale, scale, 0.0005);
    EXPECT_NEAR(drift.right_px, 0.8, 0.1);
    EXPECT_NEAR(drift.down_px, -0.5, 0.1);
  }
  const Picture blank = Of([](double, double) { return 100.0; });
  EXPECT_EQ(MeasureDrift(blank, blank, 1.01).scale, 1.01);
}

TEST(Drift, TheLensIsBelievedWhereThePicturesAgree) {
  const Picture size{2000, 1500, 1, {}};
  std::vector<Drift> drifts(10, {.scale = 1.005});
  drifts[4].right_px = 3.0;
  std::vector<double> right, wrong;
  for (int i = 0; i <= 10; ++i) {
    right.push_back(0.05 * std::pow(1.00501, i));
    wrong.push_back(0.05);
  }
  const auto fits = Align(drifts, {wrong, right}, size);
  EXPECT_EQ(fits.law, 1U);
  EXPECT_EQ(fits.scales, right);
  EXPECT_EQ(fits.shifted_after, 4U);
  EXPECT_EQ(fits.largest_shift_px, 3.0);
  const auto none = Align(drifts, {wrong}, size);
  EXPECT_FALSE(none.law);
  EXPECT_NEAR(none.misfit_px, 10 * std::log(1.005) * 1250, 0.01);
  EXPECT_NEAR(none.scales.back(), std::pow(1.005, 10), 1e-9);
  EXPECT_FALSE(Align(drifts, {}, size).law);
}

}  // namespace
}  // namespace lensd::merge
