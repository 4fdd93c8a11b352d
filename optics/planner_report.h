// What a plan amounts to: blur at every limit, tolerances included, and the figures of the lens.
#pragma once

#include "optics/planner.h"

namespace lensd::optics {

/// Fills everything of a feasible answer but the model and the note from its f-number and extension.
void Describe(const PlanRequest& request, double n, double e, PlanAnswer& answer);

/// The worst ratio of all limits at (N, e).
double WorstRatioAt(const PlanRequest& request, double n, double e);

/// How one limit fares at (N, e).
LimitAnswer Fare(const PlanRequest& request, const BlurLimit& limit, double n, double e);

}  // namespace lensd::optics
