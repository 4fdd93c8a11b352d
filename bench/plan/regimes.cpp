// Problems where planners fail: depths that hardly differ, limits that meet in one point or miss each other by a hair,
// and limits that differ by orders of magnitude. All are drawn around a setting, which a slack then opens or closes.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "bench/plan/problem.h"

namespace lensd::bench {
namespace {

using Random = std::mt19937_64;

double Between(Random& random, double low, double high) {
  return std::uniform_real_distribution(low, high)(random);
}
double BetweenLog(Random& random, double low, double high) {
  return std::exp(Between(random, std::log(low), std::log(high)));
}

/// Of a depth, at a setting without tolerance.
double SignedBlurAt(const Problem& problem, const Answer& at, double vergence) {
  return (at.e - problem.f * (problem.f + at.e) * vergence) / at.n;
}

/// A lens and a setting that its problem turns around.
struct Drawn {
  Problem problem;
  Answer setting;
};
Drawn DrawSetting(Random& random) {
  const double f = BetweenLog(random, 0.02, 0.1);
  return {.problem = {.f = f, .n_low = 1.4, .n_high = 22, .e_low = 0, .e_high = 0.15 * f, .delta = 0, .limits = {}},
          .setting = {BetweenLog(random, 2, 16), f * Between(random, 0.02, 0.08)}};
}

/// The vergence whose signed blur at the setting is `blur`.
double VergenceOf(const Drawn& drawn, double blur) {
  const auto& [problem, at] = drawn;
  return (at.e - blur * at.n) / (problem.f * (problem.f + at.e));
}

void AddSharp(Drawn& drawn, double blur, double limit) {
  const double u = std::max(0.0, VergenceOf(drawn, blur));
  drawn.problem.limits.push_back({.far = u, .near = u, .limit = limit});
}

/// Two subjects either side of focus, and a background that is to be blurred as much as the setting blurs it: the two
/// bound the f-number from below, the background from above, at the same place but for `slack` of its limit.
Problem Touching(Random& random, double slack) {
  Drawn drawn = DrawSetting(random);
  const double blur = BetweenLog(random, 5e-6, 50e-6);
  for (const double side : {-1.0, 1.0}) AddSharp(drawn, side * blur, 0.0);
  for (Limit& limit : drawn.problem.limits)
    limit.limit = std::abs(SignedBlurAt(drawn.problem, drawn.setting, limit.far));
  const double far = std::max(0.0, VergenceOf(drawn, Between(random, 2, 5) * blur));
  const double kept = SignedBlurAt(drawn.problem, drawn.setting, far);
  drawn.problem.limits.push_back({.far = far, .near = far, .limit = kept * (1 - slack), .kind = Kind::Behind});
  return drawn.problem;
}

Problem NearEqual(Random& random) {
  Drawn drawn = DrawSetting(random);
  const double blur = BetweenLog(random, 5e-6, 50e-6);
  const double u = std::max(1e-3, VergenceOf(drawn, 0.0));
  for (int i = 0; i < 4; ++i) {
    const double near = u * (1 + BetweenLog(random, 1e-15, 1e-6));
    drawn.problem.limits.push_back({.far = near, .near = near, .limit = blur * (1 + BetweenLog(random, 1e-15, 1e-9))});
  }
  AddSharp(drawn, -blur, blur);
  return drawn.problem;
}

Problem HugeRatios(Random& random) {
  Drawn drawn = DrawSetting(random);
  for (int i = 0; i < 6; ++i) {
    const double blur = BetweenLog(random, 1e-7, 5e-3);
    AddSharp(drawn, i % 2 == 0 ? blur : -blur, blur * BetweenLog(random, 1.0, 1.5));
  }
  return drawn.problem;
}

}  // namespace

std::vector<ProblemSet> RegimeSets(std::uint64_t seed, int count) {
  struct Regime {
    const char* name;
    Problem (*draw)(Random& random);
  };
  static constexpr std::array<Regime, 4> kRegimes = {
      {{"regime: near-equal depths", NearEqual},
       {"regime: tangent, open by 1e-17 to 1e-9",
        [](Random& random) { return Touching(random, BetweenLog(random, 1e-17, 1e-9)); }},
       {"regime: infeasible by 1e-17 to 1e-9",
        [](Random& random) { return Touching(random, -BetweenLog(random, 1e-17, 1e-9)); }},
       {"regime: limits from 0.1 um to 5 mm", HugeRatios}}};
  std::vector<ProblemSet> sets;
  for (const Regime& regime : kRegimes) {
    Random random(seed++);
    ProblemSet set{regime.name, {}};
    for (int i = 0; i < count; ++i) set.problems.push_back(regime.draw(random));
    sets.push_back(std::move(set));
  }
  return sets;
}

}  // namespace lensd::bench
