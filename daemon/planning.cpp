#include "planning.h"

#include <algorithm>
#include <cmath>

namespace lensd::daemon {
namespace {

using drivers::Axis;

/// Half the extension between neighbouring steps, which are evenly spaced.
double HalfStep(const rig::OpticsTable& optics, const drivers::AxisCapabilities& focus) {
  const Native next{focus.minimum.value + focus.resolution};
  return 0.5 * std::abs((optics.ExtensionFromNative(next) - optics.ExtensionFromNative(focus.minimum)).value);
}

/// Steps are evenly spaced in log(f-number): half a step is the same ratio everywhere.
double HalfStepRatio(const rig::OpticsTable& optics, const drivers::AxisCapabilities& iris) {
  const Native next{iris.minimum.value + iris.resolution};
  const double step = std::abs(std::log(optics.FNumberFromNative(next) / optics.FNumberFromNative(iris.minimum)));
  return std::expm1(0.5 * step);
}

}  // namespace

std::optional<Planning> PlanningOf(const rig::Rig& rig, const rig::RigConfig& config) {
  const rig::OpticsTable* optics = rig.optics();
  if (optics == nullptr) return std::nullopt;
  const drivers::NominalOptics& nominal = optics->nominal();
  Planning planning;
  planning.principal_gap = config.scale.principal_gap;
  planning.has_focus = optics->has_focus();
  planning.has_iris = optics->has_iris();
  optics::PlanRequest& request = planning.defaults;
  request.focal_length = nominal.focal_length_m;
  request.f_numbers = {nominal.min_f_number, nominal.max_f_number};
  request.extensions = {nominal.min_extension_m, nominal.max_extension_m};
  request.pupil_factor = config.pupil_factor;
  if (planning.has_focus) request.sensor_tolerance = HalfStep(*optics, *rig.lens().axes[Axis::Focus]);
  if (planning.has_iris) request.f_number_tolerance = HalfStepRatio(*optics, *rig.lens().axes[Axis::Iris]);
  if (const auto* camera = rig.camera(); camera != nullptr && camera->pixel_um > 0.0) {
    request.pixel = Metres{camera->pixel_um * 1e-6};
  }
  return planning;
}

}  // namespace lensd::daemon
