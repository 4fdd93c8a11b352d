// Requests that make no sense, each with one clear line.
#pragma once

#include <optional>

#include "optics/plan_request.h"

namespace lensd::optics {

/// Nothing when the request can be planned; else the field that is wrong is named as type PlanRequest of io.lensd.Lens
/// does.
std::optional<Error> Check(const PlanRequest& request);
/// Its two parts: all but the limits, and these.
std::optional<Error> CheckSetting(const PlanRequest& request);
std::optional<Error> CheckLimits(const PlanRequest& request);

}  // namespace lensd::optics
