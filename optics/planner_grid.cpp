// Plans on positions that exist. At one f-number the worst ratio is convex in e (for each choice of sides), so the best
// reachable extension is one of the two beside the best of all; whether it holds is then decided exactly at that point.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <ranges>

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

/// Entries of a rising list of values: a stretch of it, or some of it, rising too.
class Ascending {
 public:
  Ascending() = default;
  explicit Ascending(std::size_t only) : first_(only), count_(1) {}
  Ascending(std::size_t first, std::size_t count) : first_(first), count_(count) {}
  explicit Ascending(std::vector<std::size_t> list) : count_(list.size()), list_(std::move(list)) {}

  std::size_t size() const { return count_; }
  std::size_t operator[](std::size_t i) const { return list_.empty() ? first_ + i : list_[i]; }
  std::size_t front() const { return (*this)[0]; }
  std::size_t back() const { return (*this)[count_ - 1]; }
  /// How many of the values are below `limit`.
  std::size_t CountBelow(const std::vector<double>& values, double limit) const {
    const auto all = std::views::iota(std::size_t{0}, count_);
    return static_cast<std::size_t>(
        std::ranges::lower_bound(all, limit, {}, [&](std::size_t i) { return values[(*this)[i]]; }) - all.begin());
  }

 private:
  std::size_t first_ = 0, count_ = 0;
  std::vector<std::size_t> list_;
};

/// The entry of rising values nearest to `to`, the lower one of two.
std::size_t Nearest(const std::vector<double>& values, double to) {
  const auto above = std::ranges::lower_bound(values, to);
  if (above == values.begin()) return 0;
  const bool lower = above == values.end() || to - above[-1] <= *above - to;
  return static_cast<std::size_t>(above - values.begin()) - (lower ? 1 : 0);
}

/// The values in [low, high]; where there are none, the value nearest to it.
Ascending Within(const std::vector<double>& values, double low, double high) {
  const auto from = std::ranges::lower_bound(values, low), to = std::ranges::upper_bound(values, high);
  if (from < to) return {static_cast<std::size_t>(from - values.begin()), static_cast<std::size_t>(to - from)};
  return Ascending(Nearest(values, (low + high) / 2.0));
}

class Grid {
 public:
  Grid(const PlanRequest& request, const std::vector<double>& extensions, const std::vector<double>& f_numbers)
      : asked_(request), request_(request), extensions_(extensions), f_numbers_(f_numbers), cases_(request_) {
    in_force_ = Everything(request_);
    in_force_.focus = false;
    request_.stops.clear();
    request_.apertures_are_diameters = false;
    ChooseExtensions();
    ChooseFNumbers();
  }

  /// The best point that holds, else the nearest one to holding. `least` is the smallest f-number of any plan: for the
  /// smallest f-number no position below it is worth trying, as long as positions are what the request's ranges admit.
  Point Best(FNumber least) {
    const bool from_least = asked_.objective == Objective::Light && !asked_.focus && extensions_within_;
    constexpr double kRounding = 1e-12;  // of `least`
    const double surely_below = least.value * (1.0 - kRounding);
    const std::size_t below = from_least ? by_f_number_.CountBelow(f_numbers_, surely_below) : 0;
    const std::size_t first = below < by_f_number_.size() ? below : 0;
    std::optional<Point> best;
    for (std::size_t tried = 0; tried < by_f_number_.size(); ++tried) {
      const std::optional<Point> point = BestAt(by_f_number_[(first + tried) % by_f_number_.size()]);
      if (point && (!best || Better(*point, *best))) best = point;
      if (best && best->feasible && asked_.objective == Objective::Light) break;
    }
    return best.value_or(Point{by_extension_.front(), by_f_number_.front(), 0.0, false});
  }

  double extension(const Point& point) const { return extensions_[point.extension]; }
  double f_number(const Point& point) const { return f_numbers_[point.f_number]; }

