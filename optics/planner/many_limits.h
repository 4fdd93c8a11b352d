// Exact answers over many rows.
#pragma once

#include "planner/solution.h"

namespace lensd::optics {

/// As SolveForN() without diffraction, always in exact arithmetic (verdict and N rational; the ratio to 100 digits).
Solution SolveForNExactly(const Subproblem& task, WantedN wanted);

}  // namespace lensd::optics
