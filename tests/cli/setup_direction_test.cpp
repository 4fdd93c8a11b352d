// Which way a focus turns, told of lenses drawn at random that autofocus has placed as well as it says: hardly ever
// falsely.
#include "cli/online/setup/setup_direction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

namespace lensd::cli {
namespace {

// Found by the outside: 16 mm at f/4 on a wall at 2.262 m, in focus in the middle of its travel.
TEST(SetupDirection, NearTheMiddleOfTheTravelBothWaysFit) {
  DirectionFacts facts{.given = 1 / 2.262,
                       .found = 0.43845912581551116,
                       .found_sigma = 0.011583238914880651,
                       .focal_length = 16.0,
                       .extension_max = 0.2218};
  EXPECT_EQ(DirectionBy(facts), "undecided");
  facts.found = 0.4172361433369109;  // where the lens then stood
  EXPECT_EQ(DirectionBy(facts), "undecided");
}

TEST(SetupDirection, WhatIsClearIsTold) {
  DirectionFacts facts{.given = 1.0, .found = 1.01, .found_sigma = 0.01, .focal_length = 25.0, .extension_max = 1.0};
  EXPECT_EQ(DirectionBy(facts), "right");
  facts.given = 0.585;  // 25 mm extended by 1 mm - 0.648 mm
  EXPECT_EQ(DirectionBy(facts), "reversed");
  facts.backlash_mm = 0.15;  // it may have stood elsewhere
  EXPECT_EQ(DirectionBy(facts), "undecided");
}

TEST(SetupDirection, IsHardlyEverFalse) {
  std::mt19937_64 random(20261125);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  int told = 0, falsely = 0;
  constexpr int kDrawn = 20000;
  for (int i = 0; i < kDrawn; ++i) {
    // In metres, by the thin-lens equation.
    const double f = 8e-3 + 42e-3 * uniform(random), distance = 0.5 + 3.5 * uniform(random);
    const double image = 1 / (1 / f - 1 / distance), travel = (image - f) / (0.2 + 0.6 * uniform(random));
    const bool reversed = uniform(random) < 0.5;
    const double sigma = std::pow(10.0, -3.0 + 2.0 * uniform(random));
    const double reckoned = reversed ? f + travel - (image - f) : image;
    DirectionFacts facts{.given = 1 / (distance * (1 + 0.02 * normal(random))),
                         .found = 1 / f - 1 / reckoned + sigma * normal(random),
                         .found_sigma = sigma,
                         .focal_length = 1e3 * f,
                         .extension_max = 1e3 * travel};
    const auto direction = DirectionBy(facts);
    told += direction != "undecided";
    falsely += direction == (reversed ? "right" : "reversed");
  }
  std::printf("directions of %d lenses drawn at random: %d told, %d of them falsely\n", kDrawn, told, falsely);
  EXPECT_GT(told, kDrawn / 2);
  EXPECT_LE(falsely, kDrawn / 1000);
}

}  // namespace
}  // namespace lensd::cli
