// Answers that doubles are too short for, over few rows or many.
#pragma once

#include "optics/planner/solution.h"

namespace lensd::optics {

/// As SolveForN() without diffraction. `rough`: what doubles made of it; a good guess saves time, a bad one does no
/// harm.
Solution SolveForNPrecisely(const Subproblem& task, WantedN wanted, const Solution& rough);

}  // namespace lensd::optics
