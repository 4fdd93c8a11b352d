// The speed that setup tells, of motors drawn at random whose arrival is seen at readings only, some of them late: how
// often it lies in the interval told.
#include "cli/online/setup/setup_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

namespace lensd::cli {
namespace {

TEST(SetupMotion, TheSpeedLiesInTheIntervalTold) {
  std::mt19937_64 random(20261125);
  std::uniform_real_distribution<double> uniform;
  constexpr int kDrawn = 1000;
  int told = 0, within = 0, overheads = 0;
  for (int i = 0; i < kDrawn; ++i) {
    // In steps and seconds: up to speed and down again, a trapezium or a triangle.
    const double steps = std::round(std::pow(10, 2.5 + 2 * uniform(random)));
    const double speed = steps / std::pow(10, -0.5 + 1.2 * uniform(random));
    const double ramp = std::pow(10, -3 + 2.2 * uniform(random)), acceleration = speed / ramp;
    const double settle = 0.15 * uniform(random), reading = 0.005 + 0.015 * uniform(random);
    AxisMotion motion;
    double position = 0.1 * steps + 0.2 * steps;
    for (const double target : MotionTargets(0.1 * steps, 0.8 * steps, 1.0)) {
      const double way = std::abs(std::round(target) - position);
      position = std::round(target);
      if (way == 0.0) continue;
      const double travel = way < speed * ramp ? 2 * std::sqrt(way / acceleration) : ramp + way / speed;
      double seen = std::ceil(travel / reading + uniform(random)) * reading;
      if (uniform(random) < 0.1) seen += reading * uniform(random);
      motion.moves.push_back({.distance = way, .elapsed_ms = 1e3 * (seen + settle)});
    }
    FitMoves(motion);
    if (!motion.speed) continue;
    ++told;
    within += motion.speed->low <= speed && speed <= motion.speed->high;
    overheads += motion.overhead_ms->low <= 1e3 * (ramp + settle + 2.5 * reading) &&
                 1e3 * (ramp + settle) <= motion.overhead_ms->high;
  }
  std::printf("speeds told of %d motors: %d, %d within their interval\n", kDrawn, told, within);
  EXPECT_GT(told, kDrawn * 8 / 10);
  EXPECT_GE(within, told * 93 / 100);
  EXPECT_GE(overheads, told * 93 / 100);
}

TEST(SetupMotion, ASpeedThatIsNeverReachedIsNotTold) {
  AxisMotion motion;
  for (const double way : {20.0, 40.0, 80.0, 160.0, 320.0, 30.0, 60.0, 120.0, 240.0, 310.0}) {
    motion.moves.push_back({.distance = way, .elapsed_ms = 5 + 2e3 * std::sqrt(way / 4000)});
  }
  FitMoves(motion);
  EXPECT_FALSE(motion.speed);
  EXPECT_TRUE(motion.overhead_ms);
}

TEST(SetupMotion, ASearchHasTheTimeThatASlowLensNeeds) {
  std::mt19937_64 random(20261129);
  std::uniform_real_distribution<double> uniform;
  for (int i = 0; i < 1000; ++i) {
    // A sweep of the whole range: 34 frames, each after a move, and the travel there and back twice.
    const double steps = std::pow(10, 2.5 + 2 * uniform(random)), travel_s = std::pow(10, -1.0 + 2.5 * uniform(random));
    const double overhead_ms = std::pow(10, 1.0 + 2.5 * uniform(random));
    const double sweep_ms = 34 * (overhead_ms + 17.0) + 4e3 * travel_s;
    const double speed = steps / travel_s;
    const varlink::Json iris{{"axis", "iris"}, {"speed", nullptr}, {"overheadMs", {{"high", 1e6}}}};
    const varlink::Json focus{{"axis", "focus"},
                              {"minimum", 100.0},
                              {"maximum", 100.0 + steps},
                              {"speed", {{"low", 0.97 * speed}, {"value", speed}}},
                              {"overheadMs", {{"value", overhead_ms}, {"high", 1.03 * overhead_ms}}}};
    const double at_most = SearchAtMostMs(varlink::Json::array({iris, focus}));
    EXPECT_GT(at_most, 1.5 * sweep_ms) << overhead_ms << " ms a move, " << travel_s << " s for the travel";
    EXPECT_LT(at_most, 30e3 + 3.0 * sweep_ms);
  }
  EXPECT_EQ(SearchAtMostMs(varlink::Json::array()), 30e3);
}

}  // namespace
}  // namespace lensd::cli
