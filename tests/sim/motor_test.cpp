// The simulated motor against the textbook's motions and against models stepped tick by tick, through random commands.
#include "sim/mechanics/motor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace lensd::sim {
namespace {

Duration At(double seconds) {
  return Duration(std::llround(seconds * 1e9));
}

MotorSettings Rigid() {
  MotorSettings settings;
  settings.high = 8191.0;
  settings.top_speed = 8000.0;
  settings.acceleration = 200000.0;
  return settings;
}

/// Position of a trapezoid of speed from 0 to `distance`, from the textbook.
double Trapezoid(double distance, double v, double a, double t) {
  const double peak = std::min(v, std::sqrt(a * distance));
  const double ramp = peak / a;
  const double total = distance / peak + ramp;
  if (t <= ramp) return 0.5 * a * t * t;
  if (t >= total) return distance;
  if (t >= total - ramp) return distance - 0.5 * a * (total - t) * (total - t);
  return 0.5 * peak * ramp + peak * (t - ramp);
}

TEST(Motor, FollowsTheTrapezoidOfSpeed) {
  for (const double distance : {4000.0, 320.0, 319.0, 50.0, 1.0}) {
    Motor motor(Rigid(), 1000.0);
    motor.MoveTo(At(0.0), 1000.0 + distance);
    Motor back(Rigid(), 5000.0);
    back.MoveTo(At(0.0), 5000.0 - distance);
    const double peak = std::min(8000.0, std::sqrt(200000.0 * distance));
    const double total = distance / peak + peak / 200000.0;
    for (double t = 0.0; t < 1.2 * total; t += total / 97.0) {
      const double expected = Trapezoid(distance, 8000.0, 200000.0, t);
      EXPECT_NEAR(motor.CountAt(At(t)), 1000.0 + expected, 1e-4) << distance << " at " << t;
      EXPECT_NEAR(back.CountAt(At(t)), 5000.0 - expected, 1e-4) << distance << " at " << t;
      EXPECT_NEAR(motor.PlaceAt(At(t)), motor.CountAt(At(t)), 1e-9);
    }
    EXPECT_TRUE(motor.MovingAt(At(total - 1e-6)));
    EXPECT_FALSE(motor.MovingAt(At(total + 1e-6)));
    EXPECT_EQ(motor.CountAt(At(total + 1e-6)), 1000.0 + distance);
  }
}

TEST(Motor, BrakesAndComesBackWhenRetargetedBehind) {
  Motor motor(Rigid(), 0.0);
  motor.MoveTo(At(0.0), 8000.0);
  motor.MoveTo(At(0.5), 1000.0);
  // At 0.5 s: 8000 * (0.5 - 0.02) = 3840, at full speed; it stops 160 further.
  EXPECT_NEAR(motor.CountAt(At(0.5)), 3840.0, 1e-6);
  EXPECT_NEAR(motor.CountAt(At(0.54)), 4000.0, 1e-6);
  const double home = 0.54 + 3000.0 / 8000.0 + 0.04;
  EXPECT_TRUE(motor.MovingAt(At(home - 1e-6)));
  EXPECT_FALSE(motor.MovingAt(At(home + 1e-6)));
  EXPECT_EQ(motor.CountAt(At(home + 1e-6)), 1000.0);
}

TEST(Motor, KeepsSpeedAndAccelerationWithinLimitsThroughRandomCommands) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0.0, 8191.0);
  std::uniform_real_distribution<double> wait(0.0, 0.4);
  Motor motor(Rigid(), 0.0);
  constexpr double kTick = 1e-4;
  double speed_before = 0.0;
  double t = 0.0;
  for (int command = 0; command < 200; ++command) {
    if (command % 5 == 4) {
      motor.Halt(At(t), 1.0);
    } else {
      motor.MoveTo(At(t), std::round(place(random)));
    }
    const double until = t + wait(random);
    for (; t < until; t += kTick) {
      const double speed = (motor.CountAt(At(t + kTick)) - motor.CountAt(At(t))) / kTick;
      EXPECT_LE(std::abs(speed), 8000.0 * (1.0 + 1e-6));
      EXPECT_LE(std::abs(speed - speed_before) / kTick, 200000.0 * 1.01 + 20.0);
      speed_before = speed;
    }
  }
}

TEST(Motor, HaltsWithinItsStoppingDistanceOnAWholeStep) {
  Motor motor(Rigid(), 0.0);
  motor.MoveTo(At(0.0), 8000.0);
  motor.Halt(At(0.2501), 1.0);
  const double at_stop = motor.CountAt(At(0.2501));
  const double end = motor.CountAt(At(2.0));
  EXPECT_EQ(end, std::ceil(at_stop + 160.0));
  EXPECT_FALSE(motor.MovingAt(At(0.2501 + 0.04 + 2.0 / 8000.0)));
}

