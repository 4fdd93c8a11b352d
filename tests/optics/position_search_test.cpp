// The search among blocks of positions against a scan of all of them, on random lenses and requests: the same pair and
// the same ratio to the last bit. What a block may ask against what its positions ask.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "optics/conjugates.h"
#include "optics/positions/focus_queue.h"
#include "position_scan.h"
#include "test_level.h"

namespace lensd::optics {
namespace {

struct Problem {
  PlanRequest request;
  LensPositions lens;
  DistanceOrigin origin;
};

class ProblemSource {
 public:
  explicit ProblemSource(std::uint64_t seed) : random_(seed) {}

  Problem Next() {
    Problem problem;
    Focus(problem.lens);
    Iris(problem.lens);
    problem.origin.at_sensor = Chance(0.3);
    if (Chance(0.5)) problem.origin.behind = Metres{Uniform(-0.01, 0.03)};
    Ask(problem);
    return problem;
  }
  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  int Whole(int low, int high) { return std::uniform_int_distribution(low, high)(random_); }
  bool Chance(double chance) { return Uniform(0.0, 1.0) < chance; }
  std::mt19937_64& random() { return random_; }

 private:
  double Log(double low, double high) { return std::exp(Uniform(std::log(low), std::log(high))); }

  void Focus(LensPositions& lens) {
    const double f = Log(0.004, 0.3);
    lens.focal_length = Metres{f};
    lens.liquid = Chance(0.15);
    if (Chance(0.3)) lens.focal_length_error = Log(1e-4, 3e-2);
    const int steps = Chance(0.1) ? 1 : Chance(0.2) ? Whole(2, 9) : static_cast<int>(Log(10.0, 1500.0));
    const double span = f * Uniform(0.005, 0.15), first = Chance(0.3) ? -0.05 * span : 0.0;
    const double breathing = Chance(0.4) ? Uniform(-0.1, 0.1) : 0.0;
    const int bounds = Whole(0, 4);
    const double usual = Log(1e-5, 0.1);
    for (int i = 0; i < steps; ++i) {
      const double along = steps > 1 ? static_cast<double>(i) / (steps - 1.0) : 0.5;
      const Metres e{first + along * span};
      FocusPosition position{Metres{f * (1.0 + breathing * along)}, e, {}, {}, {}};
      position.sensor_distance = position.focal_length + e;
      position.focal_plane = FocalPlane(position.focal_length, e);
      if (lens.liquid) {
        const Metres extension = ExtensionOfLiquid(Metres{f}, Metres{f * f * 12.0 * along});
        position = {Metres{f} - extension, extension, Metres{f}, Dioptres{12.0 * along}, {}};
      }
      position.bound = Dioptres{Bound(bounds, usual, along)};
      lens.focus.push_back(position);
    }
    if (Chance(0.05)) std::ranges::shuffle(lens.focus, random_);
    if (Chance(0.1)) lens.focus.push_back(lens.focus[static_cast<std::size_t>(Whole(0, steps - 1))]);
  }
  /// None, the same everywhere, growing, anything, or a few that are far larger.
  double Bound(int kind, double usual, double along) {
    switch (kind) {
      case 0:
        return 0.0;
      case 1:
        return usual;
      case 2:
        return usual * (1.0 + 3.0 * along);
      case 3:
        return usual * Uniform(0.0, 2.0);
      default:
        return usual * (Chance(0.05) ? 30.0 : 1.0);
    }
  }
  void Iris(LensPositions& lens) {
    const int count = Chance(0.15) ? 1 : Whole(2, 60);
    const double first = Log(1.0, 4.0), last = first * Log(1.5, 20.0);
    const double error = Chance(0.5) ? Log(1e-3, 0.1) : 0.0;
    for (int j = 0; j < count; ++j) {
      const double n = first * std::pow(last / first, count > 1 ? j / (count - 1.0) : 0.0);
      const double low = Chance(0.5) ? error : error * Uniform(0.0, 2.0);
      lens.iris.push_back({FNumber{n}, FNumber{n * (1.0 - low)}, FNumber{n * (1.0 + error)}});
    }
  }

