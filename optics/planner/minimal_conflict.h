// Why a request has no plan: a minimal set of names.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "planner/side_assignments.h"

namespace lensd::optics {

/// Of `suspects` (names that are infeasible together) a set from which none can be dropped.
std::vector<int> MinimalConflict(const SideAssignments& cases, const PlanRequest& request,
                                 const std::set<int>& suspects);

/// Names as they appear in answers, limits first.
std::vector<std::string> Spelled(const PlanRequest& request, std::vector<int> names);

}  // namespace lensd::optics
