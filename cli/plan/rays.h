// The light of a plan: what its limits ask for, through the lens as it would stand.
#pragma once

#include <optional>
#include <string>

#include "cli/charts/ray_diagram.h"
#include "cli/plan/options.h"
#include "optics/planner.h"

namespace lensd::cli {

/// The three limits that are nearest to breaking (or are broken), each at the depth where it fares worst. Nothing where
/// there is no plan, not even one that relaxed limits would allow. `lens` names the lens in the title.
std::optional<RaySystem> PlanRays(const optics::PlanRequest& request, const optics::PlanAnswer& answer,
                                  const std::string& lens, Metres principal_gap = Metres{0.0});

/// Whether --plot and --rays can be written: before any lens moves for them. A stack has no --rays.
std::expected<void, Failure> CheckPlanPlots(const PlanText& text);

/// Writes --rays where it is wanted and there is something to draw. Errors as WritePlot().
std::expected<void, Failure> WriteRays(const PlanText& text, const std::optional<RaySystem>& rays);

}  // namespace lensd::cli
