// The planner with diffraction against eighty-digit arithmetic: no answer breaks a limit, none could be better, and a
// conflict is one.
#include "planner_diffraction.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "planner_adversary.h"
#include "planner_reference.h"
#include "test_level.h"

namespace lensd::optics::reference {
namespace {

/// Whether the width is concave with limits times `ratio`, so that ternary search is sound.
bool IsConvex(const PlanRequest& request, double ratio) {
  return std::all_of(request.limits.begin(), request.limits.end(), [&](const BlurLimit& limit) {
    return ratio * limit.limit.value * request.f_numbers.high.value < 0.35 * request.focal_length.value;
  });
}

/// An adversarial request with the wavelength drawn so that diffraction matters, and no depth inside the focal length.
PlanRequest Request(std::uint64_t seed) {
  PlanRequest request = AdversarialRequest(seed);
  std::mt19937_64 random(seed);
  request.wavelength = std::array{Number(550e-9), Number(400e-9), Number(10e-6)}[random() % 3];
  request.diffraction = random() % 2 == 0 ? DiffractionConvention::Airy : DiffractionConvention::Mtf50;
  request.objective = random() % 3 == 0 ? Objective::Sharp : Objective::Light;
  const double f = request.focal_length.value;
  const double most_n = 16.0;
  std::erase_if(request.limits, [&](const BlurLimit& limit) {
    // not convex
    bool inside = limit.limit.value * std::max(request.f_numbers.high.value, most_n) > 0.3 * f;
    for (const DepthInterval& interval : limit.depths) {
      for (const PlanDepth* end : {&interval.one_end, &interval.other_end}) {
        const double u = end->vergence().value;
        inside = inside || !(u * f < 0.999999) || !(1.0 + u * f * (1.0 / request.pupil_factor.value - 1.0) > 0.0);
      }
    }
    return inside;
  });
  return request;
}

void CheckLimits(const PlanRequest& request, const Optics& o, const PlanAnswer& answer) {
  const Real n = answer.f_number.value, e = answer.extension.value;
  const double ulp = std::nextafter(std::abs(answer.extension.value), 1.0) - std::abs(answer.extension.value);
  for (const BlurLimit& limit : request.limits) {
    const Real size = ToReal(limit.limit);
    const Real allowed = std::max(1e-12, 2.0 * ulp / (limit.limit.value * answer.f_number.value));
    for (const DepthInterval& interval : limit.depths) {
      Real most = 0, behind = 1e9, front = 1e9;  // greatest blur; least on either side
      for (const PlanDepth* end : {&interval.one_end, &interval.other_end}) {
        for (const Real& at : {Real(e - o.delta), Real(e + o.delta)}) {
          const Real u = Vergence80(*end), s = o.Signed(u, n, at);
          for (const Real& part : {Real(-1), Real("-0.3"), Real("0.6"), Real(1)}) {  // of the f-number's tolerance
            most = std::max(most, o.Total(u, n * (1 + part * o.epsilon), at));
          }
          behind = std::min(behind, s);
          front = std::min(front, Real(-s));
        }
      }
      if (limit.kind == LimitKind::Sharp) {
        EXPECT_LE(most / size, 1 + allowed) << limit.name;
      } else {
        const Real least = limit.side == Side::Behind  ? behind
                           : limit.side == Side::Front ? front
                                                       : std::max(behind, front);
        EXPECT_GE(least / (1 + o.epsilon) / size, 1 - allowed) << limit.name;
      }
    }
  }
}

void CheckBest(const PlanRequest& request, const Optics& o, const PlanAnswer& answer) {
  const Names names = AllNames(request);
  if (request.objective == Objective::Sharp) {
    if (answer.worst_ratio > 1e-9 && IsConvex(request, 1.0)) {
      EXPECT_FALSE(*FeasibleExactly(request, names, Real(answer.worst_ratio) * (1 - Real(1e-9))));
    }
    return;
  }
  ForEachProgramme(request, o, names, [&](const LinearProgram& programme) {
    const Real smaller = Real(answer.f_number.value) * (1 - Real(1e-12));
    for (const Number& stop : request.stops) {
      if (ToReal(stop) < smaller) {
        EXPECT_FALSE(Leaves(LeftAt(programme, o, ToReal(stop), 1))) << "a smaller stop would do";
      }
    }
    if (!request.stops.empty() || answer.f_number.value <= request.f_numbers.low.value) return;
    const auto less = LeftAt(programme, o, smaller, 1);
    EXPECT_TRUE(!less || less->width() < 0) << "a smaller f-number would do";
  });
}

/// The conflict is infeasible, and feasible once any one of its names is dropped. Returns how many of these the
/// reference could decide.
long CheckConflict(const PlanRequest& request, const PlanAnswer& answer) {
  const Names conflict(answer.conflict.begin(), answer.conflict.end());
  long decided = 0;
  const auto expect = [&](const Names& names, bool feasible, const std::string& what) {
    const std::optional<bool> truth = FeasibleExactly(request, names);
    if (!truth) return;
    ++decided;
    EXPECT_EQ(*truth, feasible) << what << " of " << ::testing::PrintToString(names);
  };
  expect(conflict, false, "the conflict itself");
  for (const std::string& name : conflict) {
    Names rest = conflict;
    rest.erase(name);
    expect(rest, true, "without " + name);
  }
  return decided;
}

/// Limits so large next to diffraction that what they leave is not convex.
PlanRequest WideRequest(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto draw = [&](long low, long high) {
    return low + static_cast<long>(random() % static_cast<std::uint64_t>(high - low + 1));
  };
  const auto number = [](long mantissa, int exponent) {
    const std::string text = std::to_string(mantissa) + "e" + std::to_string(exponent);
    return Number(std::stod(text), text);
  };
  PlanRequest request;
  const long f_tenths = draw(20, 80);  // mm
  request.focal_length = number(f_tenths, -4);
  request.f_numbers = {number(draw(4, 30), -1), number(draw(160, 640), -1)};
  request.extensions = {0.0, number(f_tenths * draw(5, 40), -6)};
  request.sensor_tolerance = number(draw(0, 20), -6);
  request.f_number_tolerance = random() % 3 == 0 ? number(draw(1, 20), -2) : Number(0.0);
  request.pupil_factor = random() % 4 == 0 ? number(draw(6, 16), -1) : Number(1.0);
  request.wavelength = random() % 2 == 0 ? Number(10e-6) : Number(1e-6);
  request.objective = random() % 3 == 0 ? Objective::Sharp : Objective::Light;
  const long limits = draw(1, 3);
  for (long i = 0; i < limits; ++i) {
    const Number limit = number(f_tenths * draw(1, 25), -6);
    const auto depth = [&] { return PlanDepth::Vergence(number(draw(0, 6000), -2)); };
    request.limits.push_back({"sharp" + std::to_string(i), LimitKind::Sharp, {{depth(), depth()}}, limit});
  }
  if (random() % 2 == 0) {
    request.limits.push_back({"far",
                              LimitKind::Blurred,
                              {{PlanDepth::Vergence(0.0), PlanDepth::Vergence(number(draw(0, 300), -2))}},
                              number(f_tenths * draw(1, 20), -6),
                              Side::Behind});
  }
  return request;
}

/// Whether some f-number of a fine grid, below `below`, leaves something with limits times `ratio`.
bool GridLeaves(const PlanRequest& request, const Optics& o, double below, const Real& ratio) {
  const double low = request.f_numbers.low.value, high = std::min(below, request.f_numbers.high.value);
  constexpr int kPoints = 300;
  bool leaves = false;
  ForEachProgramme(request, o, AllNames(request), [&](const LinearProgram& programme) {
    for (int i = 0; i <= kPoints && low <= high && !leaves; ++i) {
      leaves = Leaves(LeftAt(programme, o, Real(low * std::pow(high / low, i / double{kPoints})), ratio));
    }
  });
  return leaves;
}

/// Sharp limits times `ratio`, blurred ones divided by it.
PlanRequest Relaxed(PlanRequest request, double ratio) {
  for (BlurLimit& limit : request.limits) {
    const double was = limit.limit.value;
    limit.limit = Number(limit.kind == LimitKind::Sharp ? was * ratio : was / ratio);
  }
  return request;
}

TEST(PlannerDiffraction, OutsideTheConvexRangeNothingIsMissed) {
  const long count = testing::ByLevel(40, 40, 1000);
  long feasible = 0, infeasible = 0, scanned = 0, moved = 0, undecided = 0;
  for (long seed = 0; seed < count && !HasFailure(); ++seed) {
    const PlanRequest request = WideRequest(static_cast<std::uint64_t>(seed));
    SCOPED_TRACE(::testing::Message() << "seed " << seed << "\n" << Show(request));
    const Result<PlanAnswer> answer = Plan(request);
    ASSERT_TRUE(answer.has_value()) << answer.error().message;
    const Optics o(request);
    scanned += answer->note.empty() ? 0 : 1;
    const Real hair("1e-9");
    constexpr double kHair = 1e-12;
    if (answer->feasible) {
      ++feasible;
      CheckLimits(request, o, *answer);
      if (request.objective == Objective::Light) {
        moved += answer->f_number.value > request.f_numbers.low.value ? 1 : 0;
        EXPECT_FALSE(GridLeaves(request, o, answer->f_number.value * (1 - kHair), 1)) << "a smaller f-number would do";
      } else if (answer->worst_ratio > kHair) {
        EXPECT_FALSE(GridLeaves(request, o, 1e9, Real(answer->worst_ratio) * (1 - hair))) << "a smaller ratio would do";
      }
    } else {
      ++infeasible;
      EXPECT_FALSE(GridLeaves(request, o, 1e9, 1));
      if (!answer->relax) continue;
      EXPECT_FALSE(GridLeaves(request, o, 1e9, Real(*answer->relax) * (1 - hair))) << "less would do";
      const Result<PlanAnswer> relaxed = Plan(Relaxed(request, *answer->relax * (1 + 1e-6)));
      ASSERT_TRUE(relaxed.has_value()) << relaxed.error().message;
      const bool gave_up = relaxed->note.find("undecided") != std::string::npos;
      EXPECT_TRUE(relaxed->feasible || gave_up) << "relax does not do";
      undecided += gave_up ? 1 : 0;
    }
  }
  if (HasFailure()) return;
  EXPECT_GT(feasible, count / 10);
  EXPECT_GT(infeasible, count / 10);
  EXPECT_GT(scanned, count / 3);
  EXPECT_GT(moved, count / 20);
  EXPECT_LE(undecided, count / 100);
}

/// A plan's tolerance of the f-number means every f-number within it, neither less nor more: 11.33 um holds at f/2.98
/// times 0.95 to 1.05, where 11.33 um times 0.95 would not leave room for diffraction.
TEST(PlannerDiffraction, EveryFNumberWithinTheToleranceHoldsAndNoMoreIsAsked) {
  PlanRequest request;
  request.focal_length = 0.025;
  request.f_numbers = {1.4, 22.0};
  request.extensions = {0.0, 0.008};
  request.f_number_tolerance = 0.05;
  request.wavelength = 550e-9;
  request.limits = {
      {"sharp", LimitKind::Sharp, {{PlanDepth::Vergence(1.2517), PlanDepth::Vergence(1.1153)}}, 11.33e-6}};
  const Result<PlanAnswer> answer = Plan(request);
  ASSERT_TRUE(answer->feasible);
  const Optics o(request);
  CheckLimits(request, o, *answer);
  CheckBest(request, o, *answer);
  EXPECT_LE(answer->worst_ratio, 1.0);
  EXPECT_GT(answer->worst_ratio, 1.0 - 1e-9);
}

TEST(PlannerDiffraction, AgreesWithEightyDigits) {
  const long count = testing::ByLevel(200, 1000, 100000);
  const char* const from = std::getenv("LENSD_TEST_FIRST_SEED");  // to go on with a run of hours
  const long first = from == nullptr ? 0 : std::strtol(from, nullptr, 10);
  long feasible = 0, infeasible = 0, diffracted = 0, conflicts = 0;
  for (long seed = first; seed < count; ++seed) {
    constexpr long kTellEvery = 10000;
    if (seed % kTellEvery == 0 && seed > first) std::printf("%ld of %ld\n", seed, count), std::fflush(stdout);
    const PlanRequest request = Request(static_cast<std::uint64_t>(seed));
    SCOPED_TRACE(::testing::Message() << "seed " << seed << " wavelength " << request.wavelength->value << "\n"
                                      << Show(request));
    const Result<PlanAnswer> answer = Plan(request);
    ASSERT_TRUE(answer.has_value()) << answer.error().message;
    const Optics o(request);
    const Names names = AllNames(request);
    ASSERT_EQ(answer->feasible, *FeasibleExactly(request, names));
    PlanRequest geometric = request;
    geometric.wavelength.reset();
    if (answer->feasible) {
      ++feasible;
      CheckLimits(request, o, *answer);
      CheckBest(request, o, *answer);
    } else {
      ++infeasible;
      diffracted += Plan(geometric)->feasible ? 1 : 0;
      if (answer->relax && IsConvex(request, *answer->relax)) {
        EXPECT_TRUE(*FeasibleExactly(request, names, Real(*answer->relax) * (1 + Real(1e-9))));
        EXPECT_FALSE(*FeasibleExactly(request, names, Real(*answer->relax) * (1 - Real(1e-9))));
      }
      conflicts += CheckConflict(request, *answer);
    }
    if (HasFailure()) break;
  }
  if (!HasFailure()) {
    const long tried = count - first;
    EXPECT_GT(feasible, tried / 8);
    EXPECT_GT(infeasible, tried / 8);
    EXPECT_GT(diffracted, tried / 100);  // infeasible by diffraction alone
    EXPECT_GT(conflicts, infeasible);
  }
}

}  // namespace
}  // namespace lensd::optics::reference
