// A liquid lens: the power changes, the sensor stays. Everything here is judged by the blur of that lens itself,
// |A (Z_s (P - U) - 1)|, worked out from the answer's aperture and power.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "optics/lens_positions.h"
#include "optics/planner.h"

namespace lensd::optics {
namespace {

constexpr double kSensor = 0.025;

PlanRequest Lens(double low_n, double high_n, double low_p, double high_p) {
  PlanRequest request;
  request.focal_length = kSensor;
  request.liquid = true;
  request.f_numbers = {low_n, high_n};
  const auto x = [](double power) { return kSensor * kSensor * (power - 1.0 / kSensor); };
  request.extensions = {x(low_p), x(high_p)};
  return request;
}

BlurLimit Limit(LimitKind kind, double near_d, double far_d, double limit_m, Side side = Side::Either) {
  BlurLimit limit;
  limit.name = kind == LimitKind::Sharp ? "sharp" : "blurred";
  limit.kind = kind;
  limit.depths = {{PlanDepth::Vergence(near_d), PlanDepth::Vergence(far_d)}};
  limit.limit = limit_m;
  limit.side = side;
  return limit;
}

double Power(const PlanAnswer& answer) {
  return 1.0 / (answer.sensor_distance.value - answer.extension.value);
}

double Blur(const PlanAnswer& answer, double vergence_d) {
  return std::abs(answer.aperture_diameter.value * (answer.sensor_distance.value * (Power(answer) - vergence_d) - 1.0));
}

TEST(LiquidPlan, FocusesWhereItIsAsked) {
  PlanRequest request = Lens(2.8, 2.8, 38.0, 48.0);
  request.focus = PlanDepth::Vergence(2.5);
  const auto plan = Plan(request);
  ASSERT_TRUE(plan.has_value() && plan->feasible);
  EXPECT_NEAR(Power(*plan), 42.5, 1e-9);
  EXPECT_DOUBLE_EQ(plan->sensor_distance.value, kSensor);
  EXPECT_NEAR(plan->focal_plane.value, 2.5, 1e-12);
  EXPECT_NEAR(plan->aperture_diameter.value, kSensor / 2.8, 1e-15);
  EXPECT_NEAR(plan->magnification, kSensor * 2.5, 1e-12);
  // Inside the focal length of a lens at rest: this one bends more.
  request.extensions = {0.0, kSensor * kSensor * 60.0};
  request.focus = PlanDepth::Distance(0.02);
  const auto near = Plan(request);
  ASSERT_TRUE(near.has_value() && near->feasible);
  EXPECT_NEAR(Power(*near), 90.0, 1e-9);
}

TEST(LiquidPlan, TheSmallestFNumberTouchesBothEnds) {
  PlanRequest request = Lens(1.0, 200.0, 40.0, 48.0);
  request.limits = {Limit(LimitKind::Sharp, 3.0, 1.0, 8e-6)};
  const auto plan = Plan(request);
  ASSERT_TRUE(plan.has_value() && plan->feasible);
  // Midway in vergence, and there both ends are blurred by the limit: A = c/(Z_s 1 D).
  EXPECT_NEAR(Power(*plan), 42.0, 1e-9);
  EXPECT_NEAR(plan->aperture_diameter.value, 8e-6 / kSensor, 1e-15);
  EXPECT_NEAR(Blur(*plan, 3.0), 8e-6, 1e-15);
  EXPECT_NEAR(Blur(*plan, 1.0), 8e-6, 1e-15);
}

TEST(LiquidPlan, LimitsHoldAndRefusalsAreRight) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  int feasible = 0, infeasible = 0;
  for (int i = 0; i < 2000; ++i) {
    PlanRequest request = Lens(1.4, 16.0, 39.0, 46.0);
    const double near = 0.5 + 4.0 * part(random), far = near * part(random);
    const double behind = far * part(random);
    request.limits = {Limit(LimitKind::Sharp, near, far, 1e-6 + 30e-6 * part(random)),
                      Limit(LimitKind::Blurred, behind, behind * part(random), 1e-6 + 60e-6 * part(random))};
    const auto plan = Plan(request);
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    // A grid over aperture and power as the independent verdict; points near an edge prove nothing.
    bool found = false, nearly = false;
    for (int a = 0; a <= 60; ++a) {
      const double n = 1.4 * std::pow(16.0 / 1.4, a / 60.0);
      for (int p = 0; p <= 140; ++p) {
        const double power = 39.0 + 7.0 * p / 140.0;
        const auto blur = [&](double u) { return kSensor / n * std::abs(kSensor * (power - u) - 1.0); };
        const auto& sharp = request.limits[0];
        const auto& floor = request.limits[1];
        const double worst = std::max(blur(near), blur(far)) / sharp.limit.value;
        const double u1 = floor.depths[0].one_end.vergence().value, u2 = floor.depths[0].other_end.vergence().value;
        const double plane = power - 1.0 / kSensor;
        const bool between = plane < std::max(u1, u2) && plane > std::min(u1, u2);
        const double least = between ? 0.0 : std::min(blur(u1), blur(u2)) / floor.limit.value;
        found = found || (worst <= 1.0 && least >= 1.0);
        nearly = nearly || (worst <= 1.5 && least >= 0.7);
      }
    }
    if (found) {
      EXPECT_TRUE(plan->feasible) << "run " << i;
    } else if (!nearly) {
      EXPECT_FALSE(plan->feasible) << "run " << i;
    }
    if (!plan->feasible) {
      ++infeasible;
      EXPECT_FALSE(plan->conflict.empty());
      continue;
    }
    ++feasible;
    constexpr double kRounding = 1.0 + 1e-9;
    EXPECT_LE(Blur(*plan, near), request.limits[0].limit.value * kRounding);
    EXPECT_LE(Blur(*plan, far), request.limits[0].limit.value * kRounding);
    EXPECT_GE(Blur(*plan, behind) * kRounding, request.limits[1].limit.value);
    EXPECT_LE(Power(*plan), 46.0 * kRounding);
    EXPECT_GE(Power(*plan) * kRounding, 39.0);
  }
  EXPECT_GT(feasible, 200);
  EXPECT_GT(infeasible, 200);
}

TEST(LiquidPlan, AToleranceOfPowerTightens) {
  PlanRequest request = Lens(1.0, 200.0, 40.0, 48.0);
  request.limits = {Limit(LimitKind::Sharp, 3.0, 1.0, 8e-6)};
  request.sensor_tolerance = kSensor * kSensor * 0.1;  // 0.1 D
  const auto plan = Plan(request);
  ASSERT_TRUE(plan.has_value() && plan->feasible);
  EXPECT_NEAR(plan->aperture_diameter.value, 8e-6 / (kSensor * 1.1), 1e-15);
}

TEST(LiquidPlan, GoesToPositionsThatExist) {
  PlanRequest request = Lens(2.8, 2.8, 40.0, 48.0);
  request.limits = {Limit(LimitKind::Sharp, 2.1, 1.9, 40e-6)};
  LensPositions lens{.focal_length = Metres{kSensor}, .liquid = true, .focus = {}, .iris = {}};
  for (int i = 0; i <= 80; ++i) {
    const Metres extension = ExtensionOfLiquid(Metres{kSensor}, Metres{kSensor * kSensor * 0.1 * i});
    lens.focus.push_back({Metres{kSensor} - extension, extension, Metres{kSensor}, Dioptres{0.1 * i}, {}});
  }
  lens.iris.push_back({FNumber{2.8}, FNumber{2.8}, FNumber{2.8}});
  request.extensions = {0.0, lens.focus.back().extension.value};
  const auto plan = PlanOnPositions(request, lens, FocusBlocks(lens.focus));
  ASSERT_TRUE(plan.has_value() && plan->plan.feasible);
  EXPECT_EQ(plan->focus, 20u);
  EXPECT_NEAR(plan->plan.focal_plane.value, 2.0, 1e-12);
}

TEST(LiquidPlan, ExtensionsConvertBothWays) {
  for (const double e : {-0.001, 0.0, 1e-4, 2e-3}) {
    const Metres x = LiquidExtension(Metres{kSensor}, Metres{e});
    EXPECT_NEAR(x.value, kSensor * kSensor * (1.0 / (kSensor - e) - 1.0 / kSensor), 1e-15);
    EXPECT_NEAR(ExtensionOfLiquid(Metres{kSensor}, x).value, e, 1e-15);
  }
}

TEST(LiquidPlan, SaysWhatItCannot) {
  PlanRequest request = Lens(2.8, 2.8, 40.0, 48.0);
  request.wavelength = 550e-9;
  const auto plan = Plan(request);
  ASSERT_FALSE(plan.has_value());
  EXPECT_EQ(plan.error().code, Code::Unsupported);
}

}  // namespace
}  // namespace lensd::optics
