// Hold: what the rig does by itself waits, what it is told to do does not.
#include <chrono>

#include "sim/scene.h"
#include "sim/world.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

/// Focus goes after a warmth of 2 um a degree.
class Holding : public RigTest {
 protected:
  void OpenWarm() {
    auto calibration = std::make_shared<Calibration>();
    calibration->serial = "1";
    calibration->temperature = TemperatureModel{Metres{2e-6}, Metres{}, Celsius{20}, Celsius{0}, Celsius{40}};
    RigConfig config;
    config.temperature.compensate = true;
    config.temperature.most_per_minute = 1e6;
    controls_->temperature_c = 20.0;
    rig_ = *Rig::Create(config, testing::MakeFakeDevice(clock_, controls_), clock_, calibration);
    Answers<MoveOutcome> moved;
    rig_->Move(Axis::Focus, At(500), moved.Take());
    RunUntil(moved);
    Run(1s);
  }
};

TEST_F(Holding, TheTemperatureIsFollowedOnlyAfterIt) {
  OpenWarm();
  const double before = Focus();
  const Instant until = clock_.Now() + 10s;
  EXPECT_TRUE(rig_->Hold(until));
  controls_->temperature_c = 30.0;
  Run(9s);
  EXPECT_EQ(Focus(), before);
  EXPECT_EQ(rig_->GetStatus().held_until, until);
  Run(3s);
  EXPECT_LT(Focus(), before - 10.0);  // 20 um by themselves
  EXPECT_FALSE(rig_->GetStatus().held_until);
}

TEST_F(Holding, ItsEndIsSooner) {
  OpenWarm();
  const double before = Focus();
  (void)rig_->Hold(clock_.Now() + 100s);
  controls_->temperature_c = 30.0;
  Run(3s);
  EXPECT_EQ(Focus(), before);
  (void)rig_->Hold(Instant{});
  Run(3s);
  EXPECT_LT(Focus(), before - 10.0);
}

TEST_F(Holding, ItsEndIsToldWhenItComes) {
  Open();
  Run(1s);
  const Instant until = clock_.Now() + 1234ms;
  (void)rig_->Hold(until);
  Instant next = clock_.Now();
  while (next < until) {
    clock_.AdvanceTo(std::max(next, clock_.Now() + 1us));
    next = rig_->Step(clock_.Now());
    ASSERT_GT(next, clock_.Now() - 1s);
    if (clock_.Now() < until) {
      EXPECT_TRUE(rig_->GetStatus().held_until);
      EXPECT_LE(next, until);
    }
  }
}

TEST_F(Holding, CommandsAndStopsGoOn) {
  OpenWarm();
  (void)rig_->Hold(clock_.Now() + 100s);
  Answers<MoveOutcome> moved;
  rig_->Move(Axis::Focus, At(700), moved.Take());
  RunUntil(moved);
  ASSERT_TRUE(moved.only());
  EXPECT_TRUE(moved.only()->reached);
  Answers<MoveOutcome> stopped;
  rig_->Move(Axis::Focus, At(100), stopped.Take());
  Run(20ms);
  EXPECT_FALSE(rig_->Hold(clock_.Now() + 100s));  // it moves
  rig_->Stop({}, [](const Result<void>&) {});
  RunUntil(stopped);
  EXPECT_EQ(stopped.only().error().code, Code::Cancelled);
}

TEST(HoldingTracking, TheNextSearchWaits) {
  auto scene = sim::LoadScene(std::string(LENSD_SOURCE_DIR) + "/scenes/tune/brick.toml");
  ASSERT_TRUE(scene) << scene.error().message;
  scene->surfaces.front().sway_m = 0.2;
  scene->surfaces.front().sway_s = 20.0;
  SteppedClock clock;
  auto world = sim::OpenWorld(std::make_shared<const sim::Scene>(*std::move(scene)), clock,
                              {.seed = 5, .focus_start = Native{2500}, .pictures = {}});
  int answers = 0;
  bool ended = false;
  auto rig = *Rig::Create({}, std::move(world->device), clock);  // ends the tracking when it goes, and says so
  AutofocusRequest request;
  request.track = [&](const AutofocusOutcome&) { ++answers; };
  rig->Autofocus(std::move(request), nullptr, [&](const Result<AutofocusOutcome>&) { ended = true; });
  const auto run_until = [&](Instant end, auto done) {
    while (clock.Now() < end && !done()) clock.AdvanceTo(rig->Step(clock.Now()));
  };
  EXPECT_FALSE(rig->Hold(clock.Now() + 1ms));  // it searches
  run_until(Instant{20s}, [&] { return answers == 1; });
  ASSERT_EQ(answers, 1);
  run_until(clock.Now() + 5ms, [] { return false; });
  const double before = rig->GetStatus().axes[Axis::Focus]->position.value;
  EXPECT_TRUE(rig->Hold(clock.Now() + 4s));  // it tracks, and stands
  run_until(clock.Now() + 3900ms, [] { return false; });
  EXPECT_EQ(answers, 1);
  EXPECT_EQ(rig->GetStatus().axes[Axis::Focus]->position.value, before);
  run_until(clock.Now() + 4s, [&] { return answers > 1; });
  EXPECT_GT(answers, 1);
  EXPECT_FALSE(ended);
}

}  // namespace
}  // namespace lensd::rig
