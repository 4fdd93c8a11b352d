// Programmes with diffraction in double precision, with the exact solver behind them; outside the convex range by
// branch and bound over N.
#include "optics/planner/solve_diffracted.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "optics/planner/branch_and_bound.h"
#include "optics/planner/rounding_filter.h"
#include "optics/planner/solve_exact.h"
#include "optics/planner/solve_linear.h"

namespace lensd::optics {

namespace {

double Double(const Number& number) {
  return number.value;
}

constexpr double kPrecision = 4e-16;

bool HasSharp(const Subproblem& task) {
  return std::any_of(task.rows.begin(), task.rows.end(), [](const LimitRow& row) {
    return row.kind == RowKind::SharpFar || row.kind == RowKind::SharpNear;
  });
}

DiffractionStrip<double> Curves(const LinearProgram<double>& lines, const Subproblem& task) {
  const PlanRequest& request = *task.request;
  return WriteCurves(lines, task, DiffractionFactor(request.diffraction) * request.wavelength->value, Double);
}

/// Above this N diffraction alone is more than the tightest limit, wherever the sensor is.
double LargestUsefulN(const DiffractionStrip<double>& strip) {
  const LensNumbers<double>& lens = strip.lines->lens;
  double largest = std::numeric_limits<double>::infinity();
  for (const SharpCurve<double>& curve : strip.curves) {
    largest =
        std::min(largest, curve.limit / (curve.stretch * strip.k * (lens.f + strip.lines->strip.low / lens.pupil)));
  }
  return largest;
}

/// Whether rounding cannot have changed the verdict of a convex search, nor spoilt N.
bool IsCertain(const DiffractionStrip<double>& strip, const DiffractionSearch<double>& search, double end,
               const WidthError<double>& error) {
  constexpr double kRelative = 1e-13, kSlopeError = 1e-12;
  const double e = 4.0 * error.at(search.n);
  const double off = search.at_start ? 0.0 : search.slope > 0.0 ? 2.0 * e / search.slope : kRelative * search.n;
  if (search.feasible) {
    if (search.at_start) return search.width > e;
    const double beyond = search.n + 2.0 * off;
    if (!(off <= kRelative * search.n) || beyond > end) return false;
    const Gap<double> gap = GapAt(strip, beyond, 1.0);
    return !gap.empty && gap.width() > e;
  }
  if (search.n > end) return search.n - off > end;
  if (GapAt(strip, search.n, 1.0).empty) return LeastOpenRatio(strip, search.n * (1.0 - kRelative)) > 1.0 + 1e-12;
  return search.width + std::abs(search.slope) * (off + kSlopeError * (end - search.n)) < -e;
}

std::vector<int> NamesOf(const Subproblem& task, const std::vector<int>& linear, const std::vector<int>& curves) {
  std::vector<int> names = linear;
  names.insert(names.end(), curves.begin(), curves.end());
  if (task.f_number_binds) names.push_back(kFNumberName);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  std::erase(names, static_cast<int>(kDomainName));
  return names;
}

/// The least worst ratio over N where a programme does not promise a single minimum at once.
class LeastRatioSearch {
 public:
  using Point = DiffractionRatio<double>;
  LeastRatioSearch(const LinearProgram<double>& lines, const DiffractionStrip<double>& strip)
      : strip_(strip), low_(lines.strip.n_low), high_(lines.strip.n_high), cap_(lines.strip.cap) {}

  std::optional<Solution> Least() {
    constexpr int kGrid = 50;
    const auto grid = [&](int i) { return low_ * std::pow(high_ / low_, static_cast<double>(i) / kGrid); };
    int nearest = 0;
    for (int i = 0; i <= kGrid; ++i) {
      if (Take(At(grid(i)))) nearest = i;
    }
    if (!best_) return std::nullopt;
    // Convex up to this ratio, every smaller one leaves one stretch of N, around the best so far.
    const bool convex = IsConvexUpTo(strip_, high_, best_->ratio);
    Close(grid(std::max(nearest - 1, 0)), grid(std::min(nearest + 1, kGrid)));
    bool undecided = false;
    while (!convex && best_->ratio > 0.0) {
      // Whether a hair less leaves something anywhere; if so, on to the bottom of that stretch.
      constexpr double kHair = 5e-10;
      constexpr int kMostBoxes = 2000000;
      const double less = best_->ratio * (1.0 - kHair);
      const double end = cap_ ? std::min(high_, *cap_ * less) : high_;
      const DiffractionSearch<double> search = SmallestNByScan(strip_, low_, end, less, 0.0, kMostBoxes);
      undecided = search.undecided;
      if (!search.feasible || !Take(At(search.n))) break;
      double step = kHair * search.n;
      while (search.n + step < high_ && Take(At(search.n + step))) step *= 2.0;
      Close(std::max(search.n - kHair * search.n, low_), std::min(search.n + step, high_));
    }
    Solution solved{true, best_->n, best_->e, best_->ratio};
    solved.scanned = !convex;
    solved.undecided = undecided;
    return solved;
  }

