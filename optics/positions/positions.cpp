// Plans on positions that exist: the best pair of them, described as Plan() describes its setting. Where none holds,
// the whole ranges tell whether it is only the steps that stand in the way.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "optics/lens_positions.h"
#include "optics/light.h"
#include "optics/model_ladder.h"
#include "optics/planner/deepest_field.h"
#include "optics/planner/request_check.h"
#include "optics/positions/position_conflict.h"
#include "optics/positions/position_search.h"

namespace lensd::optics {

namespace {

void DescribeLimits(const PositionBlur& blur, const FocusPosition& position, std::pair<double, double> n,
                    PlanAnswer& answer) {
  for (std::size_t k = 0; k < blur.limits(); ++k) {
    const OpeningNeed need = blur.Need(k, position);
    const auto [near, far] = blur.Depths(k, position);
    LimitAnswer fares{.near = {near}, .far = {far}, .limit = {need.limit}, .worst = {}, .at = {need.at}};
    fares.worst = {need.sharp ? std::max(need.Blur(n.first), need.Blur(n.second)) : need.Blur(n.second)};
    fares.ratio = need.Ratio(n.first, n.second);
    if (fares.ratio > 1.0 && fares.ratio <= kPositionHolds) fares.ratio = 1.0;
    answer.worst_ratio = std::max(answer.worst_ratio, fares.ratio);
    answer.limits.push_back(fares);
  }
}

PlanAnswer DescribePoint(const PositionBlur& blur, const PlanRequest& request, const LensPositions& lens,
                         const PositionPair& point) {
  const FocusPosition& position = lens.focus[point.focus];
  const IrisPosition& iris = lens.iris[point.iris];
  PlanAnswer answer;
  answer.feasible = point.ratio <= kPositionHolds;
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
  DescribeLimits(blur, position, blur.FNumbers(iris), answer);
  if (request.objective == Objective::Depth) {
    const PlanRequest there = blur.AtPosition(position, iris, PositionBlur::Limits::LeftOut);
    const FieldDepth field = FieldDepthAt(there, there.f_numbers.low.value, there.extensions.low.value);
    answer.depth_of_field = DepthInterval{PlanDepth::Vergence(field.near), PlanDepth::Vergence(field.far)};
  }
  return answer;
}

/// The request over whole ranges, for a lens that is everywhere what this one is at one position.
PlanRequest WithRanges(const PositionBlur& blur, const PlanRequest& asked, const LensPositions& lens,
                       const PositionPair& point) {
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

Result<PositionPlan> PlanOnPositions(const PlanRequest& request, const LensPositions& lens, const FocusBlocks& blocks,
                                     const DistanceOrigin& origin) {
  const PositionBlur blur(request, lens, origin);
  const PositionPair middle{lens.focus.size() / 2, lens.iris.size() / 2, 0.0};
  if (auto error = Check(WithRanges(blur, request, lens, middle))) return PassOn(*std::move(error));
  const PositionChoice choice = ChoiceOf(request, lens, blocks, blur);
  const PositionPair point = BestPair(request, lens, blocks, blur, choice);
  PositionPlan answer{.plan = {},
                      .continuous_feasible = true,
                      .focus = point.focus,
                      .iris = point.iris,
                      .request = WithRanges(blur, request, lens, point)};
  const PlanRequest& ranges = answer.request;
  answer.plan = DescribePoint(blur, request, lens, point);
  answer.plan.feasible = answer.plan.feasible && choice.focus_reachable;
  if (!answer.plan.feasible) {
    auto continuous = Plan(ranges);
    if (!continuous) return PassOn(continuous);
    answer.continuous_feasible = continuous->feasible;
    if (!continuous->feasible) {
      answer.plan = *std::move(continuous);
      answer.plan.conflict = ConflictOnPositions(request, lens, blocks, origin, answer.plan.conflict);
    }
    if (!answer.continuous_feasible) return answer;
  }
  const ChosenModel model = ModelFor(ranges, answer.plan.limits);
  answer.plan.model = RungName(model.rung);
  answer.plan.model_error = model.error;
  return answer;
}

std::optional<PositionPlan> PlanOnPositionsIfAny(const PlanRequest& request, const LensPositions& lens,
                                                 const FocusBlocks& blocks, const DistanceOrigin& origin) {
  const PositionBlur blur(request, lens, origin);
  const PositionPair middle{lens.focus.size() / 2, lens.iris.size() / 2, 0.0};
  if (Check(WithRanges(blur, request, lens, middle))) return std::nullopt;
  const PositionChoice choice = ChoiceOf(request, lens, blocks, blur);
  const PositionPair point = BestPair(request, lens, blocks, blur, choice);
  if (point.ratio > kPositionHolds || !choice.focus_reachable) return std::nullopt;
  PositionPlan found{.plan = {}, .continuous_feasible = true, .focus = point.focus, .iris = point.iris, .request = {}};
  found.plan.feasible = true;
  found.plan.f_number = lens.iris[point.iris].f_number;
  found.plan.extension = lens.focus[point.focus].extension;
  found.plan.focal_plane = lens.focus[point.focus].focal_plane;
  return found;
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
