// The planner's answers one can check by hand, and what it refuses.
#include "optics/planner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <algorithm>

#include <cmath>
#include <limits>
#include <random>

#include "optics/conjugates.h"
#include "optics/lens_positions.h"

namespace lensd::optics {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

DepthInterval Distances(double near, double far) {
  return {PlanDepth::Distance(near), PlanDepth::Distance(far)};
}
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The lens of the demonstration: 50 mm, f/1.4 to f/16, pixels of 50.25 um.
PlanRequest Demo() {
  PlanRequest request;
  request.focal_length = 0.05;
  request.f_numbers = {1.4, 16.0};
  request.extensions = {0.0, 0.002};
  request.limits = {{"near", LimitKind::Sharp, {Distances(2.1, 2.5)}, 50.25e-6, Side::Either},
                    {"far", LimitKind::Blurred, {Distances(4.3, kInfinity)}, 201e-6, Side::Behind}};
  return request;
}

TEST(Planner, MeetsSharpAndBlurredLimitsAtTheVertexOfTheDioptreMidpoint) {
  const Result<PlanAnswer> answer = Plan(Demo());
  ASSERT_TRUE(answer.has_value());
  ASSERT_TRUE(answer->feasible);
  const double u_near = 1 / 2.1, u_far = 1 / 2.5, f = 0.05, c = 50.25e-6;
  const double e_near = f * f * u_near / (1 - f * u_near), e_far = f * f * u_far / (1 - f * u_far);
  const double n = (e_near - e_far) / (c / (1 - f * u_near) + c / (1 - f * u_far));
  EXPECT_NEAR(answer->f_number.value, std::max(n, 1.4), 1e-12);
  EXPECT_LE(answer->worst_ratio, 1.0);
  ASSERT_EQ(answer->limits.size(), 2u);
  EXPECT_EQ(answer->limits[1].limit.value, 201e-6);
  EXPECT_GE(answer->limits[1].worst.value, 201e-6);
  EXPECT_NEAR(answer->limits[1].at.value, 1 / 4.3, 1e-15);
  EXPECT_EQ(answer->limits[1].far.value, 0.0);
}

TEST(Planner, NamesWhatConflicts) {
  PlanRequest request = Demo();
  request.limits[0].depths = {Distances(2.1, 4.3)};
  const Result<PlanAnswer> answer = Plan(request);
  ASSERT_TRUE(answer.has_value());
  ASSERT_FALSE(answer->feasible);
  EXPECT_THAT(answer->conflict, ElementsAre("near", "far"));
  ASSERT_TRUE(answer->relax.has_value());
  EXPECT_NEAR(*answer->relax, 2.0, 1e-9);  // 4.3 m is in both: 50.25 r >= 201/r
}

TEST(Planner, WithoutLimitsTakesTheWidestStopAndTheMiddle) {
  PlanRequest request = Demo();
  request.limits.clear();
  const Result<PlanAnswer> answer = Plan(request);
  ASSERT_TRUE(answer.has_value() && answer->feasible);
  EXPECT_EQ(answer->f_number.value, 1.4);
  EXPECT_EQ(answer->extension.value, 0.001);
  EXPECT_EQ(answer->worst_ratio, 0.0);
}

TEST(Planner, FocusOutsideTheExtensionConflictsWithIt) {
  PlanRequest request = Demo();
  request.limits.clear();
  request.focus = PlanDepth::Distance(0.5);
  EXPECT_THAT(Plan(request)->conflict, UnorderedElementsAre("focus", "extension"));
  request.focus = PlanDepth::Vergence(-0.1);  // past infinity, where this lens cannot go: e >= 0 is no name
  EXPECT_THAT(Plan(request)->conflict, ElementsAre("focus"));
  EXPECT_FALSE(Plan(request)->relax.has_value());
}

TEST(Planner, DecidesTiesOnDecimals) {
  // 0.1 m at f = 0.05: e = 0.05. A blur of exactly 0.05/2 at infinity with N = 2 meets a limit of 0.025 and no less.
  PlanRequest request;
  request.focal_length = 0.05;
  request.f_numbers = {2.0, 2.0};
  request.extensions = {0.0, 0.1};
  request.focus = PlanDepth::Distance(0.1);
  request.limits = {{"far", LimitKind::Sharp, {Distances(kInfinity, kInfinity)}, 0.025, Side::Either}};
  EXPECT_TRUE(Plan(request)->feasible);
  request.limits[0].limit = Number(0.025, "0.0249999999999999999999999");
  EXPECT_FALSE(Plan(request)->feasible);
}

TEST(Planner, DepthTakesTheLargestFNumberOrTheOneBeforeDiffraction) {
  PlanRequest request = Demo();
  request.limits.clear();
  request.objective = Objective::Depth;
  request.focus = PlanDepth::Distance(2.0);
  request.depth_limit = 10e-6;
  request.f_numbers = {1.4, 64.0};
  EXPECT_EQ(Plan(request)->f_number.value, 64.0);
  request.wavelength = 550e-9;
  const Result<PlanAnswer> answer = Plan(request);
  ASSERT_TRUE(answer->feasible && answer->depth_of_field);
  EXPECT_NEAR(answer->f_number.value, 10e-6 * 0.05 / (std::sqrt(2.0) * 2.44 * 550e-9 * answer->sensor_distance.value),
              1e-9);
  const double n = answer->f_number.value;
  const auto width = [&](double at) {
    PlanRequest fixed = request;
    fixed.f_numbers = {at, at};
    const PlanAnswer plan = *Plan(fixed);
    return plan.depth_of_field->one_end.vergence().value - plan.depth_of_field->other_end.vergence().value;
  };
  EXPECT_GT(width(n), width(n * 1.01));
  EXPECT_GT(width(n), width(n / 1.01));
}

TEST(Planner, PlanesAreAddedExactlyAndCutAtInfinity) {
  const Result<DepthInterval> plane = DepthsOfPlane(0.8, 0.3, -0.1);
  ASSERT_TRUE(plane.has_value());
  EXPECT_EQ(plane->one_end.vergence().value, 1.2);
  EXPECT_EQ(plane->other_end.vergence().value, 0.4);
  EXPECT_EQ(DepthsOfPlane(0.1, 0.3, 0.0)->other_end.vergence().value, 0.0);
  EXPECT_EQ(DepthsOfPlane(-1.0, 0.3, 0.0).error().code, Code::OutOfRange);
}

/// A lens of 50 mm: steps of its extension range, and the stops of an iris in sixths.
LensPositions Hardware(int steps) {
  LensPositions lens{.focal_length = Metres{0.05}, .focus = {}, .iris = {}};
  for (int i = 0; i <= steps; ++i) {
    const Metres e{0.002 * i / steps};
    lens.focus.push_back({lens.focal_length, e, lens.focal_length + e, FocalPlane(lens.focal_length, e), {}});
  }
  for (int i = 6; i <= 48; ++i) {
    const FNumber n{std::pow(2.0, i / 12.0)};
    lens.iris.push_back({n, n, n});
  }
  return lens;
}

TEST(PlannerPositions, TheBestReachablePointHoldsAndNoneIsBetter) {
  const LensPositions hardware = Hardware(400);
  PlanRequest request = Demo();
  request.sensor_tolerance = 1e-6;
  for (const Objective objective : {Objective::Light, Objective::Sharp}) {
    request.objective = objective;
    const Result<PositionPlan> answer = PlanOnPositions(request, hardware, FocusBlocks(hardware.focus));
    ASSERT_TRUE(answer.has_value());
    ASSERT_TRUE(answer->continuous_feasible && answer->plan.feasible);
    EXPECT_EQ(answer->plan.extension.value, hardware.focus[answer->focus].extension.value);
    EXPECT_EQ(answer->plan.f_number.value, hardware.iris[answer->iris].f_number.value);
    EXPECT_LE(answer->plan.worst_ratio, 1.0);
    PlanRequest there = request;
    for (const IrisPosition& iris : hardware.iris) {  // every pair of positions, one by one
      for (const FocusPosition& focus : hardware.focus) {
        const double n = iris.f_number.value, e = focus.extension.value;
        there.f_numbers = {n, n};
        there.extensions = {e, e};
        const PlanAnswer point = *Plan(there);
        if (!point.feasible) continue;
        if (objective == Objective::Light) {
          EXPECT_GE(n, answer->plan.f_number.value);
        }
        if (objective == Objective::Sharp || n == answer->plan.f_number.value) {
          EXPECT_GE(point.worst_ratio, answer->plan.worst_ratio * (1 - 1e-12));
        }
      }
    }
  }
}

TEST(PlannerPositions, SaysSoWhenStepsAreCoarserThanTheDepthOfField) {
  PlanRequest request = Demo();
  request.f_numbers = {1.5, 2.1};
  const LensPositions hardware = Hardware(3);
  const Result<PositionPlan> answer = PlanOnPositions(request, hardware, FocusBlocks(hardware.focus));
  ASSERT_TRUE(answer.has_value());
  EXPECT_TRUE(answer->continuous_feasible);
  EXPECT_FALSE(answer->plan.feasible);
  EXPECT_GT(answer->plan.worst_ratio, 1.0);
  EXPECT_TRUE(answer->plan.conflict.empty());
  EXPECT_EQ(answer->plan.limits.size(), 2u);
}

TEST(PlannerPositions, AFixedFocusTakesTheNearestStep) {
  PlanRequest request = Demo();
  request.limits.clear();
  request.focus = PlanDepth::Distance(2.55);  // e = 0.001
  const LensPositions hardware = Hardware(9);
  const Result<PositionPlan> answer = PlanOnPositions(request, hardware, FocusBlocks(hardware.focus));
  ASSERT_TRUE(answer.has_value() && answer->plan.feasible);
  EXPECT_NEAR(answer->plan.extension.value, 0.001, 0.0002 * 0.75);
}

struct Refused {
  const char* why;
  void (*spoil)(PlanRequest&);
  const char* says;
};

class PlannerRefuses : public ::testing::TestWithParam<Refused> {};

TEST_P(PlannerRefuses, WithOneClearLine) {
  PlanRequest request = Demo();
  GetParam().spoil(request);
  const Result<PlanAnswer> answer = Plan(request);
  ASSERT_FALSE(answer.has_value());
  EXPECT_THAT(answer.error().message, HasSubstr(GetParam().says));
}

const double kNan = std::numeric_limits<double>::quiet_NaN();
const Refused kRefused[] = {
    {"focal length", [](PlanRequest& r) { r.focal_length = -0.05; }, "focal length"},
    {"nan", [](PlanRequest& r) { r.focal_length = kNan; }, "focal length"},
    {"limit 0", [](PlanRequest& r) { r.limits[0].limit = 0.0; }, "near: the blur limit must be"},
    {"limit nan", [](PlanRequest& r) { r.limits[1].limit = kNan; }, "far: the blur limit must be"},
    {"at f", [](PlanRequest& r) { r.limits[0].depths = {Distances(0.05, 1.0)}; },
     "near: nothing at or inside the focal length"},
    {"inside f", [](PlanRequest& r) { r.limits[0].depths[0].one_end = PlanDepth::Vergence(20.5); }, "focal length"},
    {"depth nan", [](PlanRequest& r) { r.limits[0].depths = {Distances(kNan, 1.0)}; }, "not a number"},
    {"distance 0", [](PlanRequest& r) { r.limits[1].depths = {Distances(0.0, 1.0)}; }, "above zero"},
    {"no depths", [](PlanRequest& r) { r.limits[0].depths.clear(); }, "no depths"},
    {"past infinity", [](PlanRequest& r) { r.limits[0].depths[0].one_end = PlanDepth::Vergence(-1.0); },
     "past infinity"},
    {"twice", [](PlanRequest& r) { r.limits[1].name = "near"; }, "taken"},
    {"reserved", [](PlanRequest& r) { r.limits[1].name = "focus"; }, "taken"},
    {"N empty", [](PlanRequest& r) { r.f_numbers = {4.0, 2.0}; }, "empty"},
    {"N 0", [](PlanRequest& r) { r.f_numbers = {0.0, 2.0}; }, "f-numbers must be"},
    {"stop", [](PlanRequest& r) { r.stops = {2.0, -1.0}; }, "f-numbers must be"},
    {"e empty", [](PlanRequest& r) { r.extensions = {0.1, 0.0}; }, "empty"},
    {"e inf", [](PlanRequest& r) { r.extensions = {0.0, kInfinity}; }, "finite"},
    {"e behind", [](PlanRequest& r) { r.extensions = {-0.05, 0.0}; }, "behind the lens"},
    {"delta", [](PlanRequest& r) { r.sensor_tolerance = -1e-6; }, "sensor tolerance"},
    {"epsilon", [](PlanRequest& r) { r.f_number_tolerance = 1.0; }, "f-number tolerance"},
    {"lambda", [](PlanRequest& r) { r.wavelength = 0.0; }, "wavelength"},
    {"pupil", [](PlanRequest& r) { r.pupil_factor = 0.0; }, "pupil"},
    {"focus at f", [](PlanRequest& r) { r.focus = PlanDepth::Distance(0.05); }, "closest focus is 1300 mm"},
    {"focus inside", [](PlanRequest& r) { r.focus = PlanDepth::Vergence(25.0); }, "closest focus is 1300 mm"},
    {"depth alone", [](PlanRequest& r) { r.objective = Objective::Depth; }, "needs a focus"},
};
INSTANTIATE_TEST_SUITE_P(All, PlannerRefuses, ::testing::ValuesIn(kRefused));

}  // namespace
}  // namespace lensd::optics
