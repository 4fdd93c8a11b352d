#include "planner_model.h"

#include <algorithm>

#include "optics/aperture.h"
#include "optics/conjugates.h"

namespace lensd::optics {

namespace {

/// Smallest and largest f-number that may be chosen, before its tolerance.
std::pair<double, double> FNumberRange(const PlanRequest& request) {
  double low = request.f_numbers.low.value, high = request.f_numbers.high.value;
  if (!request.stops.empty()) {
    const auto by_value = [](const Number& a, const Number& b) { return a.value < b.value; };
    const auto [least, most] = std::minmax_element(request.stops.begin(), request.stops.end(), by_value);
    low = least->value;
    high = most->value;
  }
  if (!request.apertures_are_diameters) return {low, high};
  const double f = request.focal_length.value;
  return {f / high, f / low};
}

}  // namespace

ChosenModel ModelFor(const PlanRequest& request) {
  if (request.liquid) return {.rung = Rung::Thin, .error = Metres{0.0}};
  const auto [n_low, n_high] = FNumberRange(request);
  const double delta = request.sensor_tolerance.value, epsilon = request.f_number_tolerance.value;
  LadderRanges ranges{.focal_length = {request.focal_length.value},
                      .f_number_low = {n_low * (1.0 - epsilon)},
                      .f_number_high = {n_high * (1.0 + epsilon)},
                      .extension_low = {request.extensions.low.value - delta},
                      .extension_high = {request.extensions.high.value + delta},
                      .far = {0.0},
                      .near = {0.0},
                      .convention = request.diffraction,
                      .pupil_factor = request.pupil_factor.value,
                      .calibration_error = request.calibration_error};
  if (request.wavelength) ranges.wavelength = Metres{request.wavelength->value};
  std::optional<Metres> tightest;
  bool first = true;
  for (const BlurLimit& limit : request.limits) {
    if (!tightest || limit.limit.value < tightest->value) tightest = Metres{limit.limit.value};
    for (const DepthInterval& interval : limit.depths) {
      for (const PlanDepth* end : {&interval.one_end, &interval.other_end}) {
        ranges.near = first ? end->vergence() : std::max(ranges.near, end->vergence());
        ranges.far = first ? end->vergence() : std::min(ranges.far, end->vergence());
        first = false;
      }
    }
  }
  return SimplestModel(ranges, request.model_tolerance.value_or(DefaultModelTolerance(tightest, request.pixel)));
}

}  // namespace lensd::optics
