// Objective::Depth: what stays sharp around a fixed focal plane.
#pragma once

#include "optics/plan_request.h"
#include "optics/planner/limit_lines.h"

namespace lensd::optics {

/// Nearest and farthest vergence where blur stays within the request's depth limit at every extension within the
/// tolerance; far is 0 where that reaches infinity.
struct FieldDepth {
  double near = 0.0;
  double far = 0.0;
};
FieldDepth FieldDepthAt(const PlanRequest& request, double n, double e);

/// With diffraction, which narrows the field again at large f-numbers: the f-number of the greatest depth at extension
/// e among those from `n` (the smallest that the task allows) on that the task allows.
double DeepestN(const Subproblem& task, double n, double e);

}  // namespace lensd::optics
