#include "planning.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>

namespace lensd::daemon {
namespace {

using drivers::Axis;

/// Every position within the soft limits, with its meaning; none where they are not all finite.
Result<Positions> PositionsOf(const rig::Rig& rig, Axis axis, const std::function<double(Native)>& meaning) {
  const drivers::AxisCapabilities& can = *rig.lens().axes[axis];
  const auto [lowest, highest] = rig.SoftLimits(axis);
  Positions positions;
  std::vector<double> values;
  const double first = std::ceil((lowest.value - can.minimum.value) / can.resolution - 1e-9);
  for (double step = first;; ++step) {
    const Native native{can.minimum.value + step * can.resolution};
    if (native.value > highest.value + 1e-9 * can.resolution) break;
    positions.native.push_back(native);
    values.push_back(meaning(native));
  }
  auto reachable = optics::ReachableValues::Create(values);
  if (!reachable) return PassOn(std::move(reachable));
  positions.values = *std::move(reachable);
  return positions;
}

/// A motor that is not there stands at one end for ever.
Result<Positions> Fixed(double value) {
  auto reachable = optics::ReachableValues::Create(std::span(&value, 1));
  if (!reachable) return PassOn(std::move(reachable));
  return Positions{{}, *std::move(reachable)};
}

/// Half the largest distance between neighbours.
double HalfStep(const std::vector<double>& values) {
  double widest = 0.0;
  for (std::size_t i = 1; i < values.size(); ++i) widest = std::max(widest, values[i] - values[i - 1]);
  return 0.5 * widest;
}

/// Half the largest ratio between neighbours, as a relative tolerance.
double HalfRatio(const std::vector<double>& values) {
  double widest = 1.0;
  for (std::size_t i = 1; i < values.size(); ++i) widest = std::max(widest, values[i] / values[i - 1]);
  return std::sqrt(widest) - 1.0;
}

void RaiseTo(optics::Number& tolerance, const optics::Number& least) {
  if (tolerance.value < least.value) tolerance = least;
}

std::optional<Native> NativeAt(const Positions& positions, std::size_t index) {
  return positions.native.empty() ? std::nullopt : std::optional(positions.native[index]);
}

}  // namespace

std::optional<Planning> PlanningOf(const rig::Rig& rig, const rig::RigConfig& config) {
  const rig::OpticsTable* optics = rig.optics();
  if (optics == nullptr) return std::nullopt;
  const drivers::NominalOptics& nominal = optics->nominal();
  const auto planned = [&nominal](Metres extension) {
    return nominal.liquid ? optics::LiquidExtension(Metres{nominal.focal_length_m}, extension) : extension;
  };
  const auto extension = [optics, planned](Native native) {
    return planned(optics->ExtensionFromNative(native)).value;
  };
  const auto f_number = [optics](Native native) { return optics->FNumberFromNative(native).value; };
  Planning planning;
  planning.principal_gap = config.scale.principal_gap;
  auto focus = optics->has_focus() ? PositionsOf(rig, Axis::Focus, extension)
                                   : Fixed(planned(Metres{nominal.min_extension_m}).value);
  auto iris = optics->has_iris() ? PositionsOf(rig, Axis::Iris, f_number) : Fixed(nominal.min_f_number);
  if (!focus || !iris) return std::nullopt;
  planning.focus = *std::move(focus);
  planning.iris = *std::move(iris);
  optics::PlanRequest& request = planning.defaults;
  request.focal_length = nominal.focal_length_m;
  request.f_numbers = {nominal.min_f_number, nominal.max_f_number};
  request.extensions = {nominal.min_extension_m, nominal.max_extension_m};
  request.liquid = nominal.liquid;
  request.pupil_factor = config.pupil_factor;
  request.sensor_tolerance = HalfStep(planning.focus.values.ascending());
  request.f_number_tolerance = HalfRatio(planning.iris.values.ascending());
  if (const auto* camera = rig.camera(); camera != nullptr && camera->pixel_um > 0.0) {
    request.pixel = Metres{camera->pixel_um * 1e-6};
  }
  return planning;
}

namespace {

/// Requests state extensions; the planner takes a liquid lens' in its own terms.
void InPlannersTerms(optics::PlanRequest& request) {
  if (!request.liquid) return;
  const Metres sensor{request.focal_length.value};
  const auto convert = [&](const optics::Number& number) {
    return optics::Number(optics::LiquidExtension(sensor, Metres{number.value}).value);
  };
  request.extensions = {convert(request.extensions.low), convert(request.extensions.high)};
}

}  // namespace

Result<LensPlan> PlanFor(const Planning& planning, optics::PlanRequest request) {
  InPlannersTerms(request);
  RaiseTo(request.sensor_tolerance, planning.defaults.sensor_tolerance);
  RaiseTo(request.f_number_tolerance, planning.defaults.f_number_tolerance);
  auto answer = optics::PlanOnGrid(request, planning.focus.values, planning.iris.values);
  if (!answer) return PassOn(std::move(answer));
  LensPlan plan{*std::move(answer), std::nullopt, std::nullopt};
  plan.focus = NativeAt(planning.focus, plan.answer.extension_index);
  plan.iris = NativeAt(planning.iris, plan.answer.f_number_index);
  return plan;
}

Result<optics::PlanAnswer> PlanAt(const Planning& planning, optics::PlanRequest request, Metres extension, Metres bound,
                                  FNumber f_number) {
  InPlannersTerms(request);
  if (request.liquid) {
    const Metres sensor{request.focal_length.value};
    const Metres beyond = optics::LiquidExtension(sensor, extension + bound);
    extension = optics::LiquidExtension(sensor, extension);
    bound = beyond - extension;
  }
  request.sensor_tolerance = bound.value;
  RaiseTo(request.f_number_tolerance, planning.defaults.f_number_tolerance);
  const auto extensions = optics::ReachableValues::Create(std::span(&extension.value, 1));
  const auto f_numbers = optics::ReachableValues::Create(std::span(&f_number.value, 1));
  if (!extensions) return std::unexpected(extensions.error());
  if (!f_numbers) return std::unexpected(f_numbers.error());
  auto answer = optics::PlanOnGrid(request, *extensions, *f_numbers);
  if (!answer) return PassOn(std::move(answer));
  return std::move(answer->plan);
}

}  // namespace lensd::daemon