  void Ask(Problem& problem) {
    PlanRequest& request = problem.request;
    const LensPositions& lens = problem.lens;
    request.liquid = lens.liquid;
    request.focal_length = lens.focal_length.value;
    request.objective = Chance(0.5) ? Objective::Light : Objective::Sharp;
    request.f_numbers = {lens.iris.front().f_number.value, lens.iris.back().f_number.value};
    if (Chance(0.2)) request.f_numbers.low = lens.iris[lens.iris.size() / 2].f_number.value;
    if (Chance(0.15)) {
      for (int i = Whole(1, 6); i > 0; --i) request.stops.emplace_back(Log(1.0, 32.0));
    }
    const auto [low, high] = std::ranges::minmax(lens.focus, {}, &FocusPosition::extension);
    request.extensions = {low.extension.value, high.extension.value};
    if (Chance(0.3)) {
      const double span = high.extension.value - low.extension.value;
      const double from = low.extension.value + span * Uniform(-0.1, 1.0);
      request.extensions = {from, from + span * (Chance(0.3) ? Log(1e-6, 1e-3) : Uniform(0.0, 0.7))};
    }
    if (Chance(0.5)) request.sensor_tolerance = lens.focal_length.value * Log(1e-6, 1e-3);
    if (Chance(0.5)) request.f_number_tolerance = Log(1e-3, 0.1);
    if (!lens.liquid && Chance(0.3)) request.wavelength = 550e-9;
    if (!lens.liquid && Chance(0.3)) request.pupil_factor = Log(0.3, 3.0);
    const int count = Chance(0.05) ? 0 : Chance(0.1) ? Whole(5, 16) : Whole(1, 4);
    for (int k = 0; k < count; ++k) request.limits.push_back(Limit(problem, k));
    if (Chance(0.15)) request.focus = Depth(problem);
  }
  /// Somewhere about where the lens focuses.
  PlanDepth Depth(const Problem& problem) {
    const auto& focus = problem.lens.focus;
    const FocusPosition& position = focus[static_cast<std::size_t>(Whole(0, static_cast<int>(focus.size()) - 1))];
    const double vergence = std::max(position.focal_plane.value * Uniform(0.8, 1.2), 0.0);
    if (Chance(0.05)) return Chance(0.5) ? PlanDepth::Vergence(0.0) : PlanDepth::Distance(kNever);
    if (Chance(0.5)) return PlanDepth::Vergence(vergence);
    return PlanDepth::Distance(std::max(1.0 / std::max(vergence, 1e-4) + problem.origin.At(position).value, 1e-3));
  }
  BlurLimit Limit(const Problem& problem, int k) {
    BlurLimit limit{.name = "limit" + std::to_string(k), .kind = LimitKind::Sharp, .depths = {}, .limit = {}};
    constexpr std::array kSides{Side::Either, Side::Behind, Side::Front};
    if (Chance(0.45)) {
      limit.kind = LimitKind::Blurred;
      limit.side = kSides[static_cast<std::size_t>(Whole(0, 2))];
    }
    const double f = problem.lens.focal_length.value;
    for (int i = Chance(0.7) ? 1 : Whole(2, 4); i > 0; --i) {
      const PlanDepth one = Depth(problem);
      limit.depths.push_back({one, Chance(0.5) ? one : Depth(problem)});
    }
    limit.limit = f * Log(1e-5, 2e-2);
    return limit;
  }

