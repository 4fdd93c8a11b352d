// Counts of focus stacks against exact arithmetic and brute force over subsets: no count may be beaten.
#include <gtest/gtest.h>

#include "exact.h"
#include "optics/stack.h"
#include "stack_judge.h"
#include "test_level.h"

namespace lensd::optics {
namespace {

using testing::BruteForce;
using testing::Draw;
using testing::Exact;
using testing::ExpectCovered;
using testing::Interval;

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

/// Extensions at which a subject is sharp, straight from |s| <= c with the tolerances.
Interval SharpAt(const Problem& p, const Subject& subject, const Exact& n) {
  const Exact w = 1 - p.f * subject.u;
  const Exact reach = subject.limit * (1 - p.epsilon) * n;
  return {(p.f * p.f * subject.u - reach) / w + p.delta, (p.f * p.f * subject.u + reach) / w - p.delta};
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

}  // namespace
}  // namespace lensd::optics
