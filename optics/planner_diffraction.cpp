// Programmes with diffraction in double precision, with the exact solver behind them; outside the convex range by
// branch and bound over N.
#include "planner_diffraction.h"

#include <algorithm>
#include <limits>

#include "planner_filter.h"
#include "planner_solve.h"

namespace lensd::optics {

namespace {

double Double(const Number& number) {
  return number.value;
}

constexpr double kPrecision = 4e-16;

bool HasSharp(const Task& task) {
  return std::any_of(task.rows.begin(), task.rows.end(), [](const RowSpec& row) {
    return row.kind == RowKind::SharpFar || row.kind == RowKind::SharpNear;
  });
}

DiffractionStrip<double> Curves(const Programme<double>& lines, const Task& task) {
  const PlanRequest& request = *task.request;
  return WriteCurves(lines, task, DiffractionFactor(request.diffraction) * request.wavelength->value, Double);
}

/// Above this N diffraction alone is more than the tightest limit, wherever the sensor is.
double LargestUsefulN(const DiffractionStrip<double>& strip) {
  const LensNumbers<double>& lens = strip.lines->lens;
  double largest = std::numeric_limits<double>::infinity();
  for (const SharpCurve<double>& curve : strip.curves) {
    largest = std::min(largest, curve.limit / (strip.k * (lens.f + strip.lines->strip.low / lens.pupil)));
  }
  return largest;
}

/// An upper bound of the strip's width for every N in [a, b]: geometric blur as at b, diffraction and blurred limits as
/// at a.
double WidthBound(const DiffractionStrip<double>& strip, double a, double b) {
  const Programme<double>& lines = *strip.lines;
  const LensNumbers<double>& lens = lines.lens;
  double high = lines.strip.high_unbounded ? std::numeric_limits<double>::infinity() : lines.strip.high;
  double low = lines.strip.low;
  for (std::size_t i = lines.upper_sharp; i < lines.upper_p.size(); ++i) {
    high = std::min(high, lines.upper_p[i] + lines.upper_q[i] * a);
  }
  for (std::size_t i = lines.lower_sharp; i < lines.lower_p.size(); ++i) {
    low = std::max(low, lines.lower_p[i] + lines.lower_q[i] * a);
  }
  for (const SharpCurve<double>& curve : strip.curves) {
    const double w = lens.pupil * curve.w, kab = strip.k * a * b, kfa = strip.k * lens.f * lens.pupil * a;
    const double scale = w * w + kab * kab;
    const double d = curve.limit * curve.limit * scale - kfa * kfa;
    if (d < 0.0) return -std::numeric_limits<double>::infinity();
    const double middle = lens.f * (w * curve.m - kab * kab), half = b * std::sqrt(d);
    high = std::min(high, lens.pupil * (middle + half) / scale - lens.delta);
    low = std::max(low, lens.pupil * (middle - half) / scale + lens.delta);
  }
  return high - low;
}

/// Smallest N in [start, end] by branch and bound, leftmost box first.
DiffractionSearch<double> SmallestNByScan(const DiffractionStrip<double>& strip, double start, double end) {
  struct Box {
    double a, b;
  };
  DiffractionSearch<double> search;
  for (const SharpCurve<double>& curve : strip.curves) search.names.push_back(curve.name);
  std::vector<Box> boxes{{start, end}};
  constexpr int kMostBoxes = 200000;
  constexpr double kNarrow = 1e-14;
  for (int visited = 0; !boxes.empty() && visited < kMostBoxes; ++visited) {
    const Box box = boxes.back();
    boxes.pop_back();
    const Gap<double> gap = GapAt(strip, box.a, 1.0);
    if (!gap.empty && (gap.unbounded || !(gap.width() < 0.0))) {
      search.feasible = true;
      search.n = box.a;
      return search;
    }
    if (WidthBound(strip, box.a, box.b) < 0.0 || box.b - box.a <= kNarrow * box.b) continue;
    const double middle = (box.a + box.b) / 2.0;
    boxes.push_back({middle, box.b});
    boxes.push_back({box.a, middle});
  }
  return search;
}

/// Whether rounding cannot have changed the verdict of a convex search, nor spoilt N.
bool IsCertain(const DiffractionStrip<double>& strip, const DiffractionSearch<double>& search, double end,
               const WidthError& error) {
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

std::vector<int> NamesOf(const Task& task, const std::vector<int>& linear, const std::vector<int>& curves) {
  std::vector<int> names = linear;
  names.insert(names.end(), curves.begin(), curves.end());
  if (task.f_number_binds) names.push_back(kFNumberName);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  std::erase(names, static_cast<int>(kDomainName));
  return names;
}

}  // namespace

bool CountsDiffraction(const Task& task) {
  return task.request->wavelength.has_value() && HasSharp(task);
}

Solved SolveDiffractedForN(const Task& task) {
  Solved without = SolveLinearForN(task);  // a superset
  if (!without.feasible) return without;
  Programme<double> lines;
  Write(lines, task, Double);
  if (lines.delicate || lines.strip.cap) return SolveDiffractedForNExactly(task, without.n);
  const DiffractionStrip<double> strip = Curves(lines, task);
  double end = LargestUsefulN(strip);
  if (!lines.strip.n_unbounded) end = std::min(end, lines.strip.n_high);
  constexpr double kNearZero = 1e-9;
  const double start = std::max(without.n, kNearZero * end);
  Solved solved;
  DiffractionSearch<double> search;
  const WidthError error(lines);
  if (IsConvexUpTo(strip, end, 1.0)) {
    search = SmallestNConvex(strip, start, end, 0.0);
    if (!IsCertain(strip, search, end, error)) return SolveDiffractedForNExactly(task, without.n);
  } else {
    search = SmallestNByScan(strip, start, end);
    solved.scanned = true;
  }
  // What was left out next to zero matters only where N is not bounded from below.
  if (!search.feasible && without.n < start) return SolveDiffractedForNExactly(task, without.n);
  if (!search.feasible) {
    solved.names = NamesOf(task, without.names, search.names);
    return solved;
  }
  solved.feasible = true;
  solved.n = search.n;
  if (lines.strip.high_unbounded) return solved;
  const std::optional<DiffractionRatio<double>> least = DiffractionRatioAt(strip, search.n, kPrecision);
  if (!solved.scanned && (!least || !RatioIsGood(lines.strip, error, search.n))) {
    return SolveDiffractedForNExactly(task, without.n);
  }
  if (least) {
    solved.e = least->e;
    solved.ratio = least->ratio;
  }
  return solved;
}

std::optional<Solved> SolveDiffractedForRatio(const Task& task) {
  Programme<double> lines;
  Write(lines, task, Double);
  if (lines.never || lines.focus_outside) return std::nullopt;
  const DiffractionStrip<double> strip = Curves(lines, task);
  const auto at = [&](double n) { return DiffractionRatioAt(strip, n, kPrecision); };
  double a = lines.strip.n_low, b = lines.strip.n_high;
  std::optional<DiffractionRatio<double>> left = at(a), right = at(b);
  if (!left || !right) return std::nullopt;
  const bool convex = IsConvexUpTo(strip, b, std::max(left->ratio, right->ratio));
  if (!convex) {  // the best of a fine grid, then its neighbourhood as if it were convex
    constexpr int kGrid = 1000;
    DiffractionRatio<double> best = *left;
    int best_index = 0;
    const auto grid = [&](int i) { return a * std::pow(b / a, static_cast<double>(i) / kGrid); };
    for (int i = 1; i <= kGrid; ++i) {
      const std::optional<DiffractionRatio<double>> point = at(grid(i));
      if (point && point->ratio < best.ratio) best = *point, best_index = i;
    }
    const double first = grid(std::max(best_index - 1, 0)), last = grid(std::min(best_index + 1, kGrid));
    a = first;
    b = last;
    left = at(a);
    right = at(b);
    if (!left || !right) return std::nullopt;
  }
  constexpr double kNarrow = 1e-15;
  while (left->trend < 0 && right->trend > 0 && right->n - left->n > kNarrow * right->n) {
    const double middle = (left->n + right->n) / 2.0;
    if (!(middle > left->n) || !(middle < right->n)) break;
    const std::optional<DiffractionRatio<double>> point = at(middle);
    if (!point) return std::nullopt;
    (point->trend < 0 ? left : right) = point;
  }
  const DiffractionRatio<double>& best = right->ratio < left->ratio ? *right : *left;
  return Solved{true, best.n, best.e, best.ratio, {}, !convex};
}

}  // namespace lensd::optics