TEST(Motor, BacklashTruthTable) {
  MotorSettings settings = Rigid();
  settings.backlash = 10.0;
  Motor motor(settings, 50.0);
  struct Row {
    double target;
    double place;
  };
  const Row rows[] = {{100, 100}, {95, 100}, {90, 100},  {89, 99}, {80, 90}, {85, 90},
                      {90, 90},   {91, 91},  {100, 100}, {0, 10},  {5, 10}};
  double t = 0.0;
  for (const Row& row : rows) {
    motor.MoveTo(At(t), row.target);
    t += 1.0;
    EXPECT_EQ(motor.CountAt(At(t)), row.target);
    EXPECT_NEAR(motor.PlaceAt(At(t)), row.place, 1e-9) << "after moving to " << row.target;
  }
}

/// Backlash worked out tick by tick, against what follows from whole paths.
TEST(Motor, BacklashAgreesWithATickedModelThroughRandomCommands) {
  std::mt19937 random(11);
  for (const double gap : {0.5, 12.0, 400.0}) {
    MotorSettings settings = Rigid();
    settings.backlash = gap;
    Motor motor(settings, 4000.0);
    std::uniform_real_distribution<double> jump(-2.5 * gap - 5.0, 2.5 * gap + 5.0);
    std::uniform_real_distribution<double> wait(0.0, 0.1);
    constexpr double kTick = 5e-5;
    double place = 4000.0;
    double target = 4000.0;
    double t = 0.0;
    for (int command = 0; command < 60; ++command) {
      target = std::clamp(target + jump(random), 0.0, 8191.0);
      motor.MoveTo(At(t), target);
      const double until = t + wait(random);
      for (; t < until; t += kTick) {
        const double count = motor.CountAt(At(t));
        place = std::clamp(place, count, count + gap);
        // Within one tick of the top speed.
        ASSERT_NEAR(motor.PlaceAt(At(t)), place, 8000.0 * kTick + 1e-6) << "gap " << gap << " at " << t;
        const double here = motor.PlaceAt(At(t));
        ASSERT_GE(here, count - 1e-6);
        ASSERT_LE(here, count + gap + 1e-6);
      }
    }
  }
}

/// The spring's equation integrated by the midpoint rule.
TEST(Motor, RingsAsASpringDoes) {
  MotorSettings settings = Rigid();
  settings.ring_hz = 40.0;
  settings.ring_damping = 0.05;
  Motor motor(settings, 0.0);
  motor.MoveTo(At(0.0), 600.0);
  const double w = 2.0 * std::numbers::pi * 40.0;
  constexpr double kTick = 1e-6;
  double x = 0.0;
  double v = 0.0;
  const auto pull = [&](double t, double place, double speed) {
    const double count = Trapezoid(600.0, 8000.0, 200000.0, t);
    const double h = 1e-7;
    const double drive =
        t < h ? 0.0 : (Trapezoid(600.0, 8000.0, 200000.0, t + h) - Trapezoid(600.0, 8000.0, 200000.0, t - h)) / (2 * h);
    return -2.0 * 0.05 * w * (speed - drive) - w * w * (place - count);
  };
  double largest = 0.0;
  for (int i = 0; i < 300000; ++i) {
    const double t = i * kTick;
    if (i % 1000 == 0) {
      EXPECT_NEAR(motor.PlaceAt(At(t)), x, 2e-3) << "at " << t;
      if (t > 0.13) largest = std::max(largest, std::abs(x - 600.0));
    }
    const double mid_x = x + 0.5 * kTick * v;
    const double mid_v = v + 0.5 * kTick * pull(t, x, v);
    x += kTick * mid_v;
    v += kTick * pull(t + 0.5 * kTick, mid_x, mid_v);
  }
  EXPECT_GT(largest, 1.0);  // it does ring after the counts have stopped
}

TEST(Motor, CreepsAfterTheCountWithItsTimeConstant) {
  MotorSettings settings = Rigid();
  settings.creep_s = 0.002;
  Motor motor(settings, 0.0);
  motor.MoveTo(At(0.0), 4000.0);
  // In steady motion it lags by speed times time constant.
  EXPECT_NEAR(motor.CountAt(At(0.3)) - motor.PlaceAt(At(0.3)), 8000.0 * 0.002, 1e-6);
  const double end = 0.54;
  const double left = 4000.0 - motor.PlaceAt(At(end));
  EXPECT_GT(left, 0.1);
  EXPECT_NEAR(4000.0 - motor.PlaceAt(At(end + 0.010)), left * std::exp(-5.0), 1e-9);
}

