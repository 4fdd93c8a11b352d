// Single moves over GigE Vision that once went wrong: an echo, no status, an error, no abort.
#include <gtest/gtest.h>

#include <fstream>
#include <optional>

#include "moving_bench.h"

namespace lensd {
namespace {

using drivers::Axis;
using sim::GigePosition;
using testing::kEncoder;
using Bench = testing::MovingBench;
using namespace std::chrono_literals;

class AnEchoIsNoArrival : public ::testing::TestWithParam<std::tuple<GigePosition, int>> {};

/// As tried from outside: the target is read back at once, and Busy rises late.
TEST_P(AnEchoIsNoArrival, WhateverThePositionReadsAndHoweverLateBusyRises) {
  const auto [position, busy_late_ms] = GetParam();
  Bench bench({.position = position, .busy_late = std::chrono::milliseconds(busy_late_ms)}, kEncoder);
  for (const double target : {3900.0, 100.0, 2000.0, 2003.0, 0.0}) {
    const auto moved = bench.Move(target);
    ASSERT_TRUE(moved && *moved) << target;
    EXPECT_TRUE((*moved)->reached) << (*moved)->reason;
    EXPECT_NEAR(bench.truth(), target, 1.0) << "Busy " << busy_late_ms << " ms late, verified: " << (*moved)->verified;
  }
}

INSTANTIATE_TEST_SUITE_P(Gige, AnEchoIsNoArrival,
                         ::testing::Combine(::testing::Values(GigePosition::Live, GigePosition::Echo,
                                                              GigePosition::AtEnd),
                                            ::testing::Values(0, 3, 30, 100, 200)));

/// 2.5 s of travel, during which the position says nothing of it.
class AWayThatIsNotShown : public ::testing::TestWithParam<std::tuple<GigePosition, const char*>> {};

TEST_P(AWayThatIsNotShown, IsTravelledToItsEnd) {
  const auto [position, status] = GetParam();
  const std::string scene = ::testing::TempDir() + "/gige_way.toml";
  std::ofstream(scene)
      << "version = 1\n[camera]\nwidth = 32\nheight = 24\n[lens]\nsteps = 4001\nspeed_steps_per_s = 1500\n"
         "[[surface]]\nkind = \"wall\"\ndistance_m = 1.2\nconstant = 0.5\n";
  std::map<std::string, Settings::Value> keys;
  if (*status != '\0') keys.emplace("status_feature", std::string(status));
  Bench bench({.scene = scene, .position = position, .busy_late = 50ms}, keys);
  const auto moved = bench.Move(3800);
  ASSERT_TRUE(moved && *moved);
  EXPECT_TRUE((*moved)->reached) << (*moved)->reason;
  EXPECT_NEAR(bench.truth(), 3800, 1.0);
}

INSTANTIATE_TEST_SUITE_P(Gige, AWayThatIsNotShown,
                         ::testing::Values(std::tuple(GigePosition::Echo, ""), std::tuple(GigePosition::AtEnd, ""),
                                           std::tuple(GigePosition::AtEnd, "none")));

TEST(AravisFaults, AnEchoWithoutAStatusWaitsForItsSpeed) {
  const std::string scene = ::testing::TempDir() + "/gige_echo.toml";
  std::ofstream(scene)
      << "version = 1\n[camera]\nwidth = 32\nheight = 24\n[lens]\nsteps = 4001\nspeed_steps_per_s = 1500\n"
         "[[surface]]\nkind = \"wall\"\ndistance_m = 1.2\nconstant = 0.5\n";
  Bench bench({.scene = scene, .position = GigePosition::Echo}, {{"status_feature", std::string("none")}}, 1400.0);
  const auto moved = bench.Move(3800);
  ASSERT_TRUE(moved && *moved);
  EXPECT_TRUE((*moved)->reached && !(*moved)->verified) << (*moved)->reason;
  EXPECT_NEAR(bench.truth(), 3800, 1.0);
}

TEST(AravisFaults, ACameraThatVanishesInMidMoveIsDisconnected) {
  const std::string scene = ::testing::TempDir() + "/gige_vanish.toml";
  std::ofstream(scene)
      << "version = 1\n[camera]\nwidth = 32\nheight = 24\n[lens]\nsteps = 4001\nspeed_steps_per_s = 1000\n"
         "[[surface]]\nkind = \"wall\"\ndistance_m = 1.2\nconstant = 0.5\n";
  Bench bench({.scene = scene}, {});
  const testing::Trouble vanishes{testing::Trouble::Kind::Power, 700ms, 1h};
  const auto moved = bench.Move(3800, vanishes, [&](bool on) {
    if (on) bench.stand().Unplug();
  });
  ASSERT_TRUE(moved);
  ASSERT_FALSE(*moved) << (*moved)->reason;
  EXPECT_EQ(moved->error().code, Code::Disconnected) << moved->error().message;
}

/// A lens without a status: what its position does is all there is.
TEST(AravisFaults, WithoutAStatusAPositionThatChangesIsMotion) {
  const std::string scene = ::testing::TempDir() + "/gige_slow.toml";
  std::ofstream(scene)
      << "version = 1\n[camera]\nwidth = 32\nheight = 24\n[lens]\nsteps = 4001\nspeed_steps_per_s = 1500\n"
         "[[surface]]\nkind = \"wall\"\ndistance_m = 1.2\nconstant = 0.5\n";
  Bench bench({.scene = scene}, {{"status_feature", std::string("none")}});
  const auto moved = bench.Move(3800);
  ASSERT_TRUE(moved && *moved);
  EXPECT_TRUE((*moved)->reached) << (*moved)->reason;
  EXPECT_GE((*moved)->elapsed, 2500ms);
  EXPECT_NEAR(bench.truth(), 3800, 1.0);
}

/// Stopped after some 1000 of 3800 steps: what reads as the target, or still as the start, is not where it stands.
class StoppedMidway : public ::testing::TestWithParam<std::tuple<GigePosition, const char*>> {};

TEST_P(StoppedMidway, TheBoundCoversWhereItStandsAndTheSameCommandMovesOn) {
  const auto [position, feedback] = GetParam();
  const std::string scene = ::testing::TempDir() + "/gige_stop.toml";
  std::ofstream(scene)
      << "version = 1\n[camera]\nwidth = 32\nheight = 24\n[lens]\nsteps = 4001\nspeed_steps_per_s = 1500\n"
         "[[surface]]\nkind = \"wall\"\ndistance_m = 1.2\nconstant = 0.5\n";
  Bench bench({.scene = scene, .position = position, .busy_late = 50ms}, {{"feedback", std::string(feedback)}});
  const auto begin = bench.Move(10.0);
  ASSERT_TRUE(begin && *begin && (*begin)->reached);
  const testing::Trouble stop{testing::Trouble::Kind::Power, 700ms, 1h};
  const auto stopped = bench.Move(3800, stop, [&](bool on) {
    if (on) bench.rig().Stop({}, [](const Result<void>& answer) { EXPECT_TRUE(answer); });
  });
  ASSERT_TRUE(stopped);
  ASSERT_FALSE(*stopped);
  bench.AwaitRest();
  const auto focus = *bench.rig().GetStatus().axes[Axis::Focus];
  const double truth = bench.stand().camera().TrueFocus();
  ASSERT_GT(truth, 200.0);
  ASSERT_LT(truth, 3000.0);
  EXPECT_LE(std::abs(focus.position.value - truth), focus.bound.value) << focus.position.value << ", truly " << truth;
  if (position == GigePosition::Live && *feedback == 'c') {
    EXPECT_LT(focus.bound.value, 500.0) << "a position that is live shows where it stands";
  }
  const auto again = bench.Move(3800);
  ASSERT_TRUE(again && *again);
  EXPECT_TRUE((*again)->reached) << (*again)->reason;
  EXPECT_NEAR(bench.truth(), 3800, 1.0);
  EXPECT_LT(bench.rig().GetStatus().axes[Axis::Focus]->bound.value, 500.0) << "known again";
}

INSTANTIATE_TEST_SUITE_P(Gige, StoppedMidway,
                         ::testing::Values(std::tuple(GigePosition::Echo, "counts"),
                                           std::tuple(GigePosition::AtEnd, "counts"),
                                           std::tuple(GigePosition::Live, "counts"),
                                           std::tuple(GigePosition::Echo, "echo")));

TEST(AravisFaults, AnErrorStatusEndsAMoveAsAFault) {
  const std::string scene = ::testing::TempDir() + "/gige_stall.toml";
  std::ofstream(scene) << "version = 1\n[camera]\nwidth = 32\nheight = 24\n[lens]\nsteps = 4001\n"
                          "[[surface]]\nkind = \"wall\"\ndistance_m = 1.2\nconstant = 0.5\n"
                          "[[fault]]\nat_ms = 0\nkind = \"stall\"\n";
  Bench bench({.scene = scene, .position = GigePosition::Echo}, kEncoder);
  const auto moved = bench.Move(3800);
  ASSERT_TRUE(moved && *moved);
  EXPECT_FALSE((*moved)->reached || (*moved)->verified);
  EXPECT_EQ((*moved)->reason, "the lens reports: the camera reports a lens error");
  EXPECT_LT((*moved)->elapsed, 1s);
}

/// Allied Vision's names have no abort.
TEST(AravisFaults, WithoutAbortTheMoverHearsThatItTravelsOn) {
  Bench bench({.names = "allied-vision"}, {});
  std::optional<Result<rig::MoveOutcome>> end;
  std::optional<Result<void>> stopped;
  bench.rig().Move(Axis::Focus, {.kind = rig::Target::Kind::Native, .value = 4000, .from = {}},
                   [&](Result<rig::MoveOutcome> outcome) { end = std::move(outcome); });
  const MonotonicClock clock;
  const Instant begin = clock.Now();
  while (!end && clock.Now() < begin + 10s) {
    if (!stopped && clock.Now() > begin + 50ms) {
      bench.rig().Stop({}, [&](Result<void> answer) {
        stopped = std::move(answer);
        EXPECT_LT(bench.stand().camera().TrueFocus(), 3000.0);
        EXPECT_TRUE(bench.rig().GetStatus().axes[Axis::Focus]->moving);
      });
    }
    std::this_thread::sleep_until(std::min(bench.rig().Step(clock.Now()), clock.Now() + 2ms));
  }
  ASSERT_TRUE(end && stopped);
  ASSERT_FALSE(*stopped);
  EXPECT_EQ(stopped->error().code, Code::Unsupported);
  EXPECT_NE(stopped->error().message.find("travels on until it rests"), std::string::npos);
  ASSERT_FALSE(*end);
  EXPECT_EQ(end->error().code, Code::Cancelled);
  EXPECT_NE(end->error().message.find("travelled on and rests at 4000"), std::string::npos) << end->error().message;
  EXPECT_NEAR(bench.stand().camera().TrueFocus(), 4000, 1.0);
}

}  // namespace
}  // namespace lensd
