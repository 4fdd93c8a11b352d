// Which rung of the ladder of camera models a request needs.
#pragma once

#include "optics/model_ladder.h"
#include "optics/planner.h"

namespace lensd::optics {

/// The simplest rung that leaves out no more than the request's model tolerance, whatever plan is chosen.
ChosenModel ModelFor(const PlanRequest& request);

}  // namespace lensd::optics