  static constexpr double kNever = std::numeric_limits<double>::infinity();
  std::mt19937_64 random_;
};

std::string Told(const Problem& problem) {
  std::string text = std::to_string(problem.lens.focus.size()) + " positions of focus, " +
                     std::to_string(problem.lens.iris.size()) + " of the iris";
  for (const BlurLimit& limit : problem.request.limits) {
    text += limit.kind == LimitKind::Sharp ? ", sharp"
                                           : ", blurred on side " + std::to_string(static_cast<int>(limit.side));
  }
  return text + (problem.lens.liquid ? ", liquid" : "") + (problem.origin.at_sensor ? ", from the sensor" : "");
}

TEST(PositionSearch, EqualsAScanOfAllPositions) {
  ProblemSource source(20261125);
  const long problems = testing::ByLevel(3000, 20000, 400000);
  long holding = 0, deep = 0, fixed = 0;
  for (long n = 0; n < problems; ++n) {
    const Problem problem = source.Next();
    SCOPED_TRACE("problem " + std::to_string(n) + ": " + Told(problem));
    const PositionBlur blur(problem.request, problem.lens, problem.origin);
    const FocusBlocks blocks(problem.lens.focus);
    const PositionChoice choice = ChoiceOf(problem.request, problem.lens, blocks, blur);
    const ScannedChoice scanned = ScanChoice(problem.request, problem.lens, blur);
    ASSERT_EQ(choice.focus.All(), scanned.focus);
    ASSERT_EQ(choice.focus_reachable, scanned.focus_reachable);
    const PositionPair found = BestPair(problem.request, problem.lens, blocks, blur, choice);
    const PositionPair best = ScanPairs(problem.request, problem.lens, blur, scanned.focus, choice.iris);
    ASSERT_EQ(found.focus, best.focus);
    ASSERT_EQ(found.iris, best.iris);
    ASSERT_EQ(found.ratio, best.ratio);
    holding += best.ratio <= kPositionHolds;
    deep += blocks.levels() > 1;
    fixed += problem.request.focus.has_value();
  }
  std::printf("%ld problems: %ld hold, %ld of several levels of blocks, %ld with a fixed focus\n", problems, holding,
              deep, fixed);
  EXPECT_GT(holding, problems / 10);
  EXPECT_LT(holding, problems - problems / 10);
  EXPECT_GT(deep, problems / 4);
  EXPECT_GT(fixed, problems / 20);
}

TEST(PositionSearch, NoPositionAsksLessThanItsBlock) {
  ProblemSource source(7);
  const long problems = testing::ByLevel(1000, 5000, 100000);
  long told = 0, open = 0;
  for (long n = 0; n < problems; ++n) {
    const Problem problem = source.Next();
    SCOPED_TRACE("problem " + std::to_string(n) + ": " + Told(problem));
    const PositionBlur blur(problem.request, problem.lens, problem.origin);
    const FocusBlocks blocks(problem.lens.focus);
    for (std::size_t level = 1; level <= blocks.levels(); ++level) {
      const std::size_t block =
          static_cast<std::size_t>(source.Whole(0, static_cast<int>(blocks.OfLevel(level).size()) - 1));
      const FocusRange& range = blocks.OfLevel(level)[block];
      ASSERT_TRUE(range.sound);
      const auto [first, end] = blocks.PositionsOf(level, block);
      for (std::size_t k = 0; k < blur.limits(); ++k) {
        const OpeningNeed least = blur.LeastNeed(k, range);
        const bool open_side = !least.sharp && problem.request.limits[k].side == Side::Either;
        open += open_side && std::isfinite(least.geometric);
        told += least.sharp ? least.geometric > 0.0 : std::isfinite(least.geometric);
        for (std::size_t i = first; i < end; ++i) {
          const OpeningNeed need = blur.Need(k, problem.lens.focus[i]);
          ASSERT_EQ(need.limit, least.limit);
          ASSERT_EQ(need.sharp, least.sharp);
          ASSERT_TRUE(least.sharp ? need.geometric >= least.geometric : need.geometric <= least.geometric)
              << need.geometric << " at position " << i << " against " << least.geometric;
          ASSERT_GE(need.diffraction, least.diffraction);
        }
      }
    }
  }
  EXPECT_GT(told, problems);      // bounds that leave something out
  EXPECT_GT(open, problems / 8);  // of an open side too
}

TEST(PositionSearch, WhatIsNotFiniteIsLookedInto) {
  ProblemSource source(11);
  for (int n = 0; n < 2000; ++n) {
    Problem problem = source.Next();
    problem.request.focus.reset();
    auto& focus = problem.lens.focus;
    FocusPosition& odd = focus[static_cast<std::size_t>(source.Whole(0, static_cast<int>(focus.size()) - 1))];
    odd.bound = Dioptres{std::numeric_limits<double>::infinity()};
    const PositionBlur blur(problem.request, problem.lens, problem.origin);
    const FocusBlocks blocks(focus);
    const PositionChoice choice = ChoiceOf(problem.request, problem.lens, blocks, blur);
    const PositionPair found = BestPair(problem.request, problem.lens, blocks, blur, choice);
    const PositionPair best = ScanPairs(problem.request, problem.lens, blur, choice.focus.All(), choice.iris);
    ASSERT_EQ(found.focus, best.focus) << "problem " << n << ": " << Told(problem);
    ASSERT_EQ(found.iris, best.iris);
  }
}

/// The depths of a limit, as the request for this position alone has them: each end from the lens centre.
struct CentredDepths {
  double near = -std::numeric_limits<double>::infinity(), far = std::numeric_limits<double>::infinity();
  bool all_around = true;  ///< the plane in focus lies in no interval, nor within a hair of one's ends
  double least_off = std::numeric_limits<double>::infinity();  ///< from the plane to an end

