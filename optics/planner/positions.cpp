// Plans on positions that exist. A position of focus is fixed, so each limit asks one thing of the f-number there: at
// least so much (sharp), at most so much (blurred), or with diffraction to lie in a stretch. Every position of focus is
// tried; nothing is assumed of how one follows from another, so that lenses which breathe or stand within different
// bounds need no special case. Of very many limits those that decide are found by solving for a few and adding what the
// answer breaks.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "optics/lens_positions.h"
#include "optics/light.h"
#include "optics/model_ladder.h"
#include "planner/deepest_field.h"
#include "planner/position_blur.h"
#include "planner/request_check.h"

namespace lensd::optics {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kHolds = 1.0 + 1e-12;

/// One pair of positions.
struct Point {
  std::size_t focus = 0;
  std::size_t iris = 0;
  double ratio = 0.0;
};

class PositionSearch {
 public:
  PositionSearch(const PlanRequest& request, const LensPositions& lens, const PositionBlur& blur)
      : request_(request), lens_(lens), blur_(blur), choice_(ChoiceOf(request, lens, blur)) {
    for (const IrisPosition& position : lens_.iris) n_.push_back(blur_.FNumbers(position));
    for (const std::size_t j : choice_.iris) {
      highest_low_ = std::max(highest_low_, n_[j].first);
      lowest_high_ = std::min(lowest_high_, n_[j].second);
    }
  }

  bool focus_reachable() const { return choice_.focus_reachable; }

  /// The best point that holds; else the one that comes closest, whose ratio is above 1.
  Point Best() {
    if (blur_.limits() == 0) return Best({});
    std::vector<std::size_t> deciding = FirstLimits();
    for (;;) {
      Point point = Best(deciding);
      const double known = point.ratio;
      std::vector<std::pair<double, std::size_t>> beyond;
      for (std::size_t k = 0; k < blur_.limits(); ++k) {
        const double ratio = RatioOf(blur_.Need(k, lens_.focus[point.focus]), point.iris);
        point.ratio = std::max(point.ratio, ratio);
        if (ratio > known * kHolds) beyond.emplace_back(ratio, k);
      }
      if (beyond.empty()) return point;
      std::ranges::sort(beyond, std::greater<>());
      if (beyond.size() > kAddAtOnce) beyond.resize(kAddAtOnce);
      for (const auto& [ratio, k] : beyond) deciding.push_back(k);
    }
  }

 private:
  static constexpr std::size_t kFew = 16, kAddAtOnce = 16, kSamples = 33;

  /// All of a few; of many those that are worst somewhere.
  std::vector<std::size_t> FirstLimits() const {
    std::vector<std::size_t> first;
    const std::size_t count = blur_.limits();
    if (count <= kFew) {
      for (std::size_t k = 0; k < count; ++k) first.push_back(k);
      return first;
    }
    for (std::size_t sample = 0; sample < kSamples; ++sample) {
      const FocusPosition& position = lens_.focus[choice_.focus[sample * (choice_.focus.size() - 1) / (kSamples - 1)]];
      std::size_t sharpest = 0, softest = 0;
      double most = -1.0, least = kInfinite;
      for (std::size_t k = 0; k < count; ++k) {
        const OpeningNeed need = blur_.Need(k, position);
        const double n = need.geometric / need.limit;
        if (need.sharp && n > most) most = n, sharpest = k;
        if (!need.sharp && n < least) least = n, softest = k;
      }
      if (most >= 0.0) first.push_back(sharpest);
      if (least < kInfinite) first.push_back(softest);
    }
    std::ranges::sort(first);
    first.erase(std::unique(first.begin(), first.end()), first.end());
    return first;
  }

  double RatioOf(const OpeningNeed& need, std::size_t iris) const {
    return need.Ratio(n_[iris].first, n_[iris].second);
  }
  double WorstRatio(std::size_t iris) const {
    double worst = 0.0;
    for (const OpeningNeed& need : needs_) worst = std::max(worst, RatioOf(need, iris));
    return worst;
  }
  void TakeNeeds(const std::vector<std::size_t>& limits, std::size_t focus) {
    needs_.clear();
    for (const std::size_t k : limits) needs_.push_back(blur_.Need(k, lens_.focus[focus]));
  }

  Point Best(const std::vector<std::size_t>& limits) {
    if (request_.objective == Objective::Depth) return Deepest(limits);
    if (limits.empty()) return {choice_.focus[(choice_.focus.size() - 1) / 2], choice_.iris.front(), 0.0};
    if (request_.objective == Objective::Light) {
      if (const auto brightest = Brightest(limits)) return *brightest;
    }
    return Sharpest(limits);
  }

