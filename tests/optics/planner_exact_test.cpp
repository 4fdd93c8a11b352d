// The planner against exact rational arithmetic on adversarial requests.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <sstream>

#include "planner_adversary.h"
#include "planner_reference.h"
#include "test_level.h"

namespace lensd::optics::reference {
namespace {

double ToDouble(const Rational& rational) {
  return rational.convert_to<double>();
}

/// How far beyond its limit a returned plan may be: 1e-12, or what two ulp of e make of it.
double Allowed(const PlanRequest& request, const BlurLimit& limit, double n, double e) {
  const double ulp = std::nextafter(std::abs(e), 1.0) - std::abs(e);
  double widest = 0.0;
  for (const DepthInterval& interval : limit.depths) {
    for (const PlanDepth* end : {&interval.one_end, &interval.other_end}) {
      widest = std::max(widest, std::abs(1.0 - request.focal_length.value * end->vergence().value));
    }
  }
  return std::max(1e-12, 2.0 * ulp * widest / (limit.limit.value * n));
}

/// Whether `ratio` is the least feasible one within 1e-9, at one f-number or over all.
::testing::AssertionResult IsLeastRatio(const PlanRequest& request, double ratio, std::optional<Rational> n = {}) {
  constexpr double kPart = 1e-9;
  constexpr double kNothing = 1e-11;  // what rounding e leaves of a perfect focus
  Question question;
  question.n = std::move(n);
  question.ratio = FromDouble(ratio * (1 + kPart) + kNothing);
  if (!Feasible(request, question)) return ::testing::AssertionFailure() << "infeasible at ratio " << ratio;
  if (ratio <= 2 * kNothing) return ::testing::AssertionSuccess();
  question.ratio = FromDouble(ratio * (1 - kPart) - kNothing);
  if (Feasible(request, question)) return ::testing::AssertionFailure() << "feasible below ratio " << ratio;
  return ::testing::AssertionSuccess();
}

void CheckFeasible(const PlanRequest& request, const PlanAnswer& answer, const NRange& range) {
  const double n = answer.f_number.value, e = answer.extension.value;
  ASSERT_TRUE(std::isfinite(n) && std::isfinite(e) && std::isfinite(answer.worst_ratio));
  EXPECT_GE(e, request.extensions.low.value);
  EXPECT_LE(e, request.extensions.high.value);
  if (request.objective != Objective::Sharp) {
    const double best = ToDouble(request.objective == Objective::Light ? range.smallest : range.largest);
    EXPECT_NEAR(n, best, 1e-12 * best);
  }
  for (const BlurLimit& limit : request.limits) {
    EXPECT_LE(ToDouble(Excess(request, limit, n, e)), Allowed(request, limit, n, e)) << limit.name;
  }
  if (request.objective == Objective::Sharp) {
    EXPECT_TRUE(IsLeastRatio(request, answer.worst_ratio));
  }
  const bool at_an_end = n == ToDouble(range.smallest) && FromDouble(n) == range.smallest;
  if (request.objective == Objective::Light && at_an_end) {
    EXPECT_TRUE(IsLeastRatio(request, answer.worst_ratio, FromDouble(n)));
  }
}

void CheckConflict(const PlanRequest& request, const std::vector<std::string>& conflict) {
  Question question;
  question.names = std::set<std::string>(conflict.begin(), conflict.end());
  EXPECT_FALSE(Feasible(request, question)) << "the conflict is none";
  for (const std::string& name : conflict) {
    Question without = question;
    without.names->erase(name);
    EXPECT_TRUE(Feasible(request, without)) << name << " is not needed";
  }
  bool open = false;
  for (const BlurLimit& limit : request.limits) {
    open = open || (limit.kind == LimitKind::Blurred && limit.side == Side::Either);
  }
  if (!open) {
    EXPECT_LE(conflict.size(), request.stops.empty() ? 3u : 5u);
  }
}

void CheckRelax(const PlanRequest& request, const std::optional<double>& relax) {
  if (relax) {
    EXPECT_GE(*relax, 1.0 - 1e-12);
    EXPECT_TRUE(IsLeastRatio(request, *relax));
    return;
  }
  Question question;
  question.ratio = Rational(Integer(1) << 200);
  EXPECT_FALSE(Feasible(request, question)) << "some ratio makes it feasible";
}

TEST(PlannerExact, AgreesWithRationalArithmetic) {
  const long count = testing::ByLevel(1000, 10000, 1000000);
  int feasible = 0, infeasible = 0;
  for (long seed = 0; seed < count; ++seed) {
    const PlanRequest request = AdversarialRequest(static_cast<std::uint64_t>(seed));
    SCOPED_TRACE(::testing::Message() << "seed " << seed << "\n" << Show(request));
    const Result<PlanAnswer> answer = Plan(request);
    ASSERT_TRUE(answer.has_value()) << answer.error().message;
    const std::optional<NRange> range = Feasible(request);
    ASSERT_EQ(answer->feasible, range.has_value());
    if (range) {
      CheckFeasible(request, *answer, *range);
      ++feasible;
    } else {
      CheckConflict(request, answer->conflict);
      CheckRelax(request, answer->relax);
      ++infeasible;
    }
    if (HasFailure()) break;
  }
  if (!HasFailure()) {
    EXPECT_GT(feasible, count / 5);
    EXPECT_GT(infeasible, count / 5);
  }
}

// Limits far below a pixel at wide openings, where a double's own rounding of the extension is a part of them that
// counts: some touch the setting that the problem is drawn around, some leave it a little room, some much.
TEST(PlannerExact, TightLimitsCountOnlyWhereTheyAreNear) {
  std::mt19937_64 random(5);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const long count = testing::ByLevel(300, 3000, 100000);
  constexpr std::array<double, 8> kRoom{0.0, 1e-15, 1e-13, 1e-11, 1e-8, 1e-6, 1e-4, 0.3};
  long feasible = 0;
  for (long at = 0; at < count && !HasFailure(); ++at) {
    PlanRequest request;
    const double f = draw(0.02, 0.1), n = draw(1.4, 4.0), e = f * draw(0.01, 0.1);
    request.focal_length = f;
    request.f_numbers = {1.4, 22.0};
    request.extensions = {0.0, 0.15 * f};
    for (int i = 0; i < 6; ++i) {
      const double blur = std::exp(draw(std::log(i < 3 ? 1e-7 : 1e-5), std::log(i < 3 ? 5e-6 : 5e-5)));
      const double u = (e + (random() % 2 == 0 ? blur : -blur) * n) / (f * (f + e));
      const double met = std::abs(e - f * (f + e) * u) / n;
      request.limits.push_back({.name = "limit " + std::to_string(i),
                                .kind = LimitKind::Sharp,
                                .depths = {{PlanDepth::Vergence(u), PlanDepth::Vergence(u)}},
                                .limit = met * (1.0 + kRoom.at(random() % kRoom.size()))});
    }
    SCOPED_TRACE(::testing::Message() << "problem " << at);
    const Result<PlanAnswer> answer = Plan(request);
    ASSERT_TRUE(answer.has_value()) << answer.error().message;
    const std::optional<NRange> range = Feasible(request);
    ASSERT_EQ(answer->feasible, range.has_value());
    if (!range) continue;
    CheckFeasible(request, *answer, *range);
    ++feasible;
  }
  EXPECT_GT(feasible, count / 2);
}

}  // namespace
}  // namespace lensd::optics::reference
