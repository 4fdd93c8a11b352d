// Focus stacks on positions: the greedy cover of stack_cover.h, its shots counted by position instead of extension. A
// depth is named by 1/distance from where distances start; the positions that keep it sharp within a limit are a
// stretch whose both ends rise with the depth, which is what the cover needs.
#include <algorithm>
#include <cmath>
#include <limits>

#include "optics/lens_positions.h"
#include "optics/planner/request_check.h"
#include "optics/positions/position_blur.h"
#include "optics/stack/stack_cover.h"

namespace lensd::optics {

namespace {

constexpr std::size_t kMostShotsOfALens = 1000;

/// What each position keeps sharp at one f-number.
class PositionReach {
 public:
  PositionReach(const PlanRequest& request, const LensPositions& lens, const PositionBlur& blur,
                const DistanceOrigin& origin, std::vector<std::size_t> positions, std::pair<double, double> n)
      : request_(request), lens_(lens), blur_(blur), origin_(origin), positions_(std::move(positions)), n_(n) {}

  /// Index of the highest position that keeps `depth` sharp; below 0: none.
  double HighestFor(double depth, double limit) const {
    const auto past = std::partition_point(positions_.begin(), positions_.end(),
                                           [&](std::size_t i) { return Stretch(i, limit).first <= depth; });
    return static_cast<double>(past - positions_.begin()) - 1.0;
  }
  double LowestFor(double depth, double limit) const {
    const auto first = std::partition_point(positions_.begin(), positions_.end(),
                                            [&](std::size_t i) { return Stretch(i, limit).second < depth; });
    return static_cast<double>(first - positions_.begin());
  }
  std::optional<double> NearestAt(double index, double limit) const { return Stretch(At(index), limit).second; }
  double FarthestAt(double index, double limit) const { return Stretch(At(index), limit).first; }

  std::size_t At(double index) const { return positions_[static_cast<std::size_t>(index)]; }
  double last() const { return static_cast<double>(positions_.size()) - 1.0; }

 private:
  /// Far and near end of what a position keeps within `limit`, as 1/distance; the near one first where there is none.
  std::pair<double, double> Stretch(std::size_t index, double limit) const {
    const FocusPosition& position = lens_.focus[index];
    const double error = 1.0 + lens_.focal_length_error;
    const double scale = lens_.focal_length.value * position.sensor_distance.value * error * error;
    double reach = std::numeric_limits<double>::infinity();
    for (const double n : {n_.first, n_.second}) {
      double left = limit;
      if (request_.wavelength) {
        const double working = n * blur_.Breathing(position) *
                               (1.0 + position.extension / position.focal_length / request_.pupil_factor.value);
        const double airy = DiffractionFactor(request_.diffraction) * request_.wavelength->value * working;
        left = std::sqrt(std::max(limit * limit - airy * airy, 0.0));
      }
      reach = std::min(reach, left * n / scale);
    }
    const double plane = position.focal_plane.value, bound = blur_.Bound(position, 0.0);
    // |U_s - U| + bound <= reach g(U), g = 1 + f U (1/p - 1).
    const double skew = position.focal_length.value * (1.0 / request_.pupil_factor.value - 1.0);
    const double far = (plane + bound - reach) / (1.0 + reach * skew);
    const double near = 1.0 - reach * skew > 0.0 ? (plane - bound + reach) / (1.0 - reach * skew)
                                                 : std::numeric_limits<double>::infinity();
    if (reach < bound) return {plane + bound - reach, plane - bound + reach};
    return {FromCentre(far, position), FromCentre(near, position)};
  }
  double FromCentre(double vergence, const FocusPosition& position) const {
    if (vergence <= 0.0 || std::isinf(vergence)) return vergence;
    return 1.0 / (1.0 / vergence + origin_.At(position).value);
  }

