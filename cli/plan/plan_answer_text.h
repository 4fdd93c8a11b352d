// A plan in words.
#pragma once

#include <string>
#include <vector>

#include "base/units.h"
#include "cli/plan/options.h"
#include "optics/planner.h"

namespace lensd::cli {

/// Of the request's limits, in their order.
std::vector<std::string> NamesOf(const optics::PlanRequest& request);

/// The answer as a compact table, or why there is no plan; `names` are those of its limits.
std::string PlanAnswerText(const std::vector<std::string>& names, const optics::PlanAnswer& answer,
                           const BlurUnits& units = {}, Metres principal_gap = Metres{0.0});

}  // namespace lensd::cli
