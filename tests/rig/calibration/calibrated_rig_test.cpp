// A calibration in a rig: where moves end, how surely, and what follows the temperature.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>

#include "tests/rig/calibration_samples.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

TEST_F(RigTest, ACalibrationMovesToTheRightStepAndWidensTheBound) {
  auto calibration = With({Measured(21)});
  calibration->serial = "1";
  auto made = Rig::Create({}, testing::MakeFakeDevice(clock_, controls_), clock_, calibration);
  ASSERT_TRUE(made) << made.error().message;
  rig_ = *std::move(made);
  Answers<MoveOutcome> moved;
  rig_->Move(Axis::Focus, {.kind = Target::Kind::Extension, .value = 0.5e-3, .from = {}, .take_up = {}}, moved.Take());
  RunUntil(moved);
  ASSERT_TRUE(moved.only());
  const MoveOutcome& outcome = *moved.only();
  EXPECT_NEAR(TrueExtension(outcome.position.value), 0.5e-3, 0.5e-6);
  EXPECT_NEAR(TrueExtension(outcome.position.value), outcome.extension->value, outcome.extension_bound->value);
  EXPECT_GT(outcome.extension_bound->value, 0.5e-6 + 0.4e-6);
  EXPECT_LT(outcome.extension_bound->value, 0.5e-6 + 0.7e-6);
  EXPECT_EQ(rig_->GetStatus().grade, Grade::Calibrated);
  EXPECT_EQ(rig_->GetStatus().extension_error->value, 0.5e-6);
}

TEST_F(RigTest, ACalibrationComesAndGoesAndBringsItsBacklash) {
  Open();
  auto calibration = With({Measured(21)});
  Answers<void> refused, taken;
  calibration->serial = "2";
  rig_->SetCalibration(calibration, refused.Take());
  RunUntil(refused);
  EXPECT_EQ(refused.only().error().code, Code::InvalidArgument);
  EXPECT_EQ(rig_->GetStatus().grade, Grade::Uncalibrated);
  auto right = With({Measured(21)});
  right->serial = "1";
  right->backlash[Axis::Focus] = Backlash{36.4, 36.0, 36.8, true};
  rig_->SetCalibration(right, taken.Take());
  RunUntil(taken);
  EXPECT_TRUE(taken.only());
  EXPECT_EQ(rig_->GetStatus().grade, Grade::Calibrated);
  Answers<MoveOutcome> down;
  rig_->Move(Axis::Focus, At(50), down.Take());
  RunUntil(down);
  EXPECT_EQ(controls_->moves, 2);  // past the target and back
  Answers<void> gone;
  rig_->SetCalibration(nullptr, gone.Take());
  RunUntil(gone);
  EXPECT_EQ(rig_->GetStatus().grade, Grade::Uncalibrated);
}

// Drift is told exactly, and the thermometer's reading is rounded: what that leaves out counts in the bound.
TEST_F(RigTest, TheBoundHoldsAtEveryTemperature) {
  constexpr double kPerDegree = 20e-6;
  auto calibration = With({Measured(21)});
  calibration->serial = "1";
  calibration->focus.front().error = Metres{0.0};
  calibration->temperature = TemperatureModel{Metres{kPerDegree}, Metres{}, Celsius{20}, Celsius{0}, Celsius{40}};
  RigConfig config;
  config.temperature.compensate = true;
  config.temperature.minimum_move = 1e9;
  config.temperature.most_per_minute = 1e6;
  controls_->temperature_c = 20.0;
  rig_ = *Rig::Create(config, testing::MakeFakeDevice(clock_, controls_), clock_, calibration);
  Run(1s);
  const double at_20 = rig_->GetStatus().extension->value;
  for (double warmer = -7.0; warmer < 7.0; warmer += 0.013) {
    controls_->temperature_c = 20.0 + warmer;
    Run(1s);
    const Status now = rig_->GetStatus();
    EXPECT_LE(std::abs(now.extension->value - at_20 - kPerDegree * warmer), now.extension_error->value + 1e-12)
        << warmer;
  }
}

TEST_F(RigTest, FocusFollowsTheTemperatureWhenToldToAndWorthAMove) {
  auto calibration = With({Measured(21)});
  calibration->serial = "1";
  calibration->temperature = TemperatureModel{Metres{2e-6}, Metres{}, Celsius{20}, Celsius{0}, Celsius{40}};
  RigConfig config;
  config.temperature.compensate = true;
  config.temperature.minimum_move = 6.0;
  config.temperature.most_per_minute = 1e6;
  for (const bool compensate : {true, false}) {
    config.temperature.compensate = compensate;
    *controls_ = {};
    controls_->temperature_c = 20.0;
    rig_ = *Rig::Create(config, testing::MakeFakeDevice(clock_, controls_), clock_, calibration);
    Answers<MoveOutcome> moved;
    rig_->Move(Axis::Focus, {.kind = Target::Kind::Extension, .value = 0.5e-3, .from = {}, .take_up = {}},
               moved.Take());
    RunUntil(moved);
    const double at_20 = Focus();
    controls_->temperature_c = 21.5;  // 3 um are 3 steps: not worth it
    Run(5s);
    EXPECT_EQ(Focus(), at_20);
    controls_->temperature_c = 26.0;
    Run(5s);
    if (!compensate) {
      EXPECT_EQ(Focus(), at_20);
      continue;
    }
    // 12 um more by themselves: the motor takes them back.
    EXPECT_NEAR(TrueExtension(Focus()) + 12e-6, 0.5e-3, 0.6e-6);
    const double at_26 = Focus();
    controls_->temperature_c = 20.0;
    Run(5s);
    EXPECT_EQ(Focus(), at_20);
    EXPECT_LT(at_26, at_20);
    Answers<void> stopped;
    rig_->Stop({}, stopped.Take());  // what was stopped is held no longer
    controls_->temperature_c = 40.0;
    Run(5s);
    EXPECT_EQ(Focus(), at_20);
  }
}

}  // namespace
}  // namespace lensd::rig
