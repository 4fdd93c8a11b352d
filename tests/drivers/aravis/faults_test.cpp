// Moves over GigE Vision with late Busy, three kinds of position feature, stale registers, knocks, stalls and loss of
// power, the rig on top: what is verified was there.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>

#include "gige_stand.h"
#include "rig/rig.h"
#include "test_level.h"

namespace lensd {
namespace {

using drivers::Axis;
using sim::GigePosition;
using namespace std::chrono_literals;

struct Tally {
  int verified = 0, reached = 0, not_reached = 0, failed = 0;
};

/// A lens of 4001 steps whose encoder sees what the mechanism does, wrong now and then. Without speed and acceleration
/// to spare, a move takes 5 to 200 ms.
std::string WriteScene(std::mt19937& random, bool faults) {
  const std::string path = ::testing::TempDir() + "/gige_faults_" + std::to_string(getpid()) + ".toml";
  std::ofstream file(path);
  file << "version = 1\n[camera]\nwidth = 32\nheight = 24\n[lens]\nfeedback = \"encoder\"\nsteps = 4001\n"
          "speed_steps_per_s = 20000\nacceleration_steps_per_s2 = 400000\nsettle_ms = 2\n"
          "[[surface]]\nkind = \"wall\"\ndistance_m = 1.2\nconstant = 0.5\n";
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (double at = 500.0; faults && at < 120e3; at += 300.0 + 1500.0 * uniform(random)) {
    const double which = uniform(random);
    file << "[[fault]]\nat_ms = " << at << "\n";
    if (which < 0.4) {
      file << "kind = \"jump\"\nsteps = " << std::lround(400.0 * uniform(random) - 200.0) << "\n";
    } else if (which < 0.7) {
      file << "kind = \"missed-steps\"\nfactor = " << uniform(random) << "\nfor_ms = " << 400.0 * uniform(random)
           << "\n";
    } else {
      file << "kind = \"stall\"\nfor_ms = " << 600.0 * uniform(random) << "\n";
    }
  }
  return path;
}

class Bench {
 public:
  Bench(sim::GigeOptions options, std::map<std::string, Settings::Value> keys, unsigned seed)
      : random_(seed), stand_(std::move(options), std::move(keys)) {
    auto device = stand_.Open();
    if (!device) throw std::runtime_error(device.error().message);
    rig::RigConfig config;
    config.axes[Axis::Focus].settle = 20ms;
    rig_ = rig::Rig::Create(config, *std::move(device), clock_).value();
  }

  /// Until it ends, with stale registers in between where `spoil`.
  std::optional<Result<rig::MoveOutcome>> Move(double target, bool spoil) {
    std::optional<Result<rig::MoveOutcome>> end;
    rig_->Move(Axis::Focus, {.kind = rig::Target::Kind::Native, .value = target, .from = {}},
               [&](Result<rig::MoveOutcome> outcome) {
                 truth_ = stand_.camera().TrueFocus();  // then, not later
                 end = std::move(outcome);
               });
    const Instant limit = clock_.Now() + 30s;
    const Instant stale_from = clock_.Now() + std::chrono::milliseconds(Whole(300));
    const Instant stale_to = stale_from + std::chrono::milliseconds(Whole(150));
    while (!end && clock_.Now() < limit) {
      if (spoil) stand_.camera().Freeze(clock_.Now() > stale_from && clock_.Now() < stale_to);
      const Instant next = rig_->Step(clock_.Now());
      std::this_thread::sleep_until(std::min(next, clock_.Now() + 2ms));
    }
    stand_.camera().Freeze(false);
    return end;
  }
  int Whole(int below) { return std::uniform_int_distribution(0, below - 1)(random_); }
  double truth() const { return truth_; }
  rig::Rig& rig() { return *rig_; }
  testing::GigeStand& stand() { return stand_; }

