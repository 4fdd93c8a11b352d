// Columns that double precision cannot decide, handed to the exact solver.
#pragma once

#include "optics/planner_columns.h"

namespace lensd::optics {

/// PlanColumns() in exact arithmetic. Of many limits only those that may matter are taken exactly.
ColumnPlan PlanColumnsExactly(const ColumnLens& lens, const LimitColumns& limits);

}  // namespace lensd::optics
