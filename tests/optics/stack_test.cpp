// Focus stacks against exact arithmetic, brute force over subsets, and scans: no count may be beaten.
#include "optics/stack.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <functional>

#include "exact.h"
#include "test_level.h"

namespace lensd::optics {
namespace {

using testing::Draw;
using testing::Exact;
using ::testing::HasSubstr;

/// A finite decimal as text; `number` must be one.
std::string DecimalText(Exact number) {
  std::string sign = number < 0 ? "-" : "";
  number = abs(number);
  int places = 0;
  for (; denominator(number) != 1; number *= 10) {
    if (++places > 60) ADD_FAILURE() << "not a finite decimal";
  }
  return sign + numerator(number).str() + "e-" + std::to_string(places);
}

Number Decimal(const Exact& number) {
  return Number(static_cast<double>(number), DecimalText(number));
}

/// A subject at one depth, in exact numbers.
struct Subject {
  Exact u;
  Exact limit;
};

struct Problem {
  Exact f, delta, epsilon, low, high;
  std::vector<Subject> subjects;
};

using Interval = std::pair<Exact, Exact>;

/// Extensions at which a subject is sharp, straight from |s| <= c with the tolerances.
Interval SharpAt(const Problem& p, const Subject& subject, const Exact& n) {
  const Exact w = 1 - p.f * subject.u;
  const Exact reach = subject.limit * (1 - p.epsilon) * n;
  return {(p.f * p.f * subject.u - reach) / w + p.delta, (p.f * p.f * subject.u + reach) / w - p.delta};
}

/// Fewest shots by trying all subsets of the places where a shot may stand; 0: impossible.
std::size_t BruteForce(const std::vector<Interval>& sharp, const Exact& low, const Exact& high) {
  std::vector<Exact> places;
  for (const Interval& interval : sharp) {
    const Exact place = std::min(interval.second, high);
    if (place < interval.first || place < low) return 0;
    places.push_back(place);
  }
  std::size_t fewest = places.size();
  for (unsigned subset = 1; subset < (1U << places.size()); ++subset) {
    const auto shots = static_cast<std::size_t>(std::popcount(subset));
    if (shots >= fewest) continue;
    bool all = true;
    for (const Interval& interval : sharp) {
      bool covered = false;
      for (std::size_t i = 0; i < places.size(); ++i) {
        covered = covered || ((subset >> i & 1U) != 0 && interval.first <= places[i] && places[i] <= interval.second);
      }
      all = all && covered;
    }
    if (all) fewest = shots;
  }
  return fewest;
}

std::size_t BruteForce(const Problem& p, const Exact& n) {
  std::vector<Interval> sharp;
  for (const Subject& subject : p.subjects) sharp.push_back(SharpAt(p, subject, n));
  return BruteForce(sharp, p.low, p.high);
}

/// Subjects whose distances and conjugate extensions are both short decimals with f = 100 mm, and a sensor tolerance
/// that makes the sharp intervals of two of them touch exactly.
Problem TiedProblem(Draw& draw) {
  const std::vector<int> micrometres{625, 1000, 1250, 1600, 2000, 2500, 3200, 4000, 5000, 6250, 8000};
  Problem p{Exact(1, 10), 0, Exact(static_cast<int>(draw.Uniform(0, 2)) * 2, 100), 0, Exact(9, 1000), {}};
  const int count = 2 + static_cast<int>(draw.Uniform(0, 5));
  std::vector<Exact> conjugate;
  for (int i = 0; i < count; ++i) {
    const int a = micrometres[static_cast<std::size_t>(draw.Uniform(0, 10.999))];
    conjugate.push_back(Exact(a, 1000000));
    p.subjects.push_back({1 / (p.f + p.f * p.f / conjugate.back()), Exact(40 * (1 + (i % 3)), 1000000)});
  }
  const Exact n = 4;
  const auto reach = [&](std::size_t i) {
    return Exact(p.subjects[i].limit * n * (1 - p.epsilon) * (1 + conjugate[i] / p.f));
  };
  const Exact slack = (reach(0) + reach(1) - abs(Exact(conjugate[0] - conjugate[1]))) / 2;
  if (slack > 0 && slack < reach(0) && slack < reach(1)) p.delta = slack;
  return p;
}

PlanRequest RequestFor(const Problem& p) {
  PlanRequest request;
  request.focal_length = Decimal(p.f);
  request.extensions = {Decimal(p.low), Decimal(p.high)};
  request.sensor_tolerance = Decimal(p.delta);
  request.f_number_tolerance = Decimal(p.epsilon);
  for (const Subject& subject : p.subjects) {
    const PlanDepth depth = PlanDepth::Distance(Decimal(1 / subject.u));
    request.limits.push_back(
        {"s" + std::to_string(request.limits.size()), LimitKind::Sharp, {{depth, depth}}, Decimal(subject.limit)});
  }
  return request;
}

TEST(StackTest, CountsAreExactWhereIntervalsTouch) {
  Draw draw(51);
  int several = 0;
  for (long i = 0; i < lensd::testing::ByLevel(300, 2000, 100000); ++i) {
    const Problem p = TiedProblem(draw);
    PlanRequest request = RequestFor(p);
    request.stops = {4.0};
    const auto answer = PlanStack(request);
    ASSERT_TRUE(answer) << answer.error().message;
    ASSERT_EQ(answer->shots.size(), BruteForce(p, 4)) << i;
    ASSERT_EQ(answer->feasible, !answer->shots.empty());
    several += answer->shots.size() > 1;
  }
  EXPECT_GT(several, 100);
}

TEST(StackTest, OverARangeTheCountIsFewestAndTheFNumberSmallest) {
  Draw draw(52);
  for (long i = 0; i < lensd::testing::ByLevel(100, 500, 20000); ++i) {
    const Problem p = TiedProblem(draw);
    PlanRequest request = RequestFor(p);
    request.f_numbers = {2.0, 8.0};
    const auto answer = PlanStack(request);
    ASSERT_TRUE(answer);
    const std::size_t fewest = BruteForce(p, 8);
    ASSERT_EQ(answer->shots.size(), fewest) << i;
    if (fewest == 0) continue;
    const double n = answer->shots.front().f_number.value;
    ASSERT_EQ(BruteForce(p, Exact(n) * Exact(1 + 1e-12)), fewest);
    if (n > 2.0) {
      ASSERT_NE(BruteForce(p, Exact(n) * Exact(1 - 1e-12)), fewest) << i << ' ' << n;
    }
    for (const StackShot& shot : answer->shots) ASSERT_EQ(shot.f_number.value, n);
  }
}

TEST(StackTest, AmongStopsTheSmallestOfTheFewest) {
  Draw draw(53);
  for (int i = 0; i < 200; ++i) {
    const Problem p = TiedProblem(draw);
    PlanRequest request = RequestFor(p);
    request.stops = {8.0, 2.0, 5.6, 2.8, 4.0};
    const auto answer = PlanStack(request);
    ASSERT_TRUE(answer);
    std::size_t fewest = 0;
    double smallest = 0;
    for (const auto& [stop, exact] :
         {std::pair{2.0, Exact(2)}, {2.8, Exact(28, 10)}, {4.0, Exact(4)}, {5.6, Exact(56, 10)}, {8.0, Exact(8)}}) {
      const std::size_t shots = BruteForce(p, exact);
      if (shots == 0 || (fewest != 0 && shots >= fewest)) continue;
      fewest = shots;
      smallest = stop;
    }
    ASSERT_EQ(answer->shots.size(), fewest);
    if (fewest > 0) {
      ASSERT_EQ(answer->shots.front().f_number.value, smallest);
    }
  }
}

/// Total blur at a shot off by `shift`, from the textbook formulas.
double TotalBlurAt(const PlanRequest& r, const StackShot& shot, double shift, double scale, double u) {
  const double f = r.focal_length.value;
  const double e = shot.extension.value + shift;
  const double p = r.pupil_factor.value;
  const double n = shot.f_number.value * scale;
  const double geometric = (e - f * (f + e) * u) / n / (1 + f * u * (1 / p - 1));
  const double disk = r.wavelength ? 2.44 * r.wavelength->value * n * (1 + e / f / p) : 0.0;
  return std::hypot(geometric, disk);
}

/// The worst blur at a depth with all tolerances.
double WorstBlurAt(const PlanRequest& request, const StackShot& shot, double u) {
  double worst = 0.0;
  for (const double side : {-1.0, 1.0}) {
    for (const double scale : {-1.0, 1.0}) {
      worst = std::max(worst, TotalBlurAt(request, shot, side * request.sensor_tolerance.value,
                                          1 + scale * request.f_number_tolerance.value, u));
    }
  }
  return worst;
}

/// Every depth of every limit is sharp in some shot whose stretch reaches it, and inside its stretch each shot meets
/// every limit (where a tighter limit begins, stretches may end in its first point).
void ExpectCovered(const PlanRequest& request, const StackAnswer& answer) {
  for (const BlurLimit& limit : request.limits) {
    const double one = limit.depths[0].one_end.vergence().value;
    const double other = limit.depths[0].other_end.vergence().value;
    for (int step = 0; step <= 500; ++step) {
      const double u = one + (other - one) * step / 500;
      bool covered = false;
      for (const StackShot& shot : answer.shots) {
        if (u < shot.far.value - 1e-9 || u > shot.near.value + 1e-9) continue;
        const bool sharp = WorstBlurAt(request, shot, u) <= limit.limit.value * (1 + 1e-6);
        const bool inside = u > shot.far.value + 1e-9 && u < shot.near.value - 1e-9;
        ASSERT_TRUE(sharp || !inside) << limit.name << " at " << u;
        covered = covered || sharp;
      }
      ASSERT_TRUE(covered) << limit.name << " at " << u;
    }
  }
}

/// Shots for one continuous interval at one f-number in exact arithmetic: from each shot to the nearest depth it
/// covers.
std::size_t ExactSteps(const Problem& p, Exact u, const Exact& near, const Exact& limit, const Exact& n) {
  std::size_t shots = 0;
  const Exact reach = limit * (1 - p.epsilon) * n;
  while (shots == 0 || u < near) {
    const Exact e = (p.f * p.f * u + reach) / (1 - p.f * u) - p.delta;
    u = (e - p.delta + reach) / (p.f * (p.f + e - p.delta));
    ++shots;
  }
  return shots;
}

TEST(StackTest, AContinuousRangeTakesAsManyShotsAsExactArithmeticSays) {
  Draw draw(54);
  for (int i = 0; i < 300; ++i) {
    const Problem p{
        Exact(5, 100), Exact(static_cast<int>(draw.Uniform(0, 5)), 1000000), Exact(1, 100), 0, Exact(1, 10), {}};
    const Exact far(static_cast<int>(draw.Uniform(0, 200)), 100);
    const Exact near = far + Exact(static_cast<int>(draw.Uniform(1, 300)), 100);
    PlanRequest request;
    request.focal_length = Decimal(p.f);
    request.extensions = {0.0, Decimal(p.high)};
    request.sensor_tolerance = Decimal(p.delta);
    request.f_number_tolerance = 0.01;
    request.stops = {4.0};
    request.limits = {
        {"all", LimitKind::Sharp, {{PlanDepth::Vergence(Decimal(near)), PlanDepth::Vergence(Decimal(far))}}, 20e-6}};
    const auto answer = PlanStack(request);
    ASSERT_TRUE(answer);
    ASSERT_TRUE(answer->feasible) << answer->reason;
    ASSERT_EQ(answer->shots.size(), ExactSteps(p, far, near, Exact(20, 1000000), 4));
    ExpectCovered(request, *answer);
    for (std::size_t s = 1; s < answer->shots.size(); ++s) {
      ASSERT_LE(answer->shots[s].far.value, answer->shots[s - 1].near.value + 1e-12);
      ASSERT_GT(answer->shots[s].extension, answer->shots[s - 1].extension);
    }
  }
}

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
