// Plans on positions that exist. At one f-number the worst ratio is convex in e (for each choice of sides), so the best
// reachable extension is one of the two beside the best of all; whether it holds is then decided exactly at that point.
#include <algorithm>
#include <cmath>
#include <limits>

#include "optics/conjugates.h"
#include "planner_cases.h"
#include "planner_check.h"
#include "planner_depth.h"
#include "planner_report.h"
#include "planner_solve.h"

namespace lensd::optics {

namespace {

constexpr double kAnyRatio = std::numeric_limits<double>::infinity();

/// One reachable setting.
struct Point {
  std::size_t extension = 0;
  std::size_t f_number = 0;
  double ratio = 0.0;
  bool feasible = false;
};

class Grid {
 public:
  Grid(const PlanRequest& request, std::span<const double> extensions, std::span<const double> f_numbers)
      : asked_(request), request_(request), extensions_(extensions), f_numbers_(f_numbers), cases_(request_) {
    in_force_ = Everything(request_);
    in_force_.focus = false;
    request_.stops.clear();
    request_.apertures_are_diameters = false;
    ChooseExtensions();
    ChooseFNumbers();
  }

  /// The best point that holds, else the nearest one to holding.
  Point Best() {
    std::optional<Point> best;
    for (const std::size_t n : by_f_number_) {
      const std::optional<Point> point = BestAt(n);
      if (point && (!best || Better(*point, *best))) best = point;
      if (best && best->feasible && asked_.objective == Objective::Light) break;
    }
    return best.value_or(Point{by_extension_.front(), by_f_number_.front(), 0.0, false});
  }

  double extension(const Point& point) const { return extensions_[point.extension]; }
  double f_number(const Point& point) const { return f_numbers_[point.f_number]; }

 private:
  static std::size_t Nearest(std::span<const double> values, double to) {
    const auto nearer = [&](double a, double b) { return std::abs(a - to) < std::abs(b - to); };
    return static_cast<std::size_t>(std::min_element(values.begin(), values.end(), nearer) - values.begin());
  }

  /// Indices of the values in [low, high] in ascending order; where there are none, that of the value nearest to it.
  static std::vector<std::size_t> Within(std::span<const double> values, double low, double high) {
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i] >= low && values[i] <= high) chosen.push_back(i);
    }
    if (chosen.empty()) {
      const double middle = (low + high) / 2.0;
      chosen.push_back(Nearest(values, middle));
    }
    std::sort(chosen.begin(), chosen.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
    return chosen;
  }

  void ChooseExtensions() {
    double low = asked_.extensions.low.value, high = asked_.extensions.high.value;
    if (asked_.focus) {
      const Metres f{asked_.focal_length.value};
      const double value = asked_.focus->number.value;
      low = high = asked_.focus->is_vergence ? Extension(f, Dioptres{value}).value : Extension(f, Metres{value}).value;
      by_extension_ = {Nearest(extensions_, low)};
    } else {
      by_extension_ = Within(extensions_, low, high);
    }
    request_.extensions = {extensions_[by_extension_.front()], extensions_[by_extension_.back()]};
  }

  void ChooseFNumbers() {
    const double f = asked_.focal_length.value;
    const auto n = [&](const Number& given) { return asked_.apertures_are_diameters ? f / given.value : given.value; };
    if (asked_.stops.empty()) {
      const double a = n(asked_.f_numbers.low), b = n(asked_.f_numbers.high);
      by_f_number_ = Within(f_numbers_, std::min(a, b), std::max(a, b));
      return;
    }
    for (const Number& stop : asked_.stops) by_f_number_.push_back(Nearest(f_numbers_, n(stop)));
    std::sort(by_f_number_.begin(), by_f_number_.end(),
              [&](std::size_t a, std::size_t b) { return f_numbers_[a] < f_numbers_[b]; });
  }