 private:
  std::mt19937 random_;
  MonotonicClock clock_;
  testing::GigeStand stand_;
  std::unique_ptr<rig::Rig> rig_;
  double truth_ = 0.0;
};

const std::map<std::string, Settings::Value> kEncoder{{"feedback", std::string("encoder")}};

class AnEchoIsNoArrival : public ::testing::TestWithParam<std::tuple<GigePosition, int>> {};

/// As tried from outside: the target is read back at once, and Busy rises late.
TEST_P(AnEchoIsNoArrival, WhateverThePositionReadsAndHoweverLateBusyRises) {
  const auto [position, busy_late_ms] = GetParam();
  Bench bench({.position = position, .busy_late = std::chrono::milliseconds(busy_late_ms)}, kEncoder, 3);
  for (const double target : {3900.0, 100.0, 2000.0, 2003.0, 0.0}) {
    const auto moved = bench.Move(target, false);
    ASSERT_TRUE(moved && *moved) << target;
    EXPECT_TRUE((*moved)->reached) << (*moved)->reason;
    EXPECT_NEAR(bench.truth(), target, 1.0) << "Busy " << busy_late_ms << " ms late, verified: " << (*moved)->verified;
  }
}

INSTANTIATE_TEST_SUITE_P(Gige, AnEchoIsNoArrival,
                         ::testing::Combine(::testing::Values(GigePosition::Live, GigePosition::Echo,
                                                              GigePosition::AtEnd),
                                            ::testing::Values(0, 3, 30, 100, 200)));

TEST(AravisFaults, NothingIsVerifiedThatWasNotThere) {
  const long moves = testing::ByLevel(30, 200, 10000);
  constexpr long kEach = 25;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  Tally all;
  for (long done = 0; done < moves;) {
    const auto position = static_cast<GigePosition>(random() % 3);
    // An echo that is called an encoder cannot see a knock: that would be the configuration's lie.
    const bool knocks = position != GigePosition::Echo;
    const auto late = std::chrono::microseconds(static_cast<int>(200e3 * uniform(random)));
    const std::string scene = WriteScene(random, knocks);
    Bench bench({.scene = scene, .position = position, .busy_late = late}, kEncoder, static_cast<unsigned>(random()));
    for (long i = 0; i < kEach && done < moves; ++i, ++done) {
      if (i == kEach / 2 && uniform(random) < 0.2) {
        bench.stand().Unplug();
        bench.stand().Plug();
      }
      const double target = bench.Whole(4001);
      const auto moved = bench.Move(target, i % 2 == 0);
      ASSERT_TRUE(moved) << "the move to " << target << " never ended";
      if (!*moved) {
        ++all.failed;
        continue;
      }
      ++((*moved)->reached ? all.reached : all.not_reached);
      if (!(*moved)->verified) continue;
      ++all.verified;
      EXPECT_NEAR(bench.truth(), target, 1.0 + (*moved)->bound.value)
          << "position kind " << static_cast<int>(position) << ", Busy " << late.count() * 1e-3 << " ms late";
    }
    std::filesystem::remove(scene);
  }
  std::printf("%ld moves: %d reached, %d of them verified, %d not reached, %d failed\n", moves, all.reached,
              all.verified, all.not_reached, all.failed);
  EXPECT_GT(all.verified, moves / 4);
  EXPECT_GT(all.not_reached + all.failed, 0) << "no fault was ever noticed";
}

/// A lens without a status: what its position does is all there is.
TEST(AravisFaults, WithoutAStatusAPositionThatChangesIsMotion) {
  const std::string scene = ::testing::TempDir() + "/gige_slow.toml";
  std::ofstream(scene)
      << "version = 1\n[camera]\nwidth = 32\nheight = 24\n[lens]\nsteps = 4001\nspeed_steps_per_s = 1500\n"
         "[[surface]]\nkind = \"wall\"\ndistance_m = 1.2\nconstant = 0.5\n";
  Bench bench({.scene = scene}, {{"status_feature", std::string("none")}}, 1);
  const auto moved = bench.Move(3800, false);
  ASSERT_TRUE(moved && *moved);
  EXPECT_TRUE((*moved)->reached) << (*moved)->reason;
  EXPECT_GE((*moved)->elapsed, 2500ms);
  EXPECT_NEAR(bench.truth(), 3800, 1.0);
}

TEST(AravisFaults, AnErrorStatusEndsAMoveAsAFault) {
  const std::string scene = ::testing::TempDir() + "/gige_stall.toml";
  std::ofstream(scene) << "version = 1\n[camera]\nwidth = 32\nheight = 24\n[lens]\nsteps = 4001\n"
                          "[[surface]]\nkind = \"wall\"\ndistance_m = 1.2\nconstant = 0.5\n"
                          "[[fault]]\nat_ms = 0\nkind = \"stall\"\n";
  Bench bench({.scene = scene, .position = GigePosition::Echo}, kEncoder, 1);
  const auto moved = bench.Move(3800, false);
  ASSERT_TRUE(moved && *moved);
  EXPECT_FALSE((*moved)->reached || (*moved)->verified);
  EXPECT_EQ((*moved)->reason, "the lens reports: the camera reports a lens error");
  EXPECT_LT((*moved)->elapsed, 1s);
}

/// Allied Vision's names have no abort.
TEST(AravisFaults, WithoutAbortTheMoverHearsThatItTravelsOn) {
  Bench bench({.names = "allied-vision"}, {}, 1);
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