 private:
  void ChooseExtensions() {
    double low = asked_.extensions.low.value, high = asked_.extensions.high.value;
    if (asked_.focus) {
      const Metres f{asked_.focal_length.value};
      const double value = asked_.focus->number.value;
      low = high = asked_.focus->is_vergence ? Extension(f, Dioptres{value}).value : Extension(f, Metres{value}).value;
      if (asked_.liquid) low = high = f.value * f.value * asked_.focus->vergence().value;
      by_extension_ = Ascending(Nearest(extensions_, low));
    } else {
      by_extension_ = Within(extensions_, low, high);
    }
    const double nearest = extensions_[by_extension_.front()];
    extensions_within_ = nearest >= low && nearest <= high;
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
    std::vector<std::size_t> stops;
    for (const Number& stop : asked_.stops) stops.push_back(Nearest(f_numbers_, n(stop)));
    std::ranges::sort(stops);
    by_f_number_ = Ascending(std::move(stops));
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
    std::vector<Point> points;
    const auto consider = [&](std::size_t e) {
      points.push_back({e, n, WorstRatioAt(request_, f_numbers_[n], extensions_[e]), false});
    };
    for (const double e : targets) {
      const std::size_t below = by_extension_.CountBelow(extensions_, e);
      if (below > 0) consider(by_extension_[below - 1]);
      if (below < by_extension_.size()) consider(by_extension_[below]);
    }
    if (points.empty()) return std::nullopt;
    // One f-number: of those that hold the best is the one of the least ratio (a fixed focus leaves but one).
    std::ranges::sort(points, [this](const Point& a, const Point& b) {
      return a.ratio != b.ratio ? a.ratio < b.ratio : extension(a) < extension(b);
    });
    for (Point& point : points) {
      point.feasible = Holds(point);
      if (point.feasible) return point;
    }
    return points.front();
  }

  bool Holds(const Point& point) {
    request_.extensions = {extension(point), extension(point)};
    const std::optional<bool> certain = HoldsForCertain(request_, f_number(point), extension(point), point.ratio);
    if (certain) return *certain;
    bool holds = false;
    cases_.ForEach(in_force_, [&](Task& task) {
      holds = SolveForN(task).feasible;
      return !holds;
    });
    return holds;
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
  const std::vector<double>&extensions_, &f_numbers_;
  Cases cases_;
  InForce in_force_;
  Ascending by_extension_, by_f_number_;
  bool extensions_within_ = true;  ///< by_extension_ lies in the request's range
};

}  // namespace

Result<ReachableValues> ReachableValues::Create(std::span<const double> values) {
  if (values.empty()) {
    return Fail(Code::InvalidArgument, "this lens states no positions to plan on: calibrate it first");
  }
  if (!std::ranges::all_of(values, [](double value) { return std::isfinite(value); })) {
    return Fail(Code::InvalidArgument, "the lens's positions must be finite extensions and f-numbers");
  }
  ReachableValues reachable;
  reachable.ascending_.assign(values.begin(), values.end());
  if (std::ranges::is_sorted(values)) return reachable;
  reachable.given_.resize(values.size());
  std::iota(reachable.given_.begin(), reachable.given_.end(), std::size_t{0});
  std::ranges::sort(reachable.given_, {}, [&](std::size_t i) { return values[i]; });
  std::ranges::sort(reachable.ascending_);
  return reachable;
}

Result<GridAnswer> PlanOnGrid(const PlanRequest& request, const ReachableValues& extensions,
                              const ReachableValues& f_numbers) {
  const double least = -request.focal_length.value * std::min(1.0, request.pupil_factor.value);
  if (!(extensions.ascending().front() > least) || !(f_numbers.ascending().front() > 0.0)) {
    return Fail(Code::InvalidArgument, "the lens's positions must be extensions above -f and f-numbers above zero");
  }
  Result<PlanAnswer> continuous = Plan(request);
  if (!continuous) return PassOn(std::move(continuous));
  GridAnswer answer;
  answer.continuous_feasible = continuous->feasible;
  const FNumber smallest = continuous->f_number;
  answer.plan = *std::move(continuous);
  if (!answer.continuous_feasible) return answer;
  Grid grid(request, extensions.ascending(), f_numbers.ascending());
  const Point point = grid.Best(smallest);
  answer.plan.feasible = point.feasible;
  answer.plan.limits.clear();
  answer.plan.worst_ratio = 0.0;
  Describe(request, grid.f_number(point), grid.extension(point), answer.plan);
  if (request.objective == Objective::Depth) {
    const FieldDepth field = FieldDepthAt(request, grid.f_number(point), grid.extension(point));
    answer.plan.depth_of_field = DepthInterval{PlanDepth::Vergence(field.near), PlanDepth::Vergence(field.far)};
  }
  answer.extension_index = extensions.IndexGiven(point.extension);
  answer.f_number_index = f_numbers.IndexGiven(point.f_number);
  return answer;
}

}  // namespace lensd::optics
