// Plans: which extension and f-number give this focal plane and these blur limits, on this hardware, for certain.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "optics/plan_request.h"

namespace lensd::optics {

/// Solves a request. No feasible plan is an answer; InvalidArgument or OutOfRange are for requests that make no sense:
/// numbers that are not finite, limits not above zero, ranges the wrong way round or empty, sharp depths that reach the
/// focal length, focusing inside it (names the closest focus), two limits of one name. Pure: any thread, no state.
Result<PlanAnswer> Plan(const PlanRequest& request);

/// The plan of Plan() where there is one, without the time that it takes to say why there is none.
std::optional<PlanAnswer> PlanIfAny(const PlanRequest& request);

}  // namespace lensd::optics
