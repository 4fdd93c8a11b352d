// Conflicts of limits whose distances start at the sensor, against thin-lens blur at thousands of extensions, each with
// the depths that it makes of the distances.
#include "optics/moving_limits.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "optics/planner.h"
#include "test_level.h"

namespace lensd::optics {
namespace {

class MovingSource {
 public:
  explicit MovingSource(std::uint64_t seed) : random_(seed) {}

  MovingRequest Next() {
    MovingRequest asked;
    PlanRequest& request = asked.request;
    const double f = Log(0.004, 0.6), closest = std::max(0.05, f * (Chance(0.3) ? Uniform(1.6, 3.0) : Log(3.0, 60.0)));
    const double longest = f * f / (std::max(closest, 1.5 * f) - f);
    request.focal_length = f;
    request.extensions = {Chance(0.3) ? -0.03 * longest : 0.0, longest};
    request.f_numbers.low = Log(1.0, 8.0);
    request.f_numbers.high = request.f_numbers.low.value * Log(1.2, 12.0);
    asked.behind = Metres{Chance(0.5) ? 0.0 : Uniform(0.0, 0.3) * f};
    const double stands = Uniform(0.02, 0.98) * longest, n = request.f_numbers.low.value;
    const double plane = stands / (f * (f + stands)), width = Log(1e-5, 1e-3) * n / (f * std::sqrt(f));
    const auto depth = [&](double vergence) {
      const double u = std::clamp(vergence, 1e-3, 1.0 / (1.05 * f));
      return Chance(0.4) ? PlanDepth::Vergence(u) : PlanDepth::Distance(1.0 / u + f + stands + asked.behind.value);
    };
    for (int k = 0; k < 2 || (k < 4 && Chance(0.5)); ++k) {
      BlurLimit limit{.name = "limit" + std::to_string(k), .kind = LimitKind::Sharp, .depths = {}, .limit = {}};
      const bool sharp = k == 0 || Chance(0.5);
      limit.kind = sharp ? LimitKind::Sharp : LimitKind::Blurred;
      if (!sharp) limit.side = static_cast<Side>(static_cast<int>(Uniform(0.0, 3.0)));
      const double u = plane + width * Uniform(-6.0, 6.0) * (sharp ? 0.3 : 1.0);
      limit.depths = {{depth(u), depth(u + width * Uniform(-1.5, 1.5))}};
      limit.limit = width * f * f / n * Log(0.15, sharp ? 3.0 : 8.0);
      request.limits.push_back(limit);
    }
    return asked;
  }

