// The truth to measure errors against.
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <optional>

#include "bench/plan/peers.h"

namespace lensd::bench {
namespace {

using Rational =
    boost::multiprecision::number<boost::multiprecision::rational_adaptor<boost::multiprecision::cpp_int_backend<>>,
                                  boost::multiprecision::et_off>;

struct Line {
  Rational p;
  Rational q;
};

void AddLines(const Problem& problem, std::vector<Line>& upper, std::vector<Line>& lower) {
  const Rational f(problem.f);
  const Rational delta(problem.delta);
  upper.push_back({Rational(problem.e_high), 0});
  lower.push_back({Rational(problem.e_low), 0});
  for (const Limit& limit : problem.limits) {
    const Rational c(limit.limit);
    if (limit.kind != Kind::Behind) {
      const Rational w = 1 - f * Rational(limit.far);
      upper.push_back({f * f * Rational(limit.far) / w - delta, (limit.kind == Kind::Sharp ? c : Rational(-c)) / w});
    }
    if (limit.kind != Kind::Front) {
      const Rational w = 1 - f * Rational(limit.near);
      lower.push_back({f * f * Rational(limit.near) / w + delta, (limit.kind == Kind::Sharp ? Rational(-c) : c) / w});
    }
  }
}

/// Some e is left at N exactly where every upper line is above every lower one: each pair bounds N from one side.
std::optional<Rational> SmallestN(const Problem& problem) {
  std::vector<Line> upper;
  std::vector<Line> lower;
  AddLines(problem, upper, lower);
  Rational low(problem.n_low);
  Rational high(problem.n_high);
  for (const Line& above : upper) {
    for (const Line& below : lower) {
      const Rational gap = above.p - below.p;
      const Rational slope = above.q - below.q;
      if (slope == 0) {
        if (gap < 0) return std::nullopt;
        continue;
      }
      const Rational n = -gap / slope;
      if (slope > 0 && n > low) low = n;
      if (slope < 0 && n < high) high = n;
    }
  }
  if (low > high) return std::nullopt;
  return low;
}

Answer SolveExactly(const Problem& problem) {
  const auto n = SmallestN(problem);
  if (!n) return {std::numeric_limits<double>::quiet_NaN(), 0};
  std::vector<Line> upper;
  std::vector<Line> lower;
  AddLines(problem, upper, lower);
  std::optional<Rational> low;
  std::optional<Rational> high;
  for (const Line& line : lower) {
    const Rational e = line.p + line.q * *n;
    if (!low || e > *low) low = e;
  }
  for (const Line& line : upper) {
    const Rational e = line.p + line.q * *n;
    if (!high || e < *high) high = e;
  }
  return {n->convert_to<double>(), Rational((*low + *high) / 2).convert_to<double>()};
}

/// How far the lines leave the extension open at N, in long double; and whether more N opens it.
long double OpenAt(const Problem& problem, long double n) {
  const long double f = problem.f;
  long double low = problem.e_low;
  long double high = problem.e_high;
  const bool own = problem.sample_limit.size() > 1;
  for (std::size_t i = 0; i < problem.sample_vergence.size(); ++i) {
    const long double u = problem.sample_vergence[i];
    const long double w = 1 - f * u;
    const long double middle = f * f * u / w;
    const long double reach = problem.sample_limit[own ? i : 0] * n / w - problem.delta;
    low = std::max(low, middle - reach);
    high = std::min(high, middle + reach);
  }
  return high - low;
}

/// Sharp samples only: more N always opens more.
double BisectLong(const Problem& problem) {
  long double low = problem.n_low;
  long double high = problem.n_high;
  if (OpenAt(problem, low) >= 0) return problem.n_low;
  for (int step = 0; step < 64; ++step) {
    const long double n = (low + high) / 2;
    (OpenAt(problem, n) >= 0 ? high : low) = n;
  }
  return static_cast<double>(high);
}

}  // namespace

Method ExactReference() {
  return {"exact rational reference",
          [](const Problem& problem) -> Solver { return [&problem] { return SolveExactly(problem); }; }, 200};
}

double TrueFNumber(const Problem& problem) {
  if (!problem.sample_vergence.empty()) return BisectLong(problem);
  return SolveExactly(problem).n;
}

}  // namespace lensd::bench
