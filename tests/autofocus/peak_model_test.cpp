// The choice of a peak's shape: each shape wins on its own data, and what is no peak is refused.
#include "autofocus/peak_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace lensd::autofocus {
namespace {

constexpr double kTop = 0.37;
constexpr double kNoise = 0.01;

double ShapeAt(PeakModel model, double x) {
  const double q = 0.5 * std::pow((x - kTop) / 2.0, 2);
  if (model == PeakModel::Parabola) return 1.0 - q;
  if (model == PeakModel::Gaussian) return std::exp(-q);
  return 1.0 / (1.0 + q);
}

std::vector<CurvePoint> PointsOf(const std::function<double(double)>& curve, double noise, unsigned seed, int each_side,
                                 double step = 0.4) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, std::max(noise, 1e-12));
  std::vector<CurvePoint> points;
  for (int i = -each_side; i <= each_side; ++i) {
    const double x = step * i;
    points.push_back({x, curve(x) + normal(random), std::max(noise, 1e-6)});
  }
  return points;
}

TEST(PeakModel, EachShapeWinsOnItsOwnData) {
  constexpr int kTrials = 40;
  for (const PeakModel model : kPeakModels) {
    int won = 0, rejected = 0, others_rejected = 0;
    for (unsigned seed = 0; seed < kTrials; ++seed) {
      const auto choice = ChoosePeak(PointsOf([&](double x) { return ShapeAt(model, x); }, kNoise, seed, 5));
      ASSERT_TRUE(choice) << choice.error();
      EXPECT_NEAR(choice->position, kTop, 0.1);
      won += choice->model == model;
      for (const PeakModel other : kPeakModels) {
        const bool out = choice->fits[static_cast<std::size_t>(other)].rejected;
        (other == model ? rejected : others_rejected) += out;
      }
    }
    EXPECT_GE(won, kTrials * 3 / 4) << PeakModelName(model);
    // The test's own level is one in twenty.
    EXPECT_LE(rejected, kTrials / 5) << PeakModelName(model);
    EXPECT_GE(others_rejected, kTrials) << PeakModelName(model);
  }
}

TEST(PeakModel, WithoutNoiseTheTopIsExact) {
  for (const PeakModel model : kPeakModels) {
    const auto choice = ChoosePeak(PointsOf([&](double x) { return ShapeAt(model, x); }, 0.0, 1, 4));
    ASSERT_TRUE(choice) << choice.error();
    EXPECT_EQ(choice->model, model);
    EXPECT_NEAR(choice->position, kTop, 1e-5);
  }
}

TEST(PeakModel, ItsSigmaCoversItsErrors) {
  double squared = 0.0;
  constexpr int kTrials = 300;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    const PeakModel model = kPeakModels[seed % 3];
    const auto choice = ChoosePeak(PointsOf([&](double x) { return ShapeAt(model, x); }, 0.03, seed, 4));
    ASSERT_TRUE(choice) << choice.error();
    squared += std::pow((choice->position - kTop) / choice->sigma, 2) / kTrials;
  }
  EXPECT_LT(std::sqrt(squared), 1.3);
  EXPECT_GT(std::sqrt(squared), 0.4);
}

TEST(PeakModel, UncertainPlacesWidenTheAnswer) {
  auto points = PointsOf([](double x) { return ShapeAt(PeakModel::Gaussian, x); }, kNoise, 3, 5);
  const double certain = ChoosePeak(points)->sigma;
  for (CurvePoint& point : points) point.position_sigma = 0.3;
  EXPECT_GT(ChoosePeak(points)->sigma, 2.0 * certain);
}

TEST(PeakModel, NoiseAloneIsRefused) {
  int refused = 0;
  constexpr int kTrials = 200;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    refused += !ChoosePeak(PointsOf([](double) { return 1.0; }, 0.05, seed, 5));
  }
  EXPECT_GE(refused, kTrials - 1);
}

TEST(PeakModel, WhatIsNoPeakIsRefusedWithItsReason) {
  const auto why = [](const std::vector<CurvePoint>& points) {
    const auto choice = ChoosePeak(points);
    return choice ? std::string() : choice.error();
  };
  EXPECT_NE(why({{0, 1, 0.1}, {1, 2, 0.1}}).find("fewer than three"), std::string::npos);
  const auto valley = [](double x) { return 1.0 + x * x; };
  EXPECT_NE(why(PointsOf(valley, kNoise, 1, 5)).find("do not form a peak"), std::string::npos);
  // The top of a slope lies beyond its last frame.
  const auto slope = [](double x) { return std::exp(-0.5 * std::pow((x - 3.0) / 2.0, 2)); };
  EXPECT_NE(why(PointsOf(slope, 1e-4, 1, 4)).find("outside"), std::string::npos);
  // Every other frame darker by far more than the noise: no shape is near.
  const auto saw = [](double x) {
    return ShapeAt(PeakModel::Gaussian, x) * (std::lround(x / 0.4) % 2 == 0 ? 1.0 : 0.7);
  };
  EXPECT_NE(why(PointsOf(saw, 1e-3, 1, 5)).find("scatter"), std::string::npos);
}

}  // namespace
}  // namespace lensd::autofocus
