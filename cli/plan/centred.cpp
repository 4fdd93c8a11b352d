// Distances as people measure them, turned into depths from the lens centre.

#include <algorithm>
#include <cmath>
#include <utility>

#include "cli/lens_options.h"
#include "cli/plan/reading.h"

namespace lensd::cli {
namespace {

using optics::BlurLimit;
using optics::LimitKind;
using optics::Number;
using optics::PlanDepth;
using optics::PlanRequest;

PlanDepth PlanDepthOf(const Depth& depth) {
  return depth.IsDistance() ? PlanDepth::Distance(NumberOf(depth.exact)) : PlanDepth::Vergence(NumberOf(depth.exact));
}

/// Widest blur difference per dioptre that the ranges allow, A Z_s.
double WidestSlope(const PlanRequest& request) {
  const double f = request.focal_length.value;
  const double widest =
      request.apertures_are_diameters ? request.f_numbers.high.value : f / request.f_numbers.low.value;
  return widest * (f + request.extensions.high.value);
}

/// Runs of depths between which the focal plane cannot stand: where even the widest opening blurs both neighbours by
/// less than the limit together, one of them breaks it, and the run counts as one interval. Exact, and keeps the
/// planner from thousands of gaps that cannot matter. A pupil factor above 1 may blur more, so it gets every gap.
std::vector<std::pair<int, int>> Runs(const OccupiedDepths& depths, const NamedLimit& limit, double blur,
                                      const PlanRequest& request) {
  if (!MayLieOnBothSides(limit)) {
    return {{depths.front(), depths.back()}};
  }
  const double slope = request.pupil_factor.value > 1.0 ? HUGE_VAL : WidestSlope(request);
  const double needed = 2.0 * blur * (1.0 - 1e-9) / slope;
  std::vector<std::pair<int, int>> runs{{depths.front(), depths.front()}};
  for (const int depth : depths) {
    const int last = runs.back().second;
    if (1000.0 / last - 1000.0 / depth >= needed && depth != last) runs.emplace_back(depth, depth);
    runs.back().second = depth;
  }
  return runs;
}

Result<optics::DepthInterval> IntervalFromCentre(const Depth& near, const Depth& far, const Reading& reading,
                                                 const optics::FocusScale& scale, Metres extension) {
  const auto centred = [&](const Depth& depth) {
    return reading.in_focus ? FocusFromCentre(reading.focal_length, depth, scale)
                            : ObjectFromCentre(reading.focal_length, extension, depth, scale);
  };
  const auto nearer = centred(near);
  if (!nearer) return PassOn(nearer);
  const auto farther = centred(far);
  if (!farther) return PassOn(farther);
  return optics::DepthInterval{PlanDepthOf(*nearer), PlanDepthOf(*farther)};
}

Depth Millimetres(int depth) {
  return {Depth::Form::Distance, depth / 1000.0, Decimal(depth, -3)};
}

/// The occupied depths of one limit with the sensor at `extension`.
Result<std::vector<optics::DepthInterval>> DepthsOf(std::size_t index, const Reading& reading,
                                                    const optics::FocusScale& scale, Metres extension) {
  const NamedLimit& limit = reading.limits[index];
  if (const auto* plane = std::get_if<TiltedPlane>(&limit.written.where)) {
    auto interval = optics::DepthsOfPlane(NumberOf(plane->u0), NumberOf(plane->ux), NumberOf(plane->uy));
    if (!interval) return Fail(interval.error().code, limit.written.name + ": " + interval.error().message);
    return std::vector{*std::move(interval)};
  }
  std::vector<DepthRange> ranges;
  if (const auto* mask_class = std::get_if<MaskClass>(&limit.written.where)) {
    for (const auto& [near, far] :
         Runs(reading.classes.at(mask_class->number), limit, reading.blurs[index].Nearest().value(), reading.request)) {
      ranges.push_back({Millimetres(near), Millimetres(far)});
    }
  } else {
    ranges.push_back(std::get<DepthRange>(limit.written.where));
  }
  std::vector<optics::DepthInterval> depths;
  for (const DepthRange& range : ranges) {
    auto interval = IntervalFromCentre(range.near, range.far, reading, scale, extension);
    if (!interval) return Fail(interval.error().code, limit.written.name + ": " + interval.error().message);
    depths.push_back(*std::move(interval));
  }
  return depths;
}

/// Of the sensor at `extension`.
Result<std::vector<BlurLimit>> LimitsOf(const Reading& reading, const optics::FocusScale& scale, Metres extension) {
  std::vector<BlurLimit> limits;
  for (std::size_t i = 0; i < reading.limits.size(); ++i) {
    const NamedLimit& limit = reading.limits[i];
    auto depths = DepthsOf(i, reading, scale, extension);
    if (!depths) return PassOn(depths);
    limits.push_back({.name = limit.written.name,
                      .kind = limit.kind,
                      .depths = *std::move(depths),
                      .limit = NumberOf(reading.blurs[i]),
                      .side = limit.written.side});
  }
  return limits;
}

/// The question with all depths from the lens centre, if the sensor stands at `extension`.
Result<PlanRequest> Centred(const Reading& reading, const optics::FocusScale& scale, Metres extension) {
  PlanRequest request = reading.request;
  if (reading.focus) {
    const auto focus =
        FocusFromCentre(reading.focal_length, *reading.focus, scale, Metres{reading.request.extensions.high.value});
    if (!focus) return PassOn(focus);
    request.focus = PlanDepthOf(*focus);
  }
  auto limits = LimitsOf(reading, scale, extension);
  if (!limits) return PassOn(limits);
  request.limits = *std::move(limits);
  return request;
}

/// Where the sensor stands for the answer to `request`: of the plan, or, where there is none, of the plan for limits
/// relaxed just enough. Nothing where even that does not exist.
struct Standing {
  std::optional<Metres> extension;
  bool feasible = false;
};
Result<Standing> AnswerExtension(PlanRequest request) {
  auto answer = optics::Plan(request);
  if (!answer) return PassOn(answer);
  if (answer->feasible) return Standing{answer->extension, true};
  if (!answer->relax) return Standing{};
  const double factor = *answer->relax * (1.0 + 1e-9);
  for (BlurLimit& limit : request.limits) {
    limit.limit = Number(limit.kind == LimitKind::Sharp ? limit.limit.value * factor : limit.limit.value / factor);
  }
  auto relaxed = optics::Plan(request);
  if (!relaxed) return PassOn(relaxed);
  return Standing{relaxed->feasible ? std::optional(relaxed->extension) : std::nullopt, false};
}

/// Distances from the sensor move with it. Since a subject's image moves far less than the subject (by the square of
/// the magnification), solving and converting again settles within a few rounds.
struct Settled {
  PlanRequest request;
  bool feasible = false;
};
Result<Settled> SettledFrom(const Reading& reading, const optics::FocusScale& scale, Metres extension) {
  constexpr int kMostRounds = 60;
  auto request = Centred(reading, scale, extension);
  if (!request) return PassOn(request);
  Settled settled{*std::move(request), false};
  for (int round = 0; round < kMostRounds; ++round) {
    const auto moved = AnswerExtension(settled.request);
    if (!moved) return PassOn(moved);
    settled.feasible = moved->feasible;
    if (!moved->extension || *moved->extension == extension) break;
    extension = *moved->extension;
    auto next = Centred(reading, scale, extension);
    if (!next) return PassOn(next);
    settled.request = *std::move(next);
  }
  return settled;
}

/// Where the first guess leads to no plan although there is an extension that holds, that one is where to start.
Result<PlanRequest> SettledFromSensor(const Reading& reading, const optics::FocusScale& scale) {
  const auto& [low, high] = reading.request.extensions;
  auto settled = SettledFrom(reading, scale, Metres{0.5 * (low.value + high.value)});
  if (!settled) return PassOn(settled);
  if (settled->feasible) return std::move(settled->request);
  const auto measured = MeasuredFromSensor(reading, scale);
  if (!measured) return PassOn(measured);
  const auto holds = optics::Moves(measured->request) ? optics::ExtensionThatHolds(*measured) : std::nullopt;
  if (!holds) return std::move(settled->request);
  auto again = SettledFrom(reading, scale, *holds);
  return std::move(again && again->feasible ? again->request : settled->request);
}

}  // namespace

Number NumberOf(const Decimal& exact) {
  return {exact.Nearest().value(), exact.Text()};
}

Result<optics::MovingRequest> MeasuredFromSensor(const Reading& reading, const optics::FocusScale& scale) {
  optics::MovingRequest measured{.request = reading.request, .behind = scale.principal_gap + scale.centre_shift};
  auto limits = LimitsOf(reading, {}, Metres{0.0});
  if (!limits) return PassOn(limits);
  measured.request.limits = *std::move(limits);
  if (!reading.focus) return measured;
  const auto focus = FocusFromCentre(reading.focal_length, *reading.focus, scale);
  if (!focus) return PassOn(focus);
  measured.request.focus = PlanDepthOf(*focus);
  return measured;
}

Result<PlanRequest> RequestFromCentre(const Reading& reading, const optics::FocusScale& scale) {
  if (reading.focus) {
    const auto focus =
        FocusFromCentre(reading.focal_length, *reading.focus, scale, Metres{reading.request.extensions.high.value});
    if (!focus) return PassOn(focus);
    const auto stands = Rounded(optics::thin_lens::Extension(reading.focal_length.ToRational(), PlaceOf(*focus)));
    if (!stands) return PassOn(stands);
    return Centred(reading, scale, Metres{*stands});
  }
  const bool moves = scale.from == optics::DistanceFrom::Sensor && !reading.in_focus;
  return moves ? SettledFromSensor(reading, scale) : Centred(reading, scale, Metres{0.0});
}

}  // namespace lensd::cli
