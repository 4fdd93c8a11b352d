// Extensions of best focus as tilts. Were the sensor turned, best focus would rise along it by the tangent of the
// angle. Were the target turned, its image would be turned as well: rays of an object plane and of its image meet in
// the lens' plane (Scheimpflug), so the tangents are to each other as the magnification.
#include "rig/focus_map.h"

#include <cmath>

namespace lensd::rig {
namespace {

constexpr double kSteepest = 1.4;  ///< radians: beyond that it is no target that is turned

FocusMapOutcome::Tilt TiltOf(double slope, double sigma, double side, double side_m, double magnification) {
  FocusMapOutcome::Tilt tilt{.rise = Metres{slope * side}, .sigma = Metres{sigma * side}};
  if (!(side_m > 0.0)) return tilt;
  const double tangent = slope * side / side_m;
  tilt.sensor = std::atan(tangent);
  tilt.sensor_sigma = sigma * side / side_m / (1.0 + tangent * tangent);
  if (!(magnification > 0.0)) return tilt;
  if (const double target = std::atan(tangent / magnification); std::abs(target) < kSteepest) tilt.target = target;
  return tilt;
}

}  // namespace

FocusMapOutcome FocusMapOutcomeOf(const autofocus::FocusMap& map, const OpticsTable& optics,
                                  const autofocus::Setup& setup) {
  FocusMapOutcome outcome{.grid = map.grid, .best = Metres{map.best}};
  const auto regions = autofocus::RegionsOf(map.grid);
  for (std::size_t i = 0; i < map.cells.size(); ++i) {
    FocusMapOutcome::Cell cell{.region = regions[i], .found = map.cells[i]};
    if (const auto& at = cell.found.position) {
      cell.position = optics.NativeFromExtension(Metres{*at});
      cell.vergence = optics.VergenceFromExtension(Metres{*at});
    }
    outcome.cells.push_back(std::move(cell));
  }
  if (!map.surface) return outcome;
  const auto& fit = *map.surface;
  const double to_sensor = (optics.FocalLengthAt(outcome.best) + outcome.best).value;
  outcome.magnification = to_sensor * optics.VergenceFromExtension(outcome.best).value;
  FocusMapOutcome::Surface surface;
  const double pixel = setup.pixel_m;
  surface.across = TiltOf(fit.terms[1], fit.sigmas[1], map.width, pixel * map.width_px, outcome.magnification);
  surface.down = TiltOf(fit.terms[2], fit.sigmas[2], map.height, pixel * map.height_px, outcome.magnification);
  if (fit.curved) surface.curvature = Metres{fit.terms[3]};
  surface.curvature_sigma = Metres{fit.sigmas[3]};
  surface.scatter = Metres{fit.scatter};
  surface.left = Metres{map.left};
  // Light that comes together `left` off the sensor has spread by that over the f-number.
  if (setup.blur_px) surface.left_px = map.left / *setup.blur_px;
  surface.used = fit.used;
  outcome.surface = surface;
  return outcome;
}

}  // namespace lensd::rig
