// The truth to measure errors against.
#include <boost/multiprecision/cpp_int.hpp>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "bench/plan/peers.h"

namespace lensd::bench {
namespace {

using Rational =
    boost::multiprecision::number<boost::multiprecision::rational_adaptor<boost::multiprecision::cpp_int_backend<>>,
                                  boost::multiprecision::et_off>;

constexpr std::size_t kMostExact = 200;  // limits

/// The shortest decimal that reads back as `value`: what the planner's verdicts refer to (optics/plan_request.h).
Rational Exactly(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::scientific).ptr;
  const std::string all(text, end);
  const std::size_t e = all.find('e');
  std::string digits = all.substr(0, e);
  int exponent = std::stoi(all.substr(e + 1));
  if (const std::size_t point = digits.find('.'); point != std::string::npos) {
    exponent -= static_cast<int>(digits.size() - point - 1);
    digits.erase(point, 1);
  }
  const bool negative = digits.front() == '-';
  digits.erase(0, digits.find_first_of("123456789"));  // a zero in front would be read as octal
  Rational exact = digits.empty() ? Rational(0) : Rational(boost::multiprecision::cpp_int(digits));
  const Rational power(
      boost::multiprecision::pow(boost::multiprecision::cpp_int(10), static_cast<unsigned>(std::abs(exponent))));
  exact = exponent < 0 ? exact / power : exact * power;
  return negative ? Rational(-exact) : exact;
}

struct Line {
  Rational p;
  Rational q;
};

void AddLines(const Problem& problem, std::vector<Line>& upper, std::vector<Line>& lower) {
  const Rational f = Exactly(problem.f);
  const Rational delta = Exactly(problem.delta);
  upper.push_back({Exactly(problem.e_high), 0});
  lower.push_back({Exactly(problem.e_low), 0});
  for (const Limit& limit : problem.limits) {
    const Rational c = Exactly(limit.limit);
    if (limit.kind != Kind::Behind) {
      const Rational w = 1 - f * Exactly(limit.far);
      upper.push_back({f * f * Exactly(limit.far) / w - delta, (limit.kind == Kind::Sharp ? c : Rational(-c)) / w});
    }
    if (limit.kind != Kind::Front) {
      const Rational w = 1 - f * Exactly(limit.near);
      lower.push_back({f * f * Exactly(limit.near) / w + delta, (limit.kind == Kind::Sharp ? Rational(-c) : c) / w});
    }
  }
}

/// Some e is left at N exactly where every upper line is above every lower one: each pair bounds N from one side.
std::optional<Rational> SmallestN(const Problem& problem) {
  std::vector<Line> upper;
  std::vector<Line> lower;
  AddLines(problem, upper, lower);
  Rational low = Exactly(problem.n_low);
  Rational high = Exactly(problem.n_high);
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

/// How far sharp limits leave the extension open at N, in long double.
long double OpenAt(const Problem& problem, long double n) {
  const long double f = problem.f;
  long double low = problem.e_low;
  long double high = problem.e_high;
  for (const Limit& limit : problem.limits) {
    const auto bound = [&](double u, int side) {
      const long double w = 1 - f * u;
      return f * f * u / w + side * (limit.limit * n / w - problem.delta);
    };
    high = std::min(high, bound(limit.far, 1));
    low = std::max(low, bound(limit.near, -1));
  }
  return high - low;
}

/// Sharp limits only: more N always opens more.
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
          [](const Problem& problem) -> Solver { return [&problem] { return SolveExactly(problem); }; }, kMostExact};
}

double TrueFNumber(const Problem& problem) {
  return problem.limits.size() > kMostExact ? BisectLong(problem) : SolveExactly(problem).n;
}

}  // namespace lensd::bench
