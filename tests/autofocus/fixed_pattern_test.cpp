// What stays in place whatever the focus, on pictures that show little else: hot pixels with the noise of their charge,
// shadows of specks, pixels of unequal gain.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "defocus_scene.h"
#include "test_level.h"
#include "whole_search.h"

namespace lensd::autofocus {
namespace {

using testing::NaturalWaves;
using testing::Picture;
using testing::Wave;

constexpr int kSide = 128, kBits = 12;
constexpr double kFull = (1 << kBits) - 1, kNoise = 0.006;

/// By pixel: what is left of its light, and what comes on top of it, of full scale.
struct Sensor {
  std::vector<double> gain = std::vector<double>(kSide * kSide, 1.0);
  std::vector<double> dark = std::vector<double>(kSide * kSide, 0.0);
};

enum class Flaw { HotPixels, Specks, UnequalGain, All };

Sensor SensorWith(Flaw flaw, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::normal_distribution<double> normal;
  Sensor sensor;
  if (flaw == Flaw::UnequalGain || flaw == Flaw::All) {
    for (double& gain : sensor.gain) gain += 0.02 * normal(random);
  }
  if (flaw == Flaw::Specks || flaw == Flaw::All) {
    for (int speck = 0; speck < 8; ++speck) {
      const double x = kSide * uniform(random), y = kSide * uniform(random), radius = 3.0 + 5.0 * uniform(random);
      const double loss = 0.1 + 0.3 * uniform(random);
      for (int i = 0; i < kSide * kSide; ++i) {
        const int row = i / kSide;
        const double r = std::hypot(i % kSide - x, row - y);
        sensor.gain[static_cast<std::size_t>(i)] *= 1.0 - loss / (1.0 + std::exp(2.0 * (r - radius)));
      }
    }
  }
  if (flaw == Flaw::HotPixels || flaw == Flaw::All) {
    for (double& dark : sensor.dark) dark = uniform(random) < 3e-3 ? 0.1 + uniform(random) : 0.0;
  }
  return sensor;
}

/// In focus at 0; a position is a pixel of blur.
drivers::Frame SeenBy(const Sensor& sensor, const std::vector<Wave>& waves, double position, unsigned seed) {
  const drivers::Frame clean = Picture(waves, position, 0.0, seed, kSide, kBits);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  auto samples = std::make_shared<std::vector<std::uint16_t>>();
  for (std::size_t i = 0; i < clean.samples->size(); ++i) {
    const double light = sensor.gain[i] * (*clean.samples)[i] / kFull + sensor.dark[i];
    const double seen = light + kNoise * std::sqrt(light / 0.5) * normal(random);
    samples->push_back(static_cast<std::uint16_t>(std::lround(kFull * std::clamp(seen, 0.0, 1.0))));
  }
  drivers::Frame frame = clean;
  frame.samples = std::move(samples);
  return frame;
}

constexpr Setup Reaching(double lowest, double highest) {
  return {.lowest = lowest, .highest = highest, .resolution = 0.05, .blur_px = 1.0, .ascending = true};
}

TEST(FixedPattern, IsLeftOutWhereItHidTheTop) {
  const unsigned runs = lensd::testing::ByLevel(1, 3, 100);  // of each flaw and method
  unsigned within = 0, hold = 0, all = 0;
  for (const Flaw flaw : {Flaw::HotPixels, Flaw::Specks, Flaw::UnequalGain, Flaw::All}) {
    for (const char* method : {"auto", "sweep"}) {
      for (unsigned seed = 1; seed <= runs; ++seed) {
        const Sensor sensor = SensorWith(flaw, seed);
        const auto waves = NaturalWaves(100 + seed, 2.0, 200, 0.01);
        const auto picture = [&](double position, int n) {
          return SeenBy(sensor, waves, position, 100 * seed + static_cast<unsigned>(n));
        };
        std::mt19937 random(seed);
        const double start = std::uniform_real_distribution<double>(-60.0, 80.0)(random);
        const auto run = testing::SearchWith(method, Reaching(-60.0, 80.0), start, picture);
        const double off = std::abs(run.verdict.position);
        ++all;
        if (!run.verdict.focused) continue;
        EXPECT_LE(off, 4.0) << static_cast<int>(flaw) << ", " << method << ", " << seed << ": " << run.verdict.reason;
        within += off <= 2.0 ? 1 : 0;
        hold += off <= 1.96 * run.verdict.sigma + 0.05 ? 1 : 0;
      }
    }
  }
  EXPECT_GE(within, all - all / 20 - 1) << "of " << all;
  EXPECT_GE(hold, all - all / 10 - 1) << "of " << all;
}

TEST(FixedPattern, AloneIsNoAnswer) {
  const unsigned runs = lensd::testing::ByLevel(1, 2, 50);  // of each flaw
  for (const Flaw flaw : {Flaw::HotPixels, Flaw::Specks, Flaw::UnequalGain, Flaw::All}) {
    for (unsigned seed = 1; seed <= runs; ++seed) {
      const Sensor sensor = SensorWith(flaw, seed);
      const auto waves = NaturalWaves(100 + seed, 2.0, 200, 0.01);
      const auto nothing = [&](double position, int n) {
        return SeenBy(sensor, {}, position, 100 * seed + static_cast<unsigned>(n));
      };
      const auto beyond = [&](double position, int n) {
        return SeenBy(sensor, waves, position, 100 * seed + static_cast<unsigned>(n));
      };
      EXPECT_FALSE(testing::SearchWith("auto", Reaching(-60.0, 80.0), 0.0, nothing).verdict.focused);
      const double by = 5.0 + 50.0 * seed / runs;
      EXPECT_FALSE(testing::SearchWith("auto", Reaching(by, 120.0), 60.0, beyond).verdict.focused) << by;
      EXPECT_FALSE(testing::SearchWith("auto", Reaching(-120.0, -by), -60.0, beyond).verdict.focused) << by;
    }
  }
}

}  // namespace
}  // namespace lensd::autofocus
