// Textures that repeat: a few frequencies, whose contrast comes again far out of focus.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "autofocus/defocus/repeats.h"
#include "defocus_scene.h"
#include "test_level.h"
#include "whole_search.h"

namespace lensd::autofocus {
namespace {

using testing::Ending;
using testing::NaturalWaves;
using testing::Picture;
using testing::Wave;

/// Stripes of `period` px across `direction` radians, `duty` of it light: the harmonics that a sensor resolves.
std::vector<Wave> Stripes(double period, double direction, double duty, double contrast, double phase) {
  std::vector<Wave> waves;
  for (int k = 1; k / period < 0.5; ++k) {
    const double amplitude = contrast * 4.0 / (std::numbers::pi * k) * std::sin(std::numbers::pi * k * duty);
    const double f = k / period;
    waves.push_back({f * std::cos(direction), f * std::sin(direction), k * phase, amplitude});
  }
  return waves;
}

std::vector<Wave> And(std::vector<Wave> waves, const std::vector<Wave>& more) {
  waves.insert(waves.end(), more.begin(), more.end());
  return waves;
}

struct Drawn {
  std::vector<Wave> waves;
  double start = 0.0;
  double noise = 0.0;
};

Drawn Draw(unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random()) / 4294967296.0;
  };
  const double period = 3.0 * std::pow(8.0, uniform(0.0, 1.0));
  const double direction = uniform(0.0, std::numbers::pi);
  const double contrast = 0.06 * std::pow(7.0, uniform(0.0, 1.0));
  Drawn drawn;
  drawn.waves = Stripes(period, direction, uniform(0.2, 0.8), contrast, uniform(0.0, 6.0));
  const double kind = uniform(0.0, 3.0);
  if (kind > 2.0) {
    drawn.waves =
        And(drawn.waves, Stripes(period * uniform(0.6, 1.6), direction + 0.5 * std::numbers::pi, 0.5, contrast, 1.0));
  } else if (kind > 1.0) {
    drawn.waves.resize(1);
    drawn.waves.push_back(drawn.waves.front());
    const double other = uniform(1.2, 3.0);
    drawn.waves[1].fx *= other;
    drawn.waves[1].fy *= other;
    drawn.waves[1].amplitude *= uniform(0.03, 1.0);
  }
  drawn.start = uniform(-40.0, 60.0);
  drawn.noise = uniform(0.0, 2.0) < 1.0 ? 0.0 : 0.004;
  return drawn;
}

/// In focus at 0; a position is a pixel of blur.
Ending EndOf(unsigned seed) {
  const Drawn drawn = Draw(seed);
  const Setup setup{.lowest = -40.0, .highest = 60.0, .resolution = 0.05, .blur_px = 1.0, .ascending = true};
  const auto picture = [&](double position, int n) {
    return Picture(drawn.waves, position, drawn.noise, static_cast<unsigned>(n), 128, 8);
  };
  return testing::SearchWith("auto", setup, drawn.start, picture, 120);
}

// Each was an answer 13 to 54 px of blur off, at a top that the side lobes of a disk's response left.
TEST(TexturesThatRepeat, ASideTopIsNoAnswer) {
  for (const unsigned seed : {39U, 191U, 288U, 289U, 310U, 325U, 346U, 381U, 454U, 482U, 530U, 533U, 573U, 598U}) {
    const Ending run = EndOf(seed);
    EXPECT_TRUE(run.verdict.focused) << seed << ": " << run.verdict.reason;
    EXPECT_NEAR(run.verdict.position, 0.0, 2.0) << seed << ": " << run.verdict.reason;
  }
}

// A blur that leaves less contrast than a step of the samples shows that step, which is no other picture.
TEST(TexturesThatRepeat, WhatRoundingLeavesHasNotMoved) {
  for (const unsigned seed : {19U, 26U, 91U, 124U, 236U, 313U, 437U}) {
    const Ending run = EndOf(seed);
    EXPECT_TRUE(run.verdict.focused) << seed << ": " << run.verdict.reason;
    EXPECT_NEAR(run.verdict.position, 0.0, 2.0) << seed;
  }
}

