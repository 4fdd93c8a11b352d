// Why a request has no plan: a minimal set of names.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "optics/planner/side_assignments.h"

namespace lensd::optics {

/// Of `suspects` (names that are infeasible together) a set from which none can be dropped.
std::vector<int> MinimalConflict(const SideAssignments& cases, const PlanRequest& request,
                                 const std::set<int>& suspects);

/// All names that a conflict of the request may have.
std::vector<int> EveryName(const PlanRequest& request);

/// Names as they appear in answers, limits first.
std::vector<std::string> Spelled(const PlanRequest& request, std::vector<int> names);
/// And back, in no order.
std::vector<int> Numbered(const PlanRequest& request, const std::vector<std::string>& names);

}  // namespace lensd::optics