  CentredDepths(const BlurLimit& limit, double plane) {
    constexpr double kHair = 1e-9;
    for (const DepthInterval& interval : limit.depths) {
      const double one = interval.one_end.vergence().value, other = interval.other_end.vergence().value;
      near = std::max({near, one, other});
      far = std::min({far, one, other});
      all_around = all_around && (std::max(one, other) < plane - kHair || std::min(one, other) > plane + kHair);
      least_off = std::min({least_off, std::abs(one - plane), std::abs(other - plane)});
    }
  }
};

TEST(PositionSearch, EachEndOfAnIntervalStaysWhereItWasStated) {
  ProblemSource source(26);
  long mixed = 0, between = 0;
  for (int n = 0; n < 2000; ++n) {
    Problem problem = source.Next();
    problem.origin.at_sensor = true;
    problem.request.pupil_factor = 1.0;
    problem.request.sensor_tolerance = 0.0;
    const PositionBlur blur(problem.request, problem.lens, problem.origin);
    for (std::size_t i = 0; i < problem.lens.focus.size(); i += 1 + problem.lens.focus.size() / 5) {
      FocusPosition position = problem.lens.focus[i];
      position.bound = Dioptres{0.0};
      const PlanRequest there = blur.AtPosition(position, problem.lens.iris.front(), PositionBlur::Limits::Included);
      for (std::size_t k = 0; k < blur.limits(); ++k) {
        const CentredDepths expected(there.limits[k], position.focal_plane.value);
        if (expected.near > 1e6) continue;  // behind the lens
        const auto [near, far] = blur.Depths(k, position);
        ASSERT_NEAR(near, expected.near, 1e-9 * expected.near) << "problem " << n << ": " << Told(problem);
        ASSERT_NEAR(far, expected.far, 1e-9 * expected.far) << "problem " << n << ": " << Told(problem);
        const auto& depths = problem.request.limits[k].depths;
        mixed += std::ranges::any_of(depths, [](const DepthInterval& interval) {
          return interval.one_end.is_vergence != interval.other_end.is_vergence;
        });
        const OpeningNeed need = blur.Need(k, position);
        if (need.sharp || problem.request.limits[k].side != Side::Either || expected.least_off < 1e-9) continue;
        between += !expected.all_around;
        ASSERT_EQ(need.geometric > 0.0, expected.all_around) << "problem " << n << ": " << Told(problem);
      }
    }
  }
  EXPECT_GT(mixed, 500);
  EXPECT_GT(between, 200);
}

TEST(PositionSearch, AConflictIsInfeasibleByItself) {
  ProblemSource source(27);
  const long problems = testing::ByLevel(1000, 3000, 50000);
  long conflicts = 0, fewer = 0;
  for (long n = 0; n < problems; ++n) {
    const Problem problem = source.Next();
    SCOPED_TRACE("problem " + std::to_string(n) + ": " + Told(problem));
    const auto whole = PlanOnPositions(problem.request, problem.lens, FocusBlocks(problem.lens.focus), problem.origin);
    if (!whole || whole->plan.feasible || whole->continuous_feasible) continue;
    PlanRequest part = problem.request;
    const auto& names = whole->plan.conflict;
    std::erase_if(part.limits,
                  [&](const BlurLimit& limit) { return std::ranges::find(names, limit.name) == names.end(); });
    if (std::ranges::find(names, "focus") == names.end()) part.focus.reset();
    ++conflicts;
    fewer += part.limits.size() < problem.request.limits.size();
    const auto alone = PlanOnPositions(part, problem.lens, FocusBlocks(problem.lens.focus), problem.origin);
    ASSERT_TRUE(alone.has_value());
    ASSERT_FALSE(alone->plan.feasible) << ::testing::PrintToString(names);
  }
  std::printf("%ld conflicts, %ld of fewer limits than were asked\n", conflicts, fewer);
  EXPECT_GT(conflicts, problems / 10);
  EXPECT_GT(fewer, conflicts / 4);
}

TEST(FocusQueue, GivesEveryPositionInOrderAndLooksAtFew) {
  std::vector<FocusPosition> positions(3000);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double e = 1e-6 * static_cast<double>(i);
    positions[i] = {Metres{0.05}, Metres{e}, Metres{0.05 + e}, Dioptres{std::round(400.0 * e / 1e-3) / 400.0}, {}};
  }
  const FocusBlocks blocks(positions);
  IndexStretches among;
  among.Add(5, 1700);
  among.Add(1701, 2900);
  long looked_at = 0;
  constexpr double kWanted = 1.2;
  const auto of_block = [&](const FocusRange& range) {
    ++looked_at;
    return std::optional(
        FocusKey{std::max({0.0, range.focal_plane.low - kWanted, kWanted - range.focal_plane.high}), 0.0});
  };
  const auto of_position = [&](std::size_t i) {
    ++looked_at;
    return std::optional(FocusKey{std::abs(positions[i].focal_plane.value - kWanted), 0.0});
  };
  std::vector<std::size_t> order = among.All();
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return of_position(i)->first; });
  FocusQueue queue(blocks, among, of_block, of_position);
  looked_at = 0;
  ASSERT_EQ(queue.Next()->position, order.front());
  EXPECT_LT(looked_at, 100);
  for (std::size_t at = 1; at < order.size(); ++at) ASSERT_EQ(queue.Next()->position, order[at]);
  EXPECT_FALSE(queue.Next().has_value());
}

}  // namespace
}  // namespace lensd::optics
