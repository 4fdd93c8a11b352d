// Programmes without diffraction: double precision where an error bound vouches for it, else exactly.
#pragma once

#include <optional>

#include "optics/planner/solution.h"

namespace lensd::optics {

/// As in solve.h.
Solution SolveLinearForN(const Subproblem& task, WantedN wanted = WantedN::Smallest);
std::optional<Solution> SolveLinearForRatio(const Subproblem& task);

/// About the ratio of SolveLinearForRatio(), in double precision, for an order of what to solve first; maybe nothing.
std::optional<double> RoughRatio(const Subproblem& task);
/// Whether it is proven, in double precision, that no setting meets every sharp limit times `ratio` and every blurred
/// one over it, with diffraction or without. False: maybe.
bool CertainlyNeedsMore(const Subproblem& task, double ratio);

}  // namespace lensd::optics
