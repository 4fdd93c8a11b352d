// Lens states rounded so finely that no pixel changes visibly, so that runs through the same places share rendered
// pictures.
#include "sim/camera/lens_grid.h"

#include <algorithm>
#include <cmath>

namespace lensd::sim {
namespace {

constexpr double kPerPixel = 64.0;            // grid points a pixel of blur, where blur is small
constexpr double kEven = 2.0;                 // px of blur up to which the grid is even; beyond, it is even in log
constexpr double kApertureLog = 1.0 / 256.0;  // spacing of log(aperture diameter)
constexpr double kFocalLog = 1e-6;            // spacing of log(focal length) and of log(magnification)
constexpr double kPlainDistance = 1e-7;       // m, spacing of the sensor distance where there is no lens to focus

/// Even up to `even_px`, then even in log with the same spacing there.
double IndexOf(double blur_px, double even_px) {
  return kPerPixel * (blur_px <= even_px ? blur_px : even_px * (1.0 + std::log(blur_px / even_px)));
}

double BlurOf(double index, double even_px) {
  const double px = index / kPerPixel;
  return px <= even_px ? px : even_px * std::exp(px / even_px - 1.0);
}

void Widen(VergenceSpan& span, double vergence_d) {
  span.far_d = std::min(span.far_d, vergence_d);
  span.near_d = std::max(span.near_d, vergence_d);
}

void WidenBy(VergenceSpan& span, const Surface& surface) {
  if (const auto* map = std::get_if<DepthMapShape>(&surface.shape)) {
    const auto [near, far] = std::minmax_element(map->depth->depth_m.begin(), map->depth->depth_m.end());
    Widen(span, 1.0 / *near);
    Widen(span, 1.0 / *far);
    return;
  }
  const auto& plane = std::get<PlaneShape>(surface.shape);
  const Region& region = surface.region;
  for (const double x : {region.x, region.x + region.w}) {
    for (const double y : {region.y, region.y + region.h}) {
      Widen(span, plane.u0_d + plane.ux_d * (2.0 * x - 1.0) + plane.uy_d * (2.0 * y - 1.0));
    }
  }
}

}  // namespace

VergenceSpan SpanOf(const Scene& scene) {
  VergenceSpan span{1e9, 0.0};
  for (const Surface& surface : scene.surfaces) WidenBy(span, surface);
  for (const LightPoint& light : scene.lights) Widen(span, 1.0 / light.distance_m);
  span.far_d = std::clamp(span.far_d, 0.0, span.near_d);
  return span;
}

/// The extensions that focus on the ends of the scene, and blur gained per metre beyond them.
struct LensGrid::Focus {
  double far_m = 0.0;
  double near_m = 0.0;
  double px_per_m = 1.0;
  double even_px = kEven;  ///< blur up to which the grid is even, as a subject at infinity would show it
};

LensGrid::Focus LensGrid::FocusOf(double focal_length_m, double aperture_m) const {
  // Nothing closer than this can be focused on; it only anchors the grid.
  const double closest_d = 0.9 / focal_length_m;
  const auto image_beyond_f = [&](double vergence_d) {
    const double v = std::min(vergence_d, closest_d);
    return 1.0 / (1.0 / focal_length_m - v) - focal_length_m;
  };
  const double px_per_m = std::max(aperture_m / focal_length_m / pixel_m_, 1e-6);
  // A near subject's blur grows more slowly than that of one at infinity, by which the grid counts.
  const double slower = 1.0 - focal_length_m * std::min(span_.near_d, closest_d);
  return {image_beyond_f(span_.far_d), image_beyond_f(span_.near_d), px_per_m, kEven / slower};
}

LensGrid::Key LensGrid::KeyOf(const OpticalState& state) const {
  Key key;
  key.model = state.model;
  key.magnification = std::llround(std::log(state.magnification) / kFocalLog);
  if (state.model != LensModel::Pinhole) {
    key.aperture = std::llround(std::log(std::max(state.aperture_diameter_m, 1e-9)) / kApertureLog);
  }
  if (state.model != LensModel::Thin) {
    key.extension = std::llround(state.sensor_distance_m / kPlainDistance);
    return key;
  }
  key.focal_length = std::llround(std::log(state.focal_length_m) / kFocalLog);
  const double extension_m = state.sensor_distance_m - state.focal_length_m;
  const Focus focus = FocusOf(std::exp(kFocalLog * static_cast<double>(key.focal_length)),
                              std::exp(kApertureLog * static_cast<double>(key.aperture)));
  const double within = std::clamp(extension_m, focus.far_m, focus.near_m);
  const double beyond = (extension_m - within) * focus.px_per_m;
  const double inside = std::round((within - focus.far_m) * focus.px_per_m * kPerPixel);
  key.extension =
      static_cast<std::int64_t>(inside) + std::llround(std::copysign(IndexOf(std::abs(beyond), focus.even_px), beyond));
  return key;
}

OpticalState LensGrid::StateOf(const Key& key) const {
  OpticalState state;
  state.model = key.model;
  state.magnification = std::exp(kFocalLog * static_cast<double>(key.magnification));
  state.aperture_diameter_m = std::exp(kApertureLog * static_cast<double>(key.aperture));
  if (key.model == LensModel::Pinhole) state.aperture_diameter_m = 0.0;
  if (key.model != LensModel::Thin) {
    state.sensor_distance_m = kPlainDistance * static_cast<double>(key.extension);
    return state;
  }
  state.focal_length_m = std::exp(kFocalLog * static_cast<double>(key.focal_length));
  const Focus focus = FocusOf(state.focal_length_m, state.aperture_diameter_m);
  const auto inside = std::llround((focus.near_m - focus.far_m) * focus.px_per_m * kPerPixel);
  const std::int64_t within = std::clamp<std::int64_t>(key.extension, 0, inside);
  const auto beyond = static_cast<double>(key.extension - within);
  const double extension_m = within == inside && inside > 0
                                 ? focus.near_m
                                 : focus.far_m + static_cast<double>(within) / (kPerPixel * focus.px_per_m);
  const double blur = std::copysign(BlurOf(std::abs(beyond), focus.even_px), beyond);
  state.sensor_distance_m = state.focal_length_m + extension_m + blur / focus.px_per_m;
  return state;
}

}  // namespace lensd::sim