  /// The best extension at one f-number.
  std::optional<Point> BestAt(std::size_t n) {
    request_.f_numbers = {f_numbers_[n], f_numbers_[n]};
    request_.extensions = {extensions_[by_extension_.front()], extensions_[by_extension_.back()]};
    std::vector<double> targets;
    const auto visit = [&](Task& task) {
      if (const std::optional<Solved> solved = SolveForRatio(task)) targets.push_back(solved->e);
      return true;
    };
    cases_.ForEach(in_force_, visit, kAnyRatio);
    std::optional<Point> best;
    for (const double e : targets) {
      const auto above = std::lower_bound(by_extension_.begin(), by_extension_.end(), e,
                                          [&](std::size_t i, double value) { return extensions_[i] < value; });
      if (above != by_extension_.begin()) Consider(n, *(above - 1), best);
      if (above != by_extension_.end()) Consider(n, *above, best);
    }
    return best;
  }

  void Consider(std::size_t n, std::size_t e, std::optional<Point>& best) {
    request_.extensions = {extensions_[e], extensions_[e]};
    Point point{e, n, WorstRatioAt(request_, f_numbers_[n], extensions_[e]), false};
    cases_.ForEach(in_force_, [&](Task& task) {
      point.feasible = SolveForN(task).feasible;
      return !point.feasible;
    });
    if (!best || Better(point, *best)) best = point;
  }

  bool Better(const Point& a, const Point& b) const {
    if (a.feasible != b.feasible) return a.feasible;
    if (a.feasible && asked_.objective == Objective::Depth) {
      const FieldDepth of_a = FieldDepthAt(asked_, f_number(a), extension(a));
      const FieldDepth of_b = FieldDepthAt(asked_, f_number(b), extension(b));
      return of_a.near - of_a.far > of_b.near - of_b.far;
    }
    if (a.feasible && asked_.objective == Objective::Light && f_number(a) != f_number(b)) {
      return f_number(a) < f_number(b);
    }
    if (a.ratio != b.ratio) return a.ratio < b.ratio;
    return extension(a) < extension(b);
  }

  const PlanRequest& asked_;
  PlanRequest request_;  ///< the same limits over the reachable ranges, narrowed as the search goes
  std::span<const double> extensions_, f_numbers_;
  Cases cases_;
  InForce in_force_;
  std::vector<std::size_t> by_extension_, by_f_number_;
};

}  // namespace

Result<GridAnswer> PlanOnGrid(const PlanRequest& request, std::span<const double> extensions,
                              std::span<const double> f_numbers) {
  if (extensions.empty() || f_numbers.empty()) {
    return Fail(Code::InvalidArgument, "this lens states no positions to plan on: calibrate it first");
  }
  const double least = -request.focal_length.value * std::min(1.0, request.pupil_factor.value);
  if (!std::all_of(extensions.begin(), extensions.end(), [&](double e) { return std::isfinite(e) && e > least; }) ||
      !std::all_of(f_numbers.begin(), f_numbers.end(), [](double n) { return std::isfinite(n) && n > 0.0; })) {
    return Fail(Code::InvalidArgument, "the lens's positions must be finite extensions and f-numbers above zero");
  }
  Result<PlanAnswer> continuous = Plan(request);
  if (!continuous) return PassOn(std::move(continuous));
  GridAnswer answer;
  answer.continuous_feasible = continuous->feasible;
  answer.plan = *std::move(continuous);
  if (!answer.continuous_feasible) return answer;
  Grid grid(request, extensions, f_numbers);
  const Point point = grid.Best();
  answer.plan.feasible = point.feasible;
  answer.plan.limits.clear();
  answer.plan.worst_ratio = 0.0;
  Describe(request, grid.f_number(point), grid.extension(point), answer.plan);
  if (request.objective == Objective::Depth) {
    const FieldDepth field = FieldDepthAt(request, grid.f_number(point), grid.extension(point));
    answer.plan.depth_of_field = DepthInterval{PlanDepth::Vergence(field.near), PlanDepth::Vergence(field.far)};
  }
  answer.extension_index = point.extension;
  answer.f_number_index = point.f_number;
  return answer;
}

}  // namespace lensd::optics
