// The requests that most plans are: every limit at one interval of depths on a given side, in plain numbers.
#pragma once

#include "optics/planner/filtered_solve.h"

namespace lensd::optics {

/// Solves a request that CheckSetting() let pass, in double precision. Certain only where every limit is sound and
/// plain, and doubles are enough; else the limits are still to be checked.
Attempt<Solution> SolvePlainLimits(const PlanRequest& request);

}  // namespace lensd::optics
