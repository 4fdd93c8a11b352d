// A plan in words.
#pragma once

#include <string>

#include "base/units.h"
#include "cli/plan/options.h"
#include "optics/planner.h"

namespace lensd::cli {

/// The answer as a compact table, or why there is no plan.
std::string PlanAnswerText(const optics::PlanAnswer& answer, const BlurUnits& units = {},
                           Metres principal_gap = Metres{0.0});

}  // namespace lensd::cli