 private:
  std::optional<Point> At(double n) const { return DiffractionRatioAt(strip_, n, kPrecision); }

  /// Keeps the better one; whether that is the new one.
  bool Take(const std::optional<Point>& point) {
    if (!point || (best_ && !(point->ratio < best_->ratio))) return false;
    best_ = point;
    return true;
  }

  /// Closes in on the bottom between two N around the best one.
  void Close(double left, double right) {
    constexpr double kNarrow = 1e-15;
    while (right - left > kNarrow * right) {
      const double middle = (left + right) / 2.0;
      if (!(middle > left) || !(middle < right)) break;
      const std::optional<Point> point = At(middle);
      const double best = best_->n;
      const bool better = Take(point);
      const bool bottom_is_right = better ? point->trend < 0 : middle < best;
      if (better && point->trend == 0) break;
      (bottom_is_right ? left : right) = middle;
      if (!better && middle == best) break;
    }
  }

  const DiffractionStrip<double>& strip_;
  double low_, high_;
  std::optional<double> cap_;
  std::optional<Point> best_;
};

}  // namespace

bool CountsDiffraction(const Subproblem& task) {
  return task.request->wavelength.has_value() && HasSharp(task);
}

Solution SolveDiffractedForN(const Subproblem& task) {
  Solution without = SolveLinearForN(task);  // a superset
  if (!without.feasible) return without;
  LinearProgram<double> lines;
  Write(lines, task, Double);
  const DiffractionStrip<double> strip = Curves(lines, task);
  double end = LargestUsefulN(strip);
  if (!lines.strip.n_unbounded) end = std::min(end, lines.strip.n_high);
  if (lines.ill_conditioned || lines.strip.cap) return SolveDiffractedExactly(task, without);
  // Outside the convex range by branch and bound, which digits beyond a double's would make a thousand times slower.
  const bool convex = IsConvexUpTo(strip, end, 1.0);
  const double start = std::max(without.n, (convex ? 1e-9 : 1e-30) * end);
  const WidthError<double> error(lines,
                                 lines.lens.widen / lines.lens.narrow);  // curves hold at up to that much larger N
  const DiffractionSearch<double> search =
      convex ? SmallestNConvex(strip, start, end, 0.0) : SmallestNByScan(strip, start, end, 1.0, 0.0);
  if (convex && !IsCertain(strip, search, end, error)) return SolveDiffractedExactly(task, without);
  // What was left out next to zero matters only where N is not bounded from below.
  if (convex && !search.feasible && without.n < start) return SolveDiffractedExactly(task, without);
  Solution solved;
  solved.scanned = !convex;
  solved.undecided = search.undecided;
  if (!search.feasible) {
    solved.names = NamesOf(task, without.names, search.names);
    return solved;
  }
  solved.feasible = true;
  solved.n = search.n;
  if (lines.strip.high_unbounded) return solved;
  const std::optional<DiffractionRatio<double>> least = DiffractionRatioAt(strip, search.n, kPrecision);
  if (convex && (!least || !RatioIsGood(lines.strip, error, search.n))) {
    return SolveDiffractedExactly(task, without);
  }
  if (!least) return solved;
  solved.e = least->e;
  solved.ratio = least->ratio;
  return solved;
}

std::optional<Solution> SolveDiffractedForRatio(const Subproblem& task) {
  LinearProgram<double> lines;
  Write(lines, task, Double);
  if (lines.unmeetable || lines.focus_outside) return std::nullopt;
  const DiffractionStrip<double> strip = Curves(lines, task);
  const auto at = [&](double n) { return DiffractionRatioAt(strip, n, kPrecision); };
  double a = lines.strip.n_low, b = lines.strip.n_high;
  std::optional<DiffractionRatio<double>> left = at(a), right = at(b);
  if (!left || !right) return std::nullopt;
  const bool convex = IsConvexUpTo(strip, b, std::max(left->ratio, right->ratio));
  if (!convex) return LeastRatioSearch(lines, strip).Least();
  constexpr double kNarrow = 1e-15;
  while (left->trend < 0 && right->trend > 0 && right->n - left->n > kNarrow * right->n) {
    const double middle = (left->n + right->n) / 2.0;
    if (!(middle > left->n) || !(middle < right->n)) break;
    const std::optional<DiffractionRatio<double>> point = at(middle);
    if (!point) return std::nullopt;
    (point->trend < 0 ? left : right) = point;
  }
  const DiffractionRatio<double>& best = right->ratio < left->ratio ? *right : *left;
  return Solution{true, best.n, best.e, best.ratio};
}

}  // namespace lensd::optics