  /// Smallest f-number that holds; there the least ratio, then the smallest extension.
  std::optional<Point> Brightest(const std::vector<std::size_t>& limits) {
    std::optional<Point> best;
    std::size_t last = choice_.iris.size() - 1;  // in choice_.iris: nothing beyond is of interest
    for (const std::size_t i : choice_.focus) {
      TakeNeeds(limits, i);
      double least = 0.0, most = kInfinite;
      for (const OpeningNeed& need : needs_) {
        double& bound = need.sharp ? least : most;
        const double n = need.geometric / need.limit;
        bound = need.sharp ? std::max(bound, n) : std::min(bound, n);
      }
      if (most * kHolds < lowest_high_ || least > highest_low_ * kHolds) continue;
      const auto n_of = [&](std::size_t j) { return lens_.iris[j].f_number.value; };
      const auto from = std::ranges::lower_bound(choice_.iris, least / kHolds, {}, n_of) - choice_.iris.begin();
      for (auto at = static_cast<std::size_t>(from); at <= last; ++at) {
        const std::size_t j = choice_.iris[at];
        if (n_of(j) > most * kHolds) break;
        const double ratio = WorstRatio(j);
        if (ratio > kHolds) continue;
        if (best && at == last && best->iris == j && ratio >= best->ratio) break;
        best = Point{i, j, ratio};
        last = at;
        break;
      }
    }
    return best;
  }

  /// No f-number makes it less at this position.
  double LeastRatio() const {
    double least = 0.0;
    for (const OpeningNeed& need : needs_) {
      const double widest = need.sharp ? need.geometric / (need.limit * highest_low_) : need.Ratio(1.0, lowest_high_);
      const double turn = need.sharp ? std::sqrt(2.0 * need.geometric * need.diffraction) / need.limit : 0.0;
      least = std::max({least, widest, turn});
    }
    return least;
  }

  /// Smallest ratio, then the smallest f-number, then the smallest extension.
  Point Sharpest(const std::vector<std::size_t>& limits) {
    std::vector<std::pair<double, std::size_t>> order;
    for (const std::size_t i : choice_.focus) {
      TakeNeeds(limits, i);
      order.emplace_back(LeastRatio(), i);
    }
    std::ranges::sort(order);
    std::optional<Point> best;
    for (const auto& [least, i] : order) {
      if (best && least > best->ratio) break;
      TakeNeeds(limits, i);
      for (const std::size_t j : choice_.iris) {
        const Point point{i, j, WorstRatio(j)};
        if (!best || std::tuple(point.ratio, j, i) < std::tuple(best->ratio, best->iris, best->focus)) best = point;
      }
    }
    return *best;
  }

  /// At the fixed focus: of the f-numbers that hold, the one with the greatest depth of field, then the smallest.
  Point Deepest(const std::vector<std::size_t>& limits) {
    const std::size_t i = choice_.focus.front();
    TakeNeeds(limits, i);
    std::optional<Point> best, nearest;
    double deepest = -1.0;
    for (const std::size_t j : choice_.iris) {
      const Point point{i, j, WorstRatio(j)};
      if (!nearest || point.ratio < nearest->ratio) nearest = point;
      const PlanRequest there = blur_.AtPosition(lens_.focus[i], lens_.iris[j], PositionBlur::Limits::LeftOut);
      const FieldDepth field = FieldDepthAt(there, there.f_numbers.low.value, there.extensions.low.value);
      if (point.ratio > kHolds || field.near < field.far || field.near - field.far <= deepest) continue;
      deepest = field.near - field.far;
      best = point;
    }
    if (best) return *best;
    nearest->ratio = std::max(nearest->ratio, std::nextafter(kHolds, 2.0));
    return *nearest;
  }

