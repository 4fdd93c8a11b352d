// Planning problems in plain numbers, the same for every method.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace lensd::bench {

enum class Kind : std::uint8_t { Sharp, Behind, Front };

/// A limit in metres on blur over the vergences from far to near.
struct Limit {
  double far = 0;
  double near = 0;
  double limit = 0;
  Kind kind = Kind::Sharp;
};

/// The smallest f-number, please. Lengths in metres, vergences in dioptres.
struct Problem {
  double f = 0;
  double n_low = 0;
  double n_high = 0;
  double e_low = 0;
  double e_high = 0;
  double delta = 0;  ///< sensor tolerance
  std::vector<Limit> limits;
};

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// What a method says. Infeasible: NaN.
struct Answer {
  double n = 0;
  double e = 0;
};

/// Limits as bounds on the extension at an f-number: e <= p + q N (upper) and e >= p + q N (lower).
struct Lines {
  std::vector<double> upper_p, upper_q, lower_p, lower_q;
};

Lines LinesOf(const Problem& problem);

/// The largest relative violation of any limit at the answer, sensor tolerance included; infinite where there is none.
double Violation(const Problem& problem, const Answer& answer);

/// A set of problems of one size.
struct ProblemSet {
  std::string name;
  std::vector<Problem> problems;
};

/// Problems that a randomly drawn setting solves, so that all are feasible: `count` with `fewest` to `most` limits,
/// sides of blurred limits given.
ProblemSet MixedLimits(std::string name, std::uint64_t seed, int count, int fewest, int most);
/// One scene of many depths, each to be sharp within its own limit.
ProblemSet ManyDepths(std::string name, std::uint64_t seed, std::size_t depths);
/// Regimes in which planners fail, `count` problems each; those of one are infeasible. Names begin with "regime: ".
std::vector<ProblemSet> RegimeSets(std::uint64_t seed, int count);

}  // namespace lensd::bench
