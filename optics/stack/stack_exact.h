// Focus stacks in exact arithmetic, for counts that double precision cannot decide.
#pragma once

#include "optics/plan_request.h"
#include "optics/stack/stack_cover.h"

namespace lensd::optics {

/// The greedy cover of the sharp limits of `request` by geometric blur at the decimal f-number (or aperture diameter)
/// `stop`; extensions rounded to doubles. Its cost grows with the square of the shots.
Cover<double> ExactCover(const PlanRequest& request, const Number& stop);

}  // namespace lensd::optics