// Near its top a coarse grating is as good as level: frames farther away tell where the top is.
TEST(TexturesThatRepeat, ACoarseOneIsFoundByWhatLiesFartherOff) {
  const Ending run = EndOf(297);
  EXPECT_TRUE(run.verdict.focused) << run.verdict.reason;
  EXPECT_NEAR(run.verdict.position, 0.0, 2.0);
}

TEST(TexturesThatRepeat, NoneOfManyIsAnsweredFalsely) {
  const long draws = lensd::testing::ByLevel(15, 60, 1000);
  long within = 0;
  for (long i = 0; i < draws; ++i) {
    const Ending run = EndOf(static_cast<unsigned>(5000 + i));
    const bool near = std::abs(run.verdict.position) <= 2.0;
    EXPECT_TRUE(near || !run.verdict.focused) << 5000 + i << ": " << run.verdict.reason;
    within += near && run.verdict.focused;
  }
  EXPECT_GE(within, draws - draws / 20 - 1) << "of " << draws;
}

// The side lobes of what lies beyond the end of the travel have tops as well: a third of these were answers. Where the
// next lobes are lost in noise, little tells them from a focus: 6 % are left.
TEST(TexturesThatRepeat, BeyondTheTravelThereIsHardlyEverAnAnswer) {
  const long draws = lensd::testing::ByLevel(15, 75, 1000);
  for (const char* method : {"auto", "sweep"}) {
    long answered = 0;
    for (long i = 0; i < draws; ++i) {
      const Drawn drawn = Draw(static_cast<unsigned>(9000 + i));
      const double by = 4.0 + 40.0 * static_cast<double>(i) / static_cast<double>(draws);
      const autofocus::Setup setup{
          .lowest = by, .highest = by + 100.0, .resolution = 0.05, .blur_px = 1.0, .ascending = true};
      const auto picture = [&](double position, int n) {
        return Picture(drawn.waves, position, drawn.noise, static_cast<unsigned>(n), 128, 8);
      };
      answered += testing::SearchWith(method, setup, drawn.start + 40.0 + by, picture, 120).verdict.focused ? 1 : 0;
    }
    EXPECT_LE(answered, draws / 14) << method << ", of " << draws;
  }
}

TEST(RiseWithBlur, TellsFewFrequenciesFromMany) {
  const auto rise = [](const std::vector<Wave>& waves, double noise, double most_px = 100.0) {
    const auto frame = Picture(waves, 0.5, noise, 7, 128);
    return defocus::RiseWithBlur({defocus::SpectrumOf(frame, {0, 0, frame.width, frame.height})}, most_px);
  };
  for (const unsigned seed : {41U, 42U, 43U}) {
    EXPECT_LT(rise(NaturalWaves(seed), 0.005), 1.1) << seed;
    EXPECT_LT(rise(NaturalWaves(seed, 1.6), 0.05), 1.1) << seed;
  }
  for (const double period : {3.3, 7.0, 17.0}) EXPECT_GT(rise(Stripes(period, 0.3, 0.5, 0.3, 1.0), 0.005), 1.5);
  const auto crossed = And(Stripes(7.0, 0.3, 0.5, 0.3, 1.0), Stripes(10.0, 1.7, 0.5, 0.2, 0.0));
  EXPECT_GT(rise(crossed, 0.005), 1.3);
  EXPECT_EQ(rise({}, 0.01), 1.0);
  // A travel too short for a second top.
  EXPECT_LT(rise(Stripes(17.0, 0.3, 0.5, 0.3, 1.0), 0.005, 20.0), 1.1);
}

}  // namespace
}  // namespace lensd::autofocus