  const PlanRequest& request_;
  const LensPositions& lens_;
  const PositionBlur& blur_;
  const DistanceOrigin& origin_;
  std::vector<std::size_t> positions_;
  std::pair<double, double> n_;
};

std::optional<Error> CheckStack(const PlanRequest& request) {
  const auto bad = [](std::string what, std::string parameter) {
    return Fail(Code::InvalidArgument, std::move(what), {.parameter = std::move(parameter)}).error();
  };
  if (request.focus) return bad("a focus stack chooses its own focal planes: leave out the fixed focus", "focus");
  if (request.limits.empty()) return bad("a focus stack needs at least one sharp limit", "limits");
  for (std::size_t i = 0; i < request.limits.size(); ++i) {
    if (request.limits[i].kind == LimitKind::Sharp) continue;
    return bad("a focus stack only makes things sharp: leave out the blurred limit " + request.limits[i].name,
               "limits[" + std::to_string(i) + "].kind");
  }
  return std::nullopt;
}

std::vector<Need<double>> NeedsOf(const PlanRequest& request, const LensPositions& lens, const DistanceOrigin& origin) {
  const auto coordinate = [&](const PlanDepth& depth) {
    if (!depth.is_vergence) return std::isinf(depth.number.value) ? 0.0 : 1.0 / depth.number.value;
    const double vergence = depth.number.value;
    if (vergence <= 0.0) return vergence;
    // As the position that focuses there sees it.
    const auto focused = std::ranges::lower_bound(
        lens.focus, vergence, {}, [](const FocusPosition& position) { return position.focal_plane.value; });
    const FocusPosition& position = focused == lens.focus.end() ? lens.focus.back() : *focused;
    return 1.0 / (1.0 / vergence + origin.At(position).value);
  };
  std::vector<Need<double>> needs;
  for (const BlurLimit& limit : request.limits) {
    for (const DepthInterval& depths : limit.depths) {
      const auto [far, near] = std::minmax({coordinate(depths.one_end), coordinate(depths.other_end)});
      needs.push_back({far, near, limit.limit.value});
    }
  }
  return Disjoint(needs);
}

/// Leaves out the few positions with far larger bounds than most, where backlash is not taken up: among them what is
/// sharp does not rise with the position.
void KeepSteady(std::vector<std::size_t>& positions, const LensPositions& lens, const PositionBlur& blur) {
  std::vector<double> bounds;
  for (const std::size_t i : positions) bounds.push_back(blur.Bound(lens.focus[i], 0.0));
  const auto middle = bounds.begin() + static_cast<std::ptrdiff_t>(bounds.size() / 2);
  std::ranges::nth_element(bounds, middle);
  constexpr double kFarLarger = 1.5;
  std::erase_if(positions,
                [&, usual = *middle](std::size_t i) { return blur.Bound(lens.focus[i], 0.0) > kFarLarger * usual; });
}

StackAnswer WhyNot(const Cover<double>& cover, const std::vector<Need<double>>& needs, const PositionReach& reach) {
  const auto refuse = [](StackCause cause, std::string reason) {
    return StackAnswer{false, {}, cause, std::move(reason)};
  };
  if (cover.end == CoverEnd::TooMany) {
    return refuse(StackCause::TooMany, "it would take more than " + std::to_string(kMostShotsOfALens) + " shots");
  }
  const Need<double>& need = needs[cover.need];
  if (reach.HighestFor(need.far, need.limit) < 0.0) {
    return refuse(StackCause::TooFar,
                  "the farthest depth asked for is beyond what the farthest focus position keeps sharp");
  }
  if (reach.LowestFor(need.near, need.limit) > reach.last()) {
    return refuse(StackCause::TooNear,
                  "the nearest depth asked for is nearer than what the nearest focus position keeps sharp");
  }
  return refuse(StackCause::Tolerance,
                "the errors of motors and calibration, and diffraction, leave nothing of the depth of focus");
}

}  // namespace

Result<PositionStack> StackOnPositions(const PlanRequest& request, const LensPositions& lens, const FocusBlocks& blocks,
                                       const DistanceOrigin& origin) {
  if (auto error = CheckStack(request)) return PassOn(*std::move(error));
  const PositionBlur blur(request, lens, origin);
  PlanRequest checked =
      blur.AtPosition(lens.focus[lens.focus.size() / 2], lens.iris.front(), PositionBlur::Limits::Included);
  if (auto error = Check(checked)) return PassOn(*std::move(error));
  const std::vector<Need<double>> needs = NeedsOf(request, lens, origin);
  const PositionChoice choice = ChoiceOf(request, lens, blocks, blur);
  std::vector<std::size_t> admitted = choice.focus.All();
  KeepSteady(admitted, lens, blur);
  PositionStack best;
  std::size_t most = kMostShotsOfALens;
  // From the largest f-number, which mostly needs the fewest.
  for (auto j = choice.iris.rbegin(); j != choice.iris.rend(); ++j) {
    const PositionReach reach(request, lens, blur, origin, admitted, blur.FNumbers(lens.iris[*j]));
    const Cover<double> cover = GreedyCover(needs, reach, 0.0, reach.last(), most);
    if (cover.end != CoverEnd::Covered) {
      if (j == choice.iris.rbegin()) best.stack = WhyNot(cover, needs, reach);
      continue;
    }
    most = cover.extensions.size();
    best = {.stack = {.feasible = true, .shots = {}, .reason = {}}, .focus = {}, .iris = *j};
    for (std::size_t shot = 0; shot < most; ++shot) {
      const std::size_t i = reach.At(cover.extensions[shot]);
      const FocusPosition& position = lens.focus[i];
      const auto [far, near] = CoveredAround(needs, reach, cover.extensions[shot], cover.forced_by[shot]);
      best.focus.push_back(i);
      best.stack.shots.push_back({.f_number = lens.iris[*j].f_number,
                                  .extension = position.extension,
                                  .near = blur.Seen(near, position),
                                  .far = blur.Seen(far, position),
                                  .magnification = position.extension / position.focal_length});
    }
  }
  return best;
}

}  // namespace lensd::optics