TEST(Motor, HomesToItsInnerStopWithTheBacklashTakenUp) {
  MotorSettings settings = Rigid();
  settings.backlash = 20.0;
  Motor motor(settings, 3000.0);
  motor.Knock(At(0.0), 77.0);
  EXPECT_NEAR(motor.PlaceAt(At(0.0)), 3077.0, 1e-9);
  EXPECT_EQ(motor.CountAt(At(0.0)), 3000.0);
  motor.Home(At(0.1));
  EXPECT_FALSE(motor.HomedAt(At(0.2)));
  EXPECT_TRUE(motor.HomedAt(At(2.0)));
  EXPECT_EQ(motor.CountAt(At(2.0)), 0.0);
  EXPECT_NEAR(motor.PlaceAt(At(2.0)), 0.0, 1e-9);
  motor.MoveTo(At(2.0), 500.0);
  EXPECT_NEAR(motor.PlaceAt(At(3.0)), 500.0, 1e-9);
}

TEST(Motor, AnInterruptedSearchForHomeLeavesItUnhomed) {
  Motor motor(Rigid(), 3000.0);
  motor.Home(At(0.0));
  motor.MoveTo(At(0.1), 2000.0);
  EXPECT_FALSE(motor.HomedAt(At(2.0)));
}

TEST(Motor, LosesStepsAtItsStops) {
  Motor motor(Rigid(), 100.0);
  motor.Knock(At(0.0), -40.0);
  motor.MoveTo(At(0.0), 0.0);  // the mechanism meets the stop 60 counts on
  EXPECT_EQ(motor.CountAt(At(1.0)), 0.0);
  EXPECT_NEAR(motor.PlaceAt(At(1.0)), 0.0, 1e-9);
  motor.MoveTo(At(1.0), 100.0);
  EXPECT_NEAR(motor.PlaceAt(At(2.0)), 100.0, 1e-9);  // the stop has taken the knock back
}

TEST(Motor, MissesAPartOfEachMove) {
  Motor motor(Rigid(), 1000.0);
  motor.SetLoss(At(0.0), 0.25);
  motor.MoveTo(At(0.0), 2000.0);
  EXPECT_EQ(motor.CountAt(At(1.0)), 2000.0);
  EXPECT_NEAR(motor.PlaceAt(At(1.0)), 1750.0, 1e-9);
  motor.SetLoss(At(1.0), 0.0);
  motor.MoveTo(At(1.0), 3000.0);
  EXPECT_NEAR(motor.PlaceAt(At(2.0)), 2750.0, 1e-9);
}

TEST(Motor, MissesStepsOnlyWhileTheFaultLasts) {
  Motor motor(Rigid(), 0.0);
  motor.MoveTo(At(0.0), 4000.0);
  motor.SetLoss(At(0.1), 1.0);
  motor.SetLoss(At(0.2), 0.0);
  EXPECT_EQ(motor.CountAt(At(1.0)), 4000.0);
  EXPECT_NEAR(motor.PlaceAt(At(1.0)), 4000.0 - 800.0, 1e-6);
}

TEST(Motor, StallsDeadAndSaysSo) {
  Motor motor(Rigid(), 0.0);
  motor.MoveTo(At(0.0), 4000.0);
  motor.SetStalled(At(0.2), true);
  EXPECT_NEAR(motor.CountAt(At(1.0)), 8000.0 * 0.18, 1e-6);
  EXPECT_FALSE(motor.MovingAt(At(0.3)));
  EXPECT_TRUE(motor.ComplainsAt(At(0.3)));
  motor.MoveTo(At(0.5), 100.0);
  EXPECT_NEAR(motor.CountAt(At(1.0)), 8000.0 * 0.18, 1e-6);
  motor.SetStalled(At(1.0), false);
  EXPECT_FALSE(motor.ComplainsAt(At(1.0)));
  motor.MoveTo(At(1.0), 100.0);
  EXPECT_EQ(motor.CountAt(At(2.0)), 100.0);
}

TEST(Motor, AStallAtRestIsNoticedByTheNextMove) {
  Motor motor(Rigid(), 50.0);
  motor.SetStalled(At(0.0), true);
  EXPECT_FALSE(motor.ComplainsAt(At(0.1)));
  motor.MoveTo(At(0.1), 60.0);
  EXPECT_TRUE(motor.ComplainsAt(At(0.1)));
}

TEST(Motor, RemembersThePast) {
  Motor motor(Rigid(), 0.0);
  motor.MoveTo(At(0.0), 1000.0);
  const double then = motor.PlaceAt(At(0.05));
  motor.MoveTo(At(0.1), 0.0);
  motor.MoveTo(At(0.12), 700.0);
  EXPECT_EQ(motor.PlaceAt(At(0.05)), then);
}

}  // namespace
}  // namespace lensd::sim
