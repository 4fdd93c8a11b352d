#include "planning.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>

#include "optics/conjugates.h"

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

/// What calibration, temperature and focal length leave open, at worst over the focus positions.
struct Uncertainty {
  double extension = 0.0;  ///< metres, of where the plane in focus is sharp
  double blur = 0.0;       ///< relative, of the size of a blur: it goes with the square of the focal length
  double nominal = 0.0;    ///< metres: how far the nominal extension is from the calibrated one
};

Uncertainty UncertaintyOf(const rig::OpticsTable& optics, const Positions& focus) {
  constexpr std::size_t kSamples = 256;
  Uncertainty worst;
  const double tolerance = optics.FocalLengthError();
  const double square = (1.0 + tolerance) * (1.0 + tolerance);
  worst.blur = square - 1.0;
  if (optics.nominal().liquid) return worst;  // its power is what moves: no breathing, and no curve but the nominal one
  const double focal_length = optics.focal_length().value;
  const std::size_t count = focus.native.size();
  for (std::size_t i = 0; i < kSamples && count > 0; ++i) {
    const Native native = focus.native[i * (count - 1) / (kSamples - 1)];
    const Metres extension = optics.ExtensionFromNative(native);
    const double to_sensor = focal_length + PlanExtension(optics, extension).value;
    const double f = optics.FocalLengthAt(extension).value;
    const double scale = f * (f + extension.value) / (focal_length * to_sensor);
    // dU/de = 1/Z_s².
    worst.extension = std::max(worst.extension, optics.VergenceError(native).value * to_sensor * to_sensor);
    worst.blur = std::max(worst.blur, std::max(scale, 1.0 / scale) * square - 1.0);
    if (optics.grade() != rig::Grade::Uncalibrated) {
      worst.nominal = std::max(worst.nominal, std::abs((optics.NominalExtension(native) - extension).value));
    }
  }
  return worst;
}

void RaiseTo(optics::Number& tolerance, const optics::Number& least) {
  if (tolerance.value < least.value) tolerance = least;
}

std::optional<Native> NativeAt(const Positions& positions, std::size_t index) {
  return positions.native.empty() ? std::nullopt : std::optional(positions.native[index]);
}

}  // namespace

Metres PlanExtension(const rig::OpticsTable& optics, Metres extension) {
  const bool breathes = !optics.nominal().liquid && optics.FocalLengthAt(extension) != optics.focal_length();
  if (!breathes) return extension;
  return optics::Extension(optics.focal_length(), optics.VergenceFromExtension(extension));
}

std::optional<Metres> PlanBound(const rig::OpticsTable& optics, const rig::MoveOutcome& outcome) {
  if (!outcome.extension || !outcome.extension_bound || !outcome.vergence_bound) return std::nullopt;
  if (optics.nominal().liquid) return outcome.extension_bound;
  const double to_sensor = (optics.FocalLengthAt(*outcome.extension) + *outcome.extension).value;
  return std::max(*outcome.extension_bound, Metres{outcome.vergence_bound->value * to_sensor * to_sensor});
}

std::optional<Planning> PlanningOf(const rig::Rig& rig, const rig::RigConfig& config) {
  const rig::OpticsTable* optics = rig.optics();
  if (optics == nullptr) return std::nullopt;
  const drivers::NominalOptics& nominal = optics->nominal();
  const auto planned = [optics, &nominal](Metres extension) {
    return nominal.liquid ? optics::LiquidExtension(Metres{nominal.focal_length_m}, extension)
                          : PlanExtension(*optics, extension);
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
  request.focal_length = optics->focal_length().value;
  request.f_numbers = {nominal.min_f_number, nominal.max_f_number};
  request.extensions = {nominal.min_extension_m, nominal.max_extension_m};
  request.liquid = nominal.liquid;
  request.pupil_factor = config.pupil_factor;
  const auto& extensions = planning.focus.values.ascending();
  const auto& f_numbers = planning.iris.values.ascending();
  if (optics->grade() != rig::Grade::Uncalibrated) {
    request.f_numbers = {f_numbers.front(), f_numbers.back()};
    request.extensions = {extensions.front(), extensions.back()};
  }
  const Uncertainty unsure = UncertaintyOf(*optics, planning.focus);
  request.sensor_tolerance = HalfStep(extensions) + unsure.extension;
  const double ratio = (1.0 + HalfRatio(f_numbers)) * (1.0 + optics->FNumberError()) * (1.0 + unsure.blur);
  request.f_number_tolerance = std::min(ratio - 1.0, 0.9);
  request.calibration_error = Metres{unsure.nominal};
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
