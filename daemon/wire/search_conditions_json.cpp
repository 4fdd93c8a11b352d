// Exposure, gain, f-number and filter of a search as the interface writes them, and what became of them.
#include "daemon/wire/search_conditions_json.h"

#include <algorithm>
#include <cmath>

#include "daemon/wire/json_values.h"
#include "daemon/wire/lens_json.h"
#include "daemon/wire/refusal.h"

namespace lensd::daemon {

using varlink::Json;

namespace {

Json ShiftSizeJson(const rig::ShiftSize& size) {
  const auto told = [](bool here, double value, double unit) {
    return here ? varlink::NumberOrNull(value * unit) : Json(nullptr);
  };
  return {{"extensionUm", told(!size.native, size.value, kUmPerMetre)},
          {"sigmaUm", told(!size.native, size.sigma, kUmPerMetre)},
          {"size", told(size.native, size.value, 1.0)},
          {"sizeSigma", told(size.native, size.sigma, 1.0)}};
}

Json MillisecondsOrNull(const std::optional<Duration>& duration) {
  return duration ? Json(Milliseconds(*duration)) : Json(nullptr);
}

}  // namespace

Result<rig::SearchConditions> SearchConditionsOf(const Json& json, const std::string& path) {
  rig::SearchConditions conditions;
  if (const Json* ms = Given(json, "exposureMs")) {
    constexpr double kBeyondMs = 1e12;  // what no camera takes is left to the camera to refuse
    conditions.exposure.exposure = Duration(std::llround(std::clamp(ms->get<double>(), -kBeyondMs, kBeyondMs) * 1e6));
  }
  if (const Json* gain = Given(json, "gain")) conditions.exposure.gain = gain->get<double>();
  if (const Json* f_number = Given(json, "fNumber")) {
    conditions.f_number = FNumber{f_number->get<double>()};
    if (!(conditions.f_number->value > 0.0)) {
      return PassOn(Wrong("an f-number is above 0", {.parameter = path + ".fNumber"}));
    }
  }
  if (const Json* filter = Given(json, "filterPosition")) conditions.filter = Native{filter->get<double>()};
  const auto& exposure = conditions.exposure;
  if (!exposure.exposure && !exposure.gain && !conditions.f_number && !conditions.filter) {
    return PassOn(Wrong("say at least one of exposureMs, gain, fNumber and filterPosition", {.parameter = path}));
  }
  return conditions;
}

Json SearchedUnderJson(const rig::SearchedUnder& under) {
  return {{"exposureMs", MillisecondsOrNull(under.exposure.exposure)},
          {"gain", under.exposure.gain ? varlink::NumberOrNull(*under.exposure.gain) : Json(nullptr)},
          {"fNumber", Optional(under.search.f_number)},
          {"filterPosition", Optional(under.search.filter)},
          {"restored", under.stays.empty()},
          {"stays", TextOrNull(under.stays)},
          {"shift", under.shift ? ShiftSizeJson(*under.shift) : Json(nullptr)},
          {"shiftReason", TextOrNull(under.shift_reason)}};
}

Json FocusShiftJson(const rig::FocusShift& shift) {
  const auto end = [](const auto& pair, auto which) {
    return pair ? varlink::NumberOrNull(((*pair).*which).value) : Json(nullptr);
  };
  using Openings = std::pair<FNumber, FNumber>;
  using Filters = std::pair<Native, Native>;
  return {{"fromFNumber", end(shift.f_numbers, &Openings::first)},
          {"toFNumber", end(shift.f_numbers, &Openings::second)},
          {"fromFilter", end(shift.filters, &Filters::first)},
          {"toFilter", end(shift.filters, &Filters::second)},
          {"focalLengthMm", Optional(shift.focal_length, kMmPerMetre)},
          {"shift", ShiftSizeJson(shift.size)},
          {"pairs", shift.runs},
          {"made", TextOrNull(shift.made)}};
}

}  // namespace lensd::daemon
