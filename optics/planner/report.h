// What a plan amounts to: blur at every limit, tolerances included, and the figures of the lens.
#pragma once

#include "optics/plan_request.h"

namespace lensd::optics {

/// Fills all that follows from an f-number and an extension: everything of a feasible answer but the verdict, model and
/// note.
void Describe(const PlanRequest& request, double n, double e, PlanAnswer& answer);

}  // namespace lensd::optics
