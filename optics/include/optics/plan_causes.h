// What in a request alone prevents a plan.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "optics/plan_request.h"

namespace lensd::optics {

/// From the widest to the smallest aperture that a cause reckons with, as f-numbers.
inline constexpr double kWidestFNumber = 0.5, kSmallestFNumber = 128.0;

/// A plan for a request, of which f-number, extension and focal plane count; nothing where there is none.
using FindsPlan = std::function<std::optional<PlanAnswer>(const PlanRequest&)>;

/// Of a request without a plan: each of its tolerances, its focus, its apertures and its extensions without which
/// `find` finds one. Limits are not among them. Calls `find` at most five times.
std::vector<PlanCause> CausesInRequest(const PlanRequest& request, const FindsPlan& find);

}  // namespace lensd::optics
