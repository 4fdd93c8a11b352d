// What a plan amounts to: blur at every limit, tolerances included, and the figures of the lens.
#pragma once

#include "optics/planner.h"

namespace lensd::optics {

/// Fills everything of a feasible answer but the model and the note from its f-number and extension.
void Describe(const PlanRequest& request, double n, double e, PlanAnswer& answer);

/// The worst ratio of all limits at (N, e).
double WorstRatioAt(const PlanRequest& request, double n, double e);

/// Whether every limit holds at (N, e), whose worst ratio was worked out; nothing where rounding may have decided it.
std::optional<bool> HoldsForCertain(const PlanRequest& request, double n, double e, double worst_ratio);

/// How one limit fares at (N, e).
LimitAnswer Fare(const PlanRequest& request, const BlurLimit& limit, double n, double e);

}  // namespace lensd::optics
