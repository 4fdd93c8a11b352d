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
  constexpr int kRuns = 400;
  for (auto* truth : {&StagePlane, &StageBowl}) {
    int within = 0;
    for (unsigned seed = 0; seed < kRuns; ++seed) {
      auto samples = StageSamples(truth, 0.1, seed);
      const auto there = FitCoordinateSurface(samples)->At({1.0, 3.5});
      within += std::abs(there->focus - truth(1.0, 3.5)) < 2.0 * there->sigma;
    }
    RecordProperty(truth == &StageBowl ? "bowl" : "plane", within);
    EXPECT_GT(within, 0.93 * kRuns);
    EXPECT_LT(within, 0.995 * kRuns);
  }
}

double StageSaddle(double x, double y) {
  return StagePlane(x, y) + 10.0 * ((x - 2.0) * (x - 2.0) - (y - 2.0) * (y - 2.0));
}
double StageCylinder(double x, double y) {
  return StagePlane(x, y) + 10.0 * (x - 2.0) * (x - 2.0);
}
double StageDeepBowl(double x, double y) {
  return StagePlane(x, y) + 10.0 * ((x - 2.0) * (x - 2.0) + (y - 2.0) * (y - 2.0));
}

TEST(CoordinateSurface, SigmasHoldWhereTheSurfaceIsNoneOfItsOwn) {
  constexpr int kRuns = 100;
  for (auto* truth : {&StageSaddle, &StageCylinder}) {
    int within = 0;
    for (unsigned seed = 0; seed < kRuns; ++seed) {
      auto samples = StageSamples(truth, 0.1, seed);
      const auto there = FitCoordinateSurface(samples)->At({0.5 + seed % 4, 3.5});
      within += std::abs(there->focus - truth(0.5 + seed % 4, 3.5)) < 1.96 * there->sigma;
    }
    EXPECT_GT(within, 0.88 * kRuns);
  }
}

TEST(CoordinateSurface, SigmasHoldWithFewSamples) {
  constexpr int kRuns = 100;
  for (const std::size_t extra : {1U, 2U}) {
    int within = 0;
    for (unsigned seed = 0; seed < kRuns; ++seed) {
      const auto all = StageSamples(&StageDeepBowl, 0.1, seed);
      std::vector<SurfaceSample> samples{all[0], all[2], all[6], all[8]};
      for (std::size_t i = 0; i < extra; ++i) samples.push_back(all[i == 0 ? 4 : 5]);
      const auto surface = FitCoordinateSurface(samples);
      EXPECT_FALSE(surface->curvature_seen && extra < 2);
      const auto there = surface->At({2.0, 2.5});
      within += std::abs(there->focus - StageDeepBowl(2.0, 2.5)) < 1.96 * there->sigma;
    }
    EXPECT_GT(within, 0.88 * kRuns) << extra;
  }
}

TEST(CoordinateSurface, WrongSamplesDoNotHideEachOther) {
  int missed = 0, wronged = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    auto samples = StageSamples(&StagePlane, 0.1, seed);
    const std::size_t one = seed % 9, two = (seed + 1 + seed % 8) % 9;
    samples[one].focus += 2.0;
    samples[two].focus += seed % 2 == 0 ? 3.5 : -2.5;
    ASSERT_TRUE(FitCoordinateSurface(samples));
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const bool wrong = i == one || i == two;
      missed += wrong && !samples[i].outlier, wronged += !wrong && samples[i].outlier;
    }
  }
  EXPECT_LE(missed, 5);
  EXPECT_EQ(wronged, 0);
}

TEST(CoordinateSurface, AnswersBetweenTheSamplesOnly) {
  std::vector<SurfaceSample> samples;
  for (const double along : {0.0, 0.1, 0.2, 0.3}) {
    samples.push_back({.at = {along, 0.0}, .focus = 5.0, .sigma = 1.0});
    if (along > 0.0) samples.push_back({.at = {0.0, along}, .focus = 5.0, .sigma = 1.0});
  }
  const auto surface = FitCoordinateSurface(samples);
  ASSERT_TRUE(surface);
  EXPECT_TRUE(surface->At({0.1 + 0.2, 0.0}));
  EXPECT_TRUE(surface->At({0.15, 0.15}));
  EXPECT_TRUE(surface->At({0.05, 0.1}));
  EXPECT_FALSE(surface->At({0.151, 0.151}));
  EXPECT_FALSE(surface->At({0.29, 0.29}));
  const auto nearest = surface->Nearest({0.25, 0.15});
  EXPECT_NEAR(nearest[0], 0.2, 1e-6);
  EXPECT_NEAR(nearest[1], 0.1, 1e-6);
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
