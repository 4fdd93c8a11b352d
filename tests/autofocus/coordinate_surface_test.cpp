// Focus surfaces over a stage, fitted to samples of surfaces that are written down here and are the truth.
#include "autofocus/coordinate_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lensd::autofocus {
namespace {

double StagePlane(double x, double y) {
  return 500.0 + 3.0 * x - 2.0 * y;
}
double StageBowl(double x, double y) {
  return StagePlane(x, y) + 0.5 * ((x - 2.0) * (x - 2.0) + (y - 2.0) * (y - 2.0));
}

std::vector<SurfaceSample> StageSamples(double (*truth)(double, double), double sigma, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, sigma);
  std::vector<SurfaceSample> samples;
  for (const double x : {0.0, 2.0, 4.0}) {
    for (const double y : {0.0, 2.0, 4.0}) {
      samples.push_back({.at = {x, y}, .focus = truth(x, y) + noise(random), .sigma = sigma});
    }
  }
  return samples;
}

TEST(CoordinateSurface, ChoosesThePlaneOrTheBowlAndIsTrue) {
  for (auto* truth : {&StagePlane, &StageBowl}) {
    auto samples = StageSamples(truth, 0.01, 1);
    const auto surface = FitCoordinateSurface(samples);
    ASSERT_TRUE(surface) << surface.error().message;
    EXPECT_EQ(surface->curved, truth == &StageBowl);
    EXPECT_NEAR(surface->At({1.0, 3.0})->focus, truth(1.0, 3.0), 0.04);
  }
}

TEST(CoordinateSurface, SigmasHoldWhatTheySay) {
  constexpr int kRuns = 1000;
  for (auto* truth : {&StagePlane, &StageBowl}) {
    int within = 0;
    for (unsigned seed = 0; seed < kRuns; ++seed) {
      auto samples = StageSamples(truth, 0.1, seed);
      const auto there = FitCoordinateSurface(samples)->At({1.0, 3.5});
      within += std::abs(there->focus - truth(1.0, 3.5)) < 2.0 * there->sigma;
    }
    RecordProperty(truth == &StageBowl ? "bowl" : "plane", within);
    EXPECT_GT(within, 0.93 * kRuns);
    EXPECT_LT(within, 0.98 * kRuns);
  }
}

TEST(CoordinateSurface, NamesTheOutlierAndNoOther) {
  auto samples = StageSamples(&StagePlane, 0.1, 3);
  samples[5].focus += 20.0;
  const auto surface = FitCoordinateSurface(samples);
  ASSERT_TRUE(surface);
  for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_EQ(samples[i].outlier, i == 5) << i;
  EXPECT_NEAR(surface->At({4.0, 4.0})->focus, StagePlane(4.0, 4.0), 0.4);
}

TEST(CoordinateSurface, RefusesWhatItCannotKnow) {
  auto samples = StageSamples(&StagePlane, 0.1, 4);
  const auto outside = FitCoordinateSurface(samples)->At({2.0, 5.5});
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().code, Code::OutOfRange);
  EXPECT_NE(outside.error().message.find("1.5 outside"), std::string::npos) << outside.error().message;
  std::vector<SurfaceSample> few(samples.begin(), samples.begin() + 2);
  EXPECT_NE(FitCoordinateSurface(few).error().message.find("add 1 more"), std::string::npos);
  std::vector<SurfaceSample> line{samples[0], samples[4], samples[8]};
  EXPECT_FALSE(FitCoordinateSurface(line));
}

}  // namespace
}  // namespace lensd::autofocus
