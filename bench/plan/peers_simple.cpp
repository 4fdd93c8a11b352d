// Peers that need no library: two recipes, a grid, and bisection.
#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/plan/peers.h"

namespace lensd::bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What both recipes look at: the outermost images of what shall be sharp, and the tightest limit.
struct Images {
  double far = kInfinity;
  double near = -kInfinity;
  double tightest = kInfinity;
};

Images ImagesOf(const Problem& problem) {
  Images images;
  const auto add = [&](double far, double near, double limit) {
    images.far = std::min(images.far, far / (1 - problem.f * far));
    images.near = std::max(images.near, near / (1 - problem.f * near));
    images.tightest = std::min(images.tightest, limit);
  };
  for (const Limit& limit : problem.limits) {
    if (limit.kind == Kind::Sharp) add(limit.far, limit.near, limit.limit);
  }
  images.far *= problem.f * problem.f;
  images.near *= problem.f * problem.f;
  return images;
}

/// The smallest f-number at extension e; NaN where there is none in the range.
double SmallestAt(const Lines& lines, const Problem& problem, double e) {
  double low = problem.n_low;
  double high = problem.n_high;
  const auto bound = [&](double p, double q, double side) {  // side (p + q N - e) >= 0
    const double slope = side * q;
    const double n = (e - p) / q;
    if (slope > 0) low = std::max(low, n);
    if (slope < 0) high = std::min(high, n);
  };
  for (std::size_t i = 0; i < lines.upper_p.size(); ++i) bound(lines.upper_p[i], lines.upper_q[i], 1);
  for (std::size_t i = 0; i < lines.lower_p.size(); ++i) bound(lines.lower_p[i], lines.lower_q[i], -1);
  return low <= high ? low : kNan;
}

/// The extensions that N allows, empty as low > high.
struct Gap {
  double low;
  double high;
  double low_slope;
  double high_slope;
};

Gap GapAt(const Lines& lines, const Problem& problem, double n) {
  Gap gap{problem.e_low, problem.e_high, 0, 0};
  for (std::size_t i = 0; i < lines.upper_p.size(); ++i) {
    const double e = lines.upper_p[i] + lines.upper_q[i] * n;
    if (e < gap.high) gap.high = e, gap.high_slope = lines.upper_q[i];
  }
  for (std::size_t i = 0; i < lines.lower_p.size(); ++i) {
    const double e = lines.lower_p[i] + lines.lower_q[i] * n;
    if (e > gap.low) gap.low = e, gap.low_slope = lines.lower_q[i];
  }
  return gap;
}

Answer Bisect(const Problem& problem) {
  const Lines lines = LinesOf(problem);
  double low = problem.n_low;
  double high = problem.n_high;
  const Gap first = GapAt(lines, problem, low);
  if (first.low <= first.high) return {low, 0.5 * (first.low + first.high)};
  Answer answer{kNan, kNan};
  for (int step = 0; step < 60 && low < high; ++step) {
    const double n = 0.5 * (low + high);
    if (n == low || n == high) break;
    const Gap gap = GapAt(lines, problem, n);
    const bool feasible = gap.low <= gap.high;
    if (feasible) answer = {n, 0.5 * (gap.low + gap.high)};
    // Infeasible and not opening: a smaller f-number is needed.
    (feasible || gap.high_slope <= gap.low_slope ? high : low) = n;
  }
  return answer;
}

bool Meets(const Lines& lines, double n, double e) {
  for (std::size_t i = 0; i < lines.upper_p.size(); ++i) {
    if (e > lines.upper_p[i] + lines.upper_q[i] * n) return false;
  }
  for (std::size_t i = 0; i < lines.lower_p.size(); ++i) {
    if (e < lines.lower_p[i] + lines.lower_q[i] * n) return false;
  }
  return true;
}

Answer SearchGrid(const Problem& problem, int side) {
  const Lines lines = LinesOf(problem);
  const double ratio = std::pow(problem.n_high / problem.n_low, 1.0 / (side - 1));
  double n = problem.n_low;
  for (int i = 0; i < side; ++i, n *= ratio) {
    for (int k = 0; k < side; ++k) {
      const double e = problem.e_low + (problem.e_high - problem.e_low) * k / (side - 1);
      if (Meets(lines, n, e)) return {n, e};
    }
  }
  return {kNan, kNan};
}

}  // namespace

Method TextbookFormula() {
  return {"textbook depth of field",
          [](const Problem& problem) -> Solver {
            return [&problem]() -> Answer {
              const Images images = ImagesOf(problem);
              if (images.near < images.far) return {problem.n_low, 0.5 * (problem.e_low + problem.e_high)};
              const double n = (images.near - images.far) / (2 * images.tightest);
              return {std::clamp(n, problem.n_low, problem.n_high), 0.5 * (images.near + images.far)};
            };
          },
          10'000'000};
}

Method ImageMidpoint() {
  return {"halfway between the images",
          [](const Problem& problem) -> Solver {
            return [&problem]() -> Answer {
              const Images images = ImagesOf(problem);
              if (images.near < images.far) return {kNan, kNan};
              const double e = 0.5 * (images.near + images.far);
              return {SmallestAt(LinesOf(problem), problem, e), e};
            };
          },
          10'000'000};
}

Method GridSearch(int side) {
  return {"grid search " + std::to_string(side) + "²",
          [side](const Problem& problem) -> Solver { return [&problem, side] { return SearchGrid(problem, side); }; },
          side > 100 ? 8U : 200U};
}

Method Bisection() {
  return {"bisection", [](const Problem& problem) -> Solver { return [&problem] { return Bisect(problem); }; },
          10'000'000};
}

}  // namespace lensd::bench
