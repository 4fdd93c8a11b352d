// Programmes in exact arithmetic, for what double precision cannot decide.
#pragma once

#include <optional>

#include "optics/planner/solution.h"

namespace lensd::optics {

/// Without diffraction, every row of the task taken: verdict and N rational, the ratio to 100 digits.
Solution SolveRowsExactly(const Subproblem& task, WantedN wanted);
std::optional<Solution> SolveForRatioExactly(const Subproblem& task);

/// With diffraction, to 100 digits, equal within 1e-80 counting as equal. `without`: the solution without it, which is
/// feasible and no larger N.
Solution SolveDiffractedExactly(const Subproblem& task, const Solution& without);

/// Sign of f U - 1 (or of f - Z): above 0 inside the focal length, 0 at it. Exact; the depth is finite.
int CompareFocalPower(const Number& focal_length, const PlanDepth& depth);

}  // namespace lensd::optics
