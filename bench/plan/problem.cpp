// Planning problems drawn at random around a setting that meets them, in plain numbers that every method reads.
#include "bench/plan/problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace lensd::bench {
namespace {

constexpr double kFinestLimit = 2e-6;  // under a pixel: no plan asks for less

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(engine_); }
  double Log(double low, double high) { return std::exp(Uniform(std::log(low), std::log(high))); }
  int Integer(int low, int high) { return std::uniform_int_distribution(low, high)(engine_); }

 private:
  std::mt19937_64 engine_;
};

double SignedBlur(const Problem& problem, const Answer& at, double vergence) {
  return (at.e - problem.f * (problem.f + at.e) * vergence) / at.n;
}

double LargestBlur(const Problem& problem, const Answer& at, double far, double near) {
  double largest = 0;
  for (const double side : {-1.0, 1.0}) {
    const Answer off{at.n, at.e + side * problem.delta};
    largest = std::max({largest, std::abs(SignedBlur(problem, off, far)), std::abs(SignedBlur(problem, off, near))});
  }
  return largest;
}

/// A limit that the setting `truth` meets with little or much to spare.
Limit DrawLimit(Draw& draw, const Problem& problem, const Answer& truth) {
  const double focus = truth.e / (problem.f * (problem.f + truth.e));
  const double depth_of_field = 20e-6 * truth.n / (problem.f * (problem.f + truth.e));
  Limit limit;
  const double kind = draw.Uniform(0, 1);
  if (kind < 0.6) {
    limit.far = std::max(0.0, focus + depth_of_field * draw.Uniform(-1, 0.5));
    limit.near = limit.far + depth_of_field * draw.Uniform(0, 1);
    limit.limit = std::max(kFinestLimit, LargestBlur(problem, truth, limit.far, limit.near) * draw.Log(1.0, 2.0));
    return limit;
  }
  limit.kind = kind < 0.8 && focus > 3 * depth_of_field ? Kind::Behind : Kind::Front;
  const double side = limit.kind == Kind::Behind ? -1 : 1;
  const double close = focus + side * depth_of_field * draw.Uniform(1, 3);
  const double away = std::max(0.0, close + side * depth_of_field * draw.Uniform(0, 3));
  limit.far = std::min(close, away);
  limit.near = std::max(close, away);
  const Answer worst{truth.n, truth.e + side * problem.delta};
  limit.limit = std::abs(SignedBlur(problem, worst, close)) * draw.Uniform(0.3, 1.0);
  return limit;
}

Problem DrawLens(Draw& draw) {
  const double f = draw.Log(0.02, 0.1);
  return {
      .f = f, .n_low = 1.4, .n_high = 22, .e_low = 0, .e_high = 0.15 * f, .delta = draw.Uniform(0, 2e-6), .limits = {}};
}

}  // namespace

// At vergence U and with W = 1 - f U, blur s = (W e - f² U)/N: a limit on it is a bound on e, linear in N, moved
// inwards by the sensor tolerance.
Lines LinesOf(const Problem& problem) {
  const double f = problem.f;
  Lines lines;
  const auto upper = [&](double u, double c) {
    lines.upper_p.push_back(f * f * u / (1 - f * u) - problem.delta);
    lines.upper_q.push_back(c / (1 - f * u));
  };
  const auto lower = [&](double u, double c) {
    lines.lower_p.push_back(f * f * u / (1 - f * u) + problem.delta);
    lines.lower_q.push_back(c / (1 - f * u));
  };
  for (const Limit& limit : problem.limits) {
    if (limit.kind != Kind::Behind) upper(limit.far, limit.kind == Kind::Sharp ? limit.limit : -limit.limit);
    if (limit.kind != Kind::Front) lower(limit.near, limit.kind == Kind::Sharp ? -limit.limit : limit.limit);
  }
  return lines;
}

double Violation(const Problem& problem, const Answer& answer) {
  if (!std::isfinite(answer.n) || !std::isfinite(answer.e)) return std::numeric_limits<double>::infinity();
  double worst = 0;
  for (const Limit& limit : problem.limits) {
    if (limit.kind == Kind::Sharp) {
      worst = std::max(worst, LargestBlur(problem, answer, limit.far, limit.near) / limit.limit - 1);
      continue;
    }
    const double side = limit.kind == Kind::Behind ? 1 : -1;
    for (const double shift : {-problem.delta, problem.delta}) {
      for (const double u : {limit.far, limit.near}) {
        const double blur = side * SignedBlur(problem, {answer.n, answer.e + shift}, u);
        worst = std::max(worst, 1 - blur / limit.limit);
      }
    }
  }
  return worst;
}

ProblemSet MixedLimits(std::string name, std::uint64_t seed, int count, int fewest, int most) {
  Draw draw(seed);
  ProblemSet set{std::move(name), {}};
  for (int i = 0; i < count; ++i) {
    Problem problem = DrawLens(draw);
    const Answer truth{draw.Log(2, 20), problem.f * draw.Uniform(0.01, 0.1)};
    const int limits = draw.Integer(fewest, most);
    for (int k = 0; k < limits; ++k) problem.limits.push_back(DrawLimit(draw, problem, truth));
    set.problems.push_back(std::move(problem));
  }
  return set;
}

ProblemSet ManyDepths(std::string name, std::uint64_t seed, std::size_t depths) {
  Draw draw(seed);
  Problem problem = DrawLens(draw);
  problem.f = 0.05;
  problem.e_high = 0.008;
  const Answer truth{11, problem.f * problem.f * 0.45};
  for (std::size_t i = 0; i < depths; ++i) {
    const double u = draw.Uniform(0.38, 0.5);
    const double met = LargestBlur(problem, truth, u, u) * (1 + draw.Log(1e-6, 1.0));
    problem.limits.push_back({.far = u, .near = u, .limit = std::max(kFinestLimit, met)});
  }
  return {std::move(name), {std::move(problem)}};
}

}  // namespace lensd::bench
