// Asks again without one thing after the other.
#include "optics/plan_causes.h"

#include <algorithm>
#include <string>
#include <utility>

#include "base/quantity_text.h"

namespace lensd::optics {
namespace {

std::string RangeText(const std::string& low, const std::string& high) {
  return low == high ? low : low + " to " + high;
}

std::string AskedApertures(const PlanRequest& request) {
  const auto text = [&](const Number& given) {
    return request.apertures_are_diameters ? LengthText(Metres{given.value}, 3) : "f/" + Short(given.value);
  };
  std::string apertures = RangeText(text(request.f_numbers.low), text(request.f_numbers.high));
  for (std::size_t i = 0; i < request.stops.size(); ++i) {
    apertures = (i == 0 ? "" : apertures + ", ") + text(request.stops[i]);
  }
  return "the apertures that it may have (" + apertures + ")";
}

/// Every aperture there is.
void FreeApertures(PlanRequest& request) {
  request.stops.clear();
  request.apertures_are_diameters = false;
  request.f_numbers = {kWidestFNumber, kSmallestFNumber};
}

/// From infinity to life size.
void FreeExtensions(PlanRequest& request) {
  NumberRange& range = request.extensions;
  if (range.low.value > 0.0) range.low = 0.0;
  if (range.high.value < request.focal_length.value) range.high = request.focal_length.value;
}

std::string FocusText(Dioptres plane) {
  return plane.value > 0.0 ? LengthText(Metres{1.0 / plane.value}, 4) + " from the lens centre" : "infinity";
}

}  // namespace

std::vector<PlanCause> CausesInRequest(const PlanRequest& request, const FindsPlan& find) {
  std::vector<PlanCause> causes;
  const auto without = [&](const char* cause, const auto& lift, const auto& reason) {
    PlanRequest lifted = request;
    lift(lifted);
    if (const auto plan = find(lifted)) causes.push_back({cause, reason(*plan)});
  };
  if (request.sensor_tolerance.value > 0.0) {
    without(
        "sensorTolerance", [](PlanRequest& lifted) { lifted.sensor_tolerance = 0.0; },
        [&](const PlanAnswer&) {
          return "the sensor tolerance of " + LengthText(Metres{request.sensor_tolerance.value}, 3) +
                 ": a smaller one by --sensor-tolerance";
        });
  }
  if (request.f_number_tolerance.value > 0.0) {
    without(
        "fNumberTolerance", [](PlanRequest& lifted) { lifted.f_number_tolerance = 0.0; },
        [&](const PlanAnswer&) {
          return "the f-number tolerance of " + Short(request.f_number_tolerance.value * 100.0, 3) +
                 " %: a smaller one by --f-number-tolerance";
        });
  }
  if (request.focus && request.objective != Objective::Depth) {
    without(
        "focus", [](PlanRequest& lifted) { lifted.focus.reset(); },
        [](const PlanAnswer& plan) {
          return "the focus that is asked for: focus at " + FocusText(plan.focal_plane) + " would do";
        });
  }
  without("fNumber", FreeApertures, [&](const PlanAnswer& plan) {
    return AskedApertures(request) + ": f/" + Short(plan.f_number.value, 3) + " would do";
  });
  if (!request.liquid) {
    without("extension", FreeExtensions, [&](const PlanAnswer& plan) {
      const auto text = [](const Number& given) { return LengthText(Metres{given.value}, 4); };
      return "the extensions that it may have (" +
             RangeText(text(request.extensions.low), text(request.extensions.high)) +
             "): " + LengthText(plan.extension, 4) + " would do";
    });
  }
  return causes;
}

}  // namespace lensd::optics