  const PlanRequest& request_;
  const LensPositions& lens_;
  const PositionBlur& blur_;
  const PositionChoice choice_;
  std::vector<std::pair<double, double>> n_;  ///< of each position of the iris
  double highest_low_ = 0.0, lowest_high_ = kInfinite;
  std::vector<OpeningNeed> needs_;
};

void DescribeLimits(const PositionBlur& blur, const PlanRequest& request, const FocusPosition& position,
                    std::pair<double, double> n, PlanAnswer& answer) {
  for (std::size_t k = 0; k < blur.limits(); ++k) {
    const OpeningNeed need = blur.Need(k, position);
    const auto [near, far] = blur.Depths(k, position);
    LimitAnswer fares{.name = request.limits[k].name,
                      .near = {near},
                      .far = {far},
                      .limit = {need.limit},
                      .worst = {},
                      .at = {need.at}};
    fares.worst = {need.sharp ? std::max(need.Blur(n.first), need.Blur(n.second)) : need.Blur(n.second)};
    fares.ratio = need.Ratio(n.first, n.second);
    if (fares.ratio > 1.0 && fares.ratio <= kHolds) fares.ratio = 1.0;
    answer.worst_ratio = std::max(answer.worst_ratio, fares.ratio);
    answer.limits.push_back(std::move(fares));
  }
}

PlanAnswer DescribePoint(const PositionBlur& blur, const PlanRequest& request, const LensPositions& lens,
                         const Point& point) {
  const FocusPosition& position = lens.focus[point.focus];
  const IrisPosition& iris = lens.iris[point.iris];
  PlanAnswer answer;
  answer.feasible = point.ratio <= kHolds;
  answer.f_number = iris.f_number;
  answer.focal_length = position.focal_length;
  answer.extension = position.extension;
  answer.aperture_diameter = lens.focal_length / iris.f_number.value;
  answer.sensor_distance = position.sensor_distance;
  answer.focal_plane = position.focal_plane;
  answer.magnification = lens.liquid ? position.focal_plane.value * position.sensor_distance.value
                                     : position.extension / position.focal_length;
  answer.working_f_number = iris.f_number;
  if (!lens.liquid) {
    answer.working_f_number = WorkingFNumber(FNumber{iris.f_number.value * blur.Breathing(position)},
                                             answer.magnification, request.pupil_factor.value);
  }
  DescribeLimits(blur, request, position, blur.FNumbers(iris), answer);
  if (request.objective == Objective::Depth) {
    const PlanRequest there = blur.AtPosition(position, iris, PositionBlur::Limits::LeftOut);
    const FieldDepth field = FieldDepthAt(there, there.f_numbers.low.value, there.extensions.low.value);
    answer.depth_of_field = DepthInterval{PlanDepth::Vergence(field.near), PlanDepth::Vergence(field.far)};
  }
  return answer;
}

/// The request over whole ranges, for a lens that is everywhere what this one is at one position.
PlanRequest WithRanges(const PositionBlur& blur, const PlanRequest& asked, const LensPositions& lens,
                       const Point& point) {
  const FocusPosition& position = lens.focus[point.focus];
  PlanRequest request = blur.AtPosition(position, lens.iris[point.iris], PositionBlur::Limits::Included);
  request.extensions = asked.extensions;
  if (lens.liquid) {
    const auto convert = [&](const Number& number) {
      return Number(LiquidExtension(position.sensor_distance, Metres{number.value}).value);
    };
    request.extensions = {convert(asked.extensions.low), convert(asked.extensions.high)};
  }
  request.apertures_are_diameters = asked.apertures_are_diameters;
  request.f_numbers = asked.f_numbers;
  request.stops = asked.stops;
  if (const double breathing = blur.Breathing(position); !asked.apertures_are_diameters && breathing != 1.0) {
    request.f_numbers = {asked.f_numbers.low.value * breathing, asked.f_numbers.high.value * breathing};
    for (Number& stop : request.stops) stop = stop.value * breathing;
  }
  return request;
}

}  // namespace

PlanRequest RequestAtFirst(const PlanRequest& request, const LensPositions& lens, const DistanceOrigin& origin) {
  return WithRanges(PositionBlur(request, lens, origin), request, lens, {});
}

Result<PositionPlan> PlanOnPositions(const PlanRequest& request, const LensPositions& lens,
                                     const DistanceOrigin& origin) {
  const PositionBlur blur(request, lens, origin);
  const Point middle{lens.focus.size() / 2, lens.iris.size() / 2, 0.0};
  if (auto error = Check(WithRanges(blur, request, lens, middle))) return PassOn(*std::move(error));
  PositionSearch search(request, lens, blur);
  const Point point = search.Best();
  PositionPlan answer{.plan = {},
                      .continuous_feasible = true,
                      .focus = point.focus,
                      .iris = point.iris,
                      .request = WithRanges(blur, request, lens, point)};
  const PlanRequest& ranges = answer.request;
  answer.plan = DescribePoint(blur, request, lens, point);
  answer.plan.feasible = answer.plan.feasible && search.focus_reachable();
  if (!answer.plan.feasible) {
    auto continuous = Plan(ranges);
    if (!continuous) return PassOn(continuous);
    answer.continuous_feasible = continuous->feasible;
    if (!continuous->feasible) answer.plan = *std::move(continuous);
    if (!answer.continuous_feasible) return answer;
  }
  const ChosenModel model = ModelFor(ranges, answer.plan.limits);
  answer.plan.model = RungName(model.rung);
  answer.plan.model_error = model.error;
  return answer;
}

Result<PlanAnswer> CheckPosition(const PlanRequest& request, const LensPositions& lens, const DistanceOrigin& origin) {
  const PositionBlur blur(request, lens, origin);
  const PlanRequest there = blur.AtPosition(lens.focus.front(), lens.iris.front(), PositionBlur::Limits::Included);
  if (auto error = Check(there)) return PassOn(*std::move(error));
  PlanAnswer answer = DescribePoint(blur, request, lens, {});
  answer.feasible = answer.worst_ratio <= 1.0;
  const ChosenModel model = ModelFor(there, answer.limits);
  answer.model = RungName(model.rung);
  answer.model_error = model.error;
  return answer;
}

}  // namespace lensd::optics
