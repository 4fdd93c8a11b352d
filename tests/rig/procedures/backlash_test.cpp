// Backlash measured on the simulated lens: noise, settling and a peak of unknown shape between the count and the truth.
#include "rig/backlash.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "rig_on_sim.h"
#include "test_level.h"

namespace lensd::rig {
namespace {

struct Lens {
  double backlash = 200.0;
  bool approach_near = true;
  std::string surface = "distance_m = 1.2\ntexture = \"" LENSD_SOURCE_DIR "/scenes/textures/brick.png\"";
  std::string camera = "full_well_e = 10000\nread_noise_e = 3.0";
};

std::string SceneOf(const Lens& lens) {
  return "version = 1\n[camera]\nwidth = 96\nheight = 96\nexposure_ms = 2\nframe_rate_hz = 200\n" + lens.camera +
         "\n[lens]\nfocal_length_mm = 25.0\nf_number = [1.4, 16.0]\nextension_mm = [0.0, 1.6]\nsteps = 8192\n"
         "speed_steps_per_s = 20000\nbacklash_steps = " +
         std::to_string(lens.backlash) + "\n[[surface]]\nkind = \"wall\"\n" + lens.surface +
         "\n[truth]\nregion = [0.1, 0.1, 0.8, 0.8]\n";
}

BacklashOutcome Measure(const Lens& lens, std::uint64_t seed, double start, int pairs = 5) {
  testing::RigOnSim bench(SceneOf(lens), seed, start, [&](RigConfig& config) {
    config.axes[drivers::Axis::Focus].approach_near = lens.approach_near;
  });
  std::optional<Result<BacklashOutcome>> answer;
  MeasureBacklash(*bench.rig, {.region = {}, .pairs = pairs}, nullptr,
                  [&](Result<BacklashOutcome> outcome) { answer = std::move(outcome); });
  bench.RunUntil([&] { return answer.has_value(); }, std::chrono::minutes(10));
  EXPECT_TRUE(answer.has_value() && answer->has_value()) << (answer ? answer->error().message : "no answer");
  return answer && *answer ? **answer : BacklashOutcome{};
}

TEST(Backlash, IsMeasuredWithinTwoStepsAndItsIntervalHolds) {
  const int runs = static_cast<int>(testing::ByLevel(20, 100, 1000));
  std::mt19937 random(5);
  int measured = 0, within = 0, covered = 0;
  double worst = 0.0, widest = 0.0, frames = 0.0;
  for (int run = 0; run < runs; ++run) {
    Lens lens;
    lens.backlash = run % 2 == 0 ? 200.0 : std::uniform_real_distribution<>(0.0, 600.0)(random);
    const double start = std::uniform_real_distribution<>(1000, 7000)(random);
    const BacklashOutcome outcome = Measure(lens, static_cast<std::uint64_t>(run) + 1, start);
    if (!outcome.measured) {
      std::printf("run %d, backlash %.1f: %s\n", run, lens.backlash, outcome.reason.c_str());
      continue;
    }
    ++measured;
    const double error = std::abs(outcome.backlash.steps - lens.backlash);
    within += error <= 2.0;
    covered += outcome.backlash.low <= lens.backlash && lens.backlash <= outcome.backlash.high;
    worst = std::max(worst, error);
    widest = std::max(widest, outcome.backlash.high - outcome.backlash.low);
    frames += outcome.frames;
  }
  std::printf(
      "%d of %d measured, %d within 2 steps, %d inside their interval; worst %.2f steps, widest interval %.2f, "
      "%.0f frames a run\n",
      measured, runs, within, covered, worst, widest, frames / std::max(measured, 1));
  EXPECT_GE(within, 0.95 * runs);   // of all runs, those that were refused included
  EXPECT_GE(covered, 0.90 * runs);  // 95 % of the runs on average
}

TEST(Backlash, OfALensThatApproachesFromTheOtherSide) {
  Lens lens;
  lens.approach_near = false;
  const BacklashOutcome outcome = Measure(lens, 3, 3000);
  ASSERT_TRUE(outcome.measured) << outcome.reason;
  EXPECT_NEAR(outcome.backlash.steps, 200.0, 2.0);
}

TEST(Backlash, RefusesWhereThereIsNothingToSee) {
  Lens lens;
  lens.surface = "distance_m = 1.2\nconstant = 0.5";
  const BacklashOutcome outcome = Measure(lens, 3, 3000);
  EXPECT_FALSE(outcome.measured);
  EXPECT_NE(outcome.reason.find("nothing to focus on"), std::string::npos) << outcome.reason;
  EXPECT_EQ(outcome.cause, BacklashCause::NotFocused);
}

TEST(Backlash, SomebodyElsesCommandEndsIt) {
  testing::RigOnSim bench(SceneOf({}), 1, 3000);
  std::optional<Result<BacklashOutcome>> answer;
  MeasureBacklash(*bench.rig, {}, nullptr, [&](Result<BacklashOutcome> o) { answer = std::move(o); });
  bench.Run(std::chrono::seconds(4));
  ASSERT_FALSE(answer);
  std::optional<Result<MoveOutcome>> moved;
  bench.rig->Move(drivers::Axis::Focus, {.kind = Target::Kind::Native, .value = 100, .from = {}, .take_up = {}},
                  [&](Result<MoveOutcome> o) { moved = std::move(o); });
  bench.RunUntil([&] { return answer && moved; }, std::chrono::seconds(20));
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->error().code, Code::Superseded);
  EXPECT_EQ((*moved)->position.value, 100.0);
}

TEST(Backlash, IntervalsAreStudents) {
  // t(0.975, 3) = 3.182; values 1 2 3 4: mean 2.5, s = 1.291.
  const Backlash four = BacklashFrom({1, 2, 3, 4}, 0.0);
  EXPECT_NEAR(four.steps, 2.5, 1e-12);
  EXPECT_NEAR(four.high - four.steps, 3.182 * 1.291 / 2.0, 1e-2);
  EXPECT_NEAR(BacklashFrom({2.5, 2.5, 2.5, 2.5}, 1.0).high, 2.5 + 3.182 / 2.0, 1e-2);
  EXPECT_GE(BacklashFrom({0.1, -0.3, 0.0}, 0.0).low, 0.0);
}

}  // namespace
}  // namespace lensd::rig
