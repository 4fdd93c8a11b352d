// Focus stacks against blur from the textbook's formulas and scans over the f-number, and what is refused.
#include "optics/stack.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "exact.h"
#include "stack_judge.h"
#include "test_level.h"

namespace lensd::optics {
namespace {

using testing::BruteForce;
using testing::Draw;
using testing::Exact;
using testing::ExpectCovered;
using ::testing::HasSubstr;
using testing::Interval;
using testing::TotalBlurAt;

PlanRequest MixedRequest() {
  PlanRequest request;
  request.focal_length = 0.05;
  request.extensions = {0.0, 0.01};
  request.sensor_tolerance = 2e-6;
  request.f_number_tolerance = 0.02;
  request.f_numbers = {1.4, 22.0};
  const auto between = [](double a, double b) { return DepthInterval{PlanDepth::Distance(a), PlanDepth::Distance(b)}; };
  request.limits = {{"face", LimitKind::Sharp, {between(0.9, 1.1)}, 10e-6},
                    {"room", LimitKind::Sharp, {between(0.7, 3.0)}, 60e-6},
                    {"hill", LimitKind::Sharp, {between(5.0, INFINITY)}, 30e-6}};
  return request;
}

TEST(StackTest, OverlappingLimitsAreAllMet) {
  PlanRequest request = MixedRequest();
  for (const double n : {1.4, 2.0, 4.0, 8.0, 16.0}) {
    request.stops = {n};
    const auto answer = PlanStack(request);
    ASSERT_TRUE(answer);
    ASSERT_TRUE(answer->feasible) << answer->reason;
    ExpectCovered(request, *answer);
  }
}

TEST(StackTest, DiffractionAndPupilAreCounted) {
  PlanRequest request = MixedRequest();
  request.wavelength = 550e-9;
  request.pupil_factor = 0.7;
  const auto answer = PlanStack(request);
  ASSERT_TRUE(answer);
  ASSERT_TRUE(answer->feasible) << answer->reason;
  ExpectCovered(request, *answer);
  EXPECT_LT(answer->shots.front().f_number.value, 10e-6 / (2.44 * 550e-9));
}

/// Extensions at which a subject's total blur holds with tolerances, by bisection from its best extension.
Interval SharpWithDiffraction(const PlanRequest& r, double u, double limit, double n) {
  const double f = r.focal_length.value;
  const auto holds = [&](double e) {
    const StackShot shot{FNumber{n}, Metres{e}, {}, {}, 0};
    return TotalBlurAt(r, shot, 0, 1, u) <= limit;
  };
  const double best = f * f * u / (1 - f * u);
  const double delta = r.sensor_tolerance.value;
  if (!holds(best)) return {1, -1};
  const auto edge = [&](double outside) {
    double inside = best;
    for (int i = 0; i < 70; ++i) (holds((inside + outside) / 2) ? inside : outside) = (inside + outside) / 2;
    return inside;
  };
  return {Exact(edge(best - 0.9 * f)) + Exact(delta), Exact(edge(best + 0.9 * f)) - Exact(delta)};
}

TEST(StackTest, WithDiffractionNoScannedFNumberDoesBetter) {
  Draw draw(55);
  for (long i = 0; i < lensd::testing::ByLevel(3, 10, 1000); ++i) {
    PlanRequest request;
    request.focal_length = 0.05;
    request.extensions = {0.0, 0.02};
    request.sensor_tolerance = draw.Coin() ? 0.0 : 3e-6;
    request.f_numbers = {1.4, 32.0};
    request.wavelength = 550e-9;
    std::vector<std::pair<double, double>> subjects;
    for (int s = 0; s < 5; ++s) {
      subjects.emplace_back(draw.Uniform(0, 3), draw.Log(10e-6, 40e-6));
      const PlanDepth depth = PlanDepth::Vergence(subjects.back().first);
      request.limits.push_back({"s" + std::to_string(s), LimitKind::Sharp, {{depth, depth}}, subjects.back().second});
    }
    const auto shots_at = [&](double n) {
      std::vector<Interval> sharp;
      for (const auto& [u, limit] : subjects) sharp.push_back(SharpWithDiffraction(request, u, limit, n));
      return BruteForce(sharp, 0, Exact(0.02));
    };
    const auto answer = PlanStack(request);
    ASSERT_TRUE(answer);
    ASSERT_TRUE(answer->feasible) << answer->reason;
    const double n = answer->shots.front().f_number.value;
    ASSERT_EQ(shots_at(n * (1 + 1e-9)), answer->shots.size()) << n;
    for (double scanned = 1.4; scanned < 32.0; scanned *= 1.01) {
      const std::size_t shots = shots_at(scanned);
      ASSERT_TRUE(shots == 0 || shots >= answer->shots.size()) << scanned;
      if (scanned < n * (1 - 1e-9)) {
        ASSERT_NE(shots, answer->shots.size()) << scanned << ' ' << n;
      }
    }
  }
}

TEST(StackTest, OneShotIsEnoughWhereOneSettingMeetsEverything) {
  PlanRequest request = MixedRequest();
  request.limits.resize(1);
  request.limits[0].limit = 30e-6;
  const auto answer = PlanStack(request);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->shots.size(), 1U);
  EXPECT_NEAR(answer->shots[0].near.value, 1 / 0.9, 1e-9);
  EXPECT_NEAR(answer->shots[0].far.value, 1 / 1.1, 1e-9);
  EXPECT_NEAR(answer->shots[0].magnification, answer->shots[0].extension.value / 0.05, 1e-15);
}

TEST(StackTest, ApertureDiametersAreFNumbersTurnedRound) {
  PlanRequest request = MixedRequest();
  const auto by_number = PlanStack(request);
  request.apertures_are_diameters = true;
  request.f_numbers = {0.05 / 22.0, 0.05 / 1.4};
  const auto by_diameter = PlanStack(request);
  ASSERT_TRUE(by_number && by_diameter);
  ASSERT_EQ(by_number->shots.size(), by_diameter->shots.size());
  EXPECT_NEAR(by_number->shots[0].f_number.value / by_diameter->shots[0].f_number.value, 1.0, 1e-12);
}

TEST(StackTest, ImpossibleIsAnAnswerWithItsReason) {
  const auto reason = [](const std::function<void(PlanRequest&)>& change) {
    PlanRequest request = MixedRequest();
    change(request);
    const auto answer = PlanStack(request);
    if (!answer) return "error: " + answer.error().message;
    EXPECT_FALSE(answer->feasible);
    EXPECT_TRUE(answer->shots.empty());
    return answer->reason;
  };
  EXPECT_THAT(reason([](PlanRequest& r) { r.sensor_tolerance = 1e-3; }), HasSubstr("sensor tolerance of 1000 um"));
  EXPECT_THAT(reason([](PlanRequest& r) { r.extensions.high = 1e-3; }), HasSubstr("longer extension"));
  EXPECT_THAT(reason([](PlanRequest& r) { r.extensions.low = 9e-3; }), HasSubstr("shortest extension"));
  EXPECT_THAT(reason([](PlanRequest& r) {
                r.wavelength = 550e-9;
                r.f_numbers = {16.0, 22.0};
              }),
              HasSubstr("diffraction alone"));
  EXPECT_THAT(reason([](PlanRequest& r) {
                r.sensor_tolerance = 0;
                for (BlurLimit& limit : r.limits) limit.limit = 1e-12;
              }),
              HasSubstr("10000 shots"));
}

TEST(StackTest, SenselessRequestsAreErrors) {
  const auto code = [](const std::function<void(PlanRequest&)>& change) {
    PlanRequest request = MixedRequest();
    change(request);
    const auto answer = PlanStack(request);
    return answer ? Code::Internal : answer.error().code;
  };
  EXPECT_EQ(code([](PlanRequest& r) { r.limits[0].kind = LimitKind::Blurred; }), Code::InvalidArgument);
  EXPECT_EQ(code([](PlanRequest& r) { r.limits.clear(); }), Code::InvalidArgument);
  EXPECT_EQ(code([](PlanRequest& r) { r.limits[0].limit = 0.0; }), Code::InvalidArgument);
  EXPECT_EQ(code([](PlanRequest& r) { r.focus = PlanDepth::Distance(1.0); }), Code::InvalidArgument);
  EXPECT_EQ(code([](PlanRequest& r) { r.f_numbers = {8.0, 4.0}; }), Code::InvalidArgument);
  EXPECT_EQ(code([](PlanRequest& r) { r.stops = {-1.0}; }), Code::InvalidArgument);
  EXPECT_EQ(code([](PlanRequest& r) { r.extensions = {0.01, 0.0}; }), Code::InvalidArgument);
  EXPECT_EQ(code([](PlanRequest& r) { r.f_number_tolerance = 1.0; }), Code::InvalidArgument);
  EXPECT_EQ(code([](PlanRequest& r) { r.sensor_tolerance = NAN; }), Code::InvalidArgument);
  EXPECT_EQ(code([](PlanRequest& r) { r.focal_length = 0.0; }), Code::InvalidArgument);
  EXPECT_EQ(code([](PlanRequest& r) { r.limits[0].depths[0].one_end = PlanDepth::Distance(0.05); }), Code::OutOfRange);
}

}  // namespace
}  // namespace lensd::optics