 private:
  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  double Log(double low, double high) { return std::exp(Uniform(std::log(low), std::log(high))); }
  bool Chance(double chance) { return Uniform(0.0, 1.0) < chance; }
  std::mt19937_64 random_;
};

/// The f-numbers at which a limit holds with the sensor at `e`, by half-triangles: from first to second.
std::pair<double, double> FNumbersOf(const MovingRequest& asked, const BlurLimit& limit, double e) {
  const double f = asked.request.focal_length.value, z = f + e, plane = 1.0 / f - 1.0 / z;
  const auto vergence = [&](const PlanDepth& depth) {
    return depth.is_vergence ? depth.number.value : 1.0 / (depth.number.value - z - asked.behind.value);
  };
  const auto [far, near] = std::minmax({vergence(limit.depths[0].one_end), vergence(limit.depths[0].other_end)});
  if (!(far > 0.0)) return {1.0, 0.0};
  const double c = limit.limit.value;
  if (limit.kind == LimitKind::Sharp) {
    return {f * z * std::max(std::abs(plane - near), std::abs(plane - far)) / c, HUGE_VAL};
  }
  double off = 0.0;
  if (limit.side != Side::Front) off = std::max(off, plane - near);
  if (limit.side != Side::Behind) off = std::max(off, far - plane);
  return {0.0, f * z * off / c};
}

/// Whether all of `names` hold somewhere on a grid of extensions, by more than rounding.
bool HoldsOnGrid(const MovingRequest& asked, const std::vector<std::string>& names) {
  constexpr int kPlaces = 3000;
  const auto& [low, high] = asked.request.extensions;
  for (int i = 0; i <= kPlaces; ++i) {
    const double e = low.value + (high.value - low.value) * i / kPlaces;
    double first = asked.request.f_numbers.low.value, last = asked.request.f_numbers.high.value;
    for (const BlurLimit& limit : asked.request.limits) {
      if (std::ranges::find(names, limit.name) == names.end()) continue;
      const auto [from, to] = FNumbersOf(asked, limit, e);
      first = std::max(first, from);
      last = std::min(last, to);
    }
    if (first * (1.0 + 1e-6) < last) return true;
  }
  return false;
}

std::vector<std::string> NamesOf(const PlanRequest& request) {
  std::vector<std::string> names;
  for (const BlurLimit& limit : request.limits) names.push_back(limit.name);
  return names;
}

bool MovesAlone(const BlurLimit& limit) {
  PlanRequest request;
  request.limits = {limit};
  return Moves(request);
}

TEST(MovingLimits, AnExtensionThatHoldsIsFoundWhereThereIsOne) {
  MovingSource source(1);
  const long problems = testing::ByLevel(1000, 3000, 100000);
  long found = 0;
  for (long n = 0; n < problems; ++n) {
    const MovingRequest asked = source.Next();
    const auto e = ExtensionThatHolds(asked);
    ASSERT_TRUE(e.has_value() || !HoldsOnGrid(asked, NamesOf(asked.request))) << "problem " << n;
    if (!e) continue;
    ++found;
    ASSERT_GE(e->value, asked.request.extensions.low.value);
    ASSERT_LE(e->value, asked.request.extensions.high.value);
    double first = asked.request.f_numbers.low.value, last = asked.request.f_numbers.high.value;
    for (const BlurLimit& limit : asked.request.limits) {
      const auto [from, to] = FNumbersOf(asked, limit, e->value);
      first = std::max(first, from);
      last = std::min(last, to);
    }
    ASSERT_LE(first, last * (1.0 + 1e-6)) << "problem " << n;
  }
  EXPECT_GT(found, problems / 10);
  EXPECT_LT(found, problems - problems / 10);
}

TEST(MovingLimits, AConflictHoldsNowhere) {
  MovingSource source(2);
  const long problems = testing::ByLevel(1000, 3000, 100000);
  long conflicts = 0, fewer = 0, wrong_guesses = 0;
  for (long n = 0; n < problems; ++n) {
    const MovingRequest asked = source.Next();
    if (ExtensionThatHolds(asked)) continue;
    ++conflicts;
    // The worst guess: any one limit.
    for (const BlurLimit& limit : asked.request.limits) {
      const std::vector<std::string> guess{limit.name, "fNumber", "extension"};
      const std::vector<std::string> conflict = MovingConflict(asked, guess);
      if (conflict == guess && !MovesAlone(limit)) continue;  // what does not move is not looked into
      wrong_guesses += conflict != guess;
      ASSERT_FALSE(HoldsOnGrid(asked, conflict)) << "problem " << n << ": " << ::testing::PrintToString(conflict);
      fewer += std::ranges::count_if(conflict, [](const std::string& name) { return name.starts_with("limit"); }) <
               static_cast<long>(asked.request.limits.size());
    }
  }
  std::printf("%ld infeasible, %ld guesses were wrong, %ld conflicts name fewer limits than were asked\n", conflicts,
              wrong_guesses, fewer);
  EXPECT_GT(wrong_guesses, conflicts);
  EXPECT_GT(fewer, conflicts / 2);
}

TEST(MovingLimits, AFixedFocusAndStopsCount) {
  MovingRequest asked;
  PlanRequest& request = asked.request;
  request.focal_length = 0.05;
  request.extensions = {0.0, 0.008};
  request.stops = {2.0, 8.0};
  request.limits.push_back({.name = "a",
                            .kind = LimitKind::Sharp,
                            .depths = {{PlanDepth::Distance(1.0), PlanDepth::Distance(1.1)}},
                            .limit = 40e-6});
  // From the lens 0.95 to 1.05 m: half of f^2 (U_near - U_far)/c is f/3.15. At f/8 the sharp one allows planes up to
  // 1.083 D, and the other, 0.691 D at its nearest, needs 1.171 D.
  request.limits.push_back({.name = "b",
                            .kind = LimitKind::Blurred,
                            .depths = {{PlanDepth::Distance(1.5), PlanDepth::Distance(2.0)}},
                            .limit = 150e-6});
  EXPECT_FALSE(ExtensionThatHolds(asked).has_value());
  EXPECT_EQ(MovingConflict(asked, {"a"}), (std::vector<std::string>{"a", "b", "fNumber"}));
  request.stops = {2.0, 4.0};
  EXPECT_TRUE(ExtensionThatHolds(asked).has_value());
  request.focus = PlanDepth::Vergence(0.7);
  EXPECT_FALSE(ExtensionThatHolds(asked).has_value());
  EXPECT_EQ(MovingConflict(asked, {"a", "b"}), (std::vector<std::string>{"a", "b", "focus"}));
}

}  // namespace
}  // namespace lensd::optics
