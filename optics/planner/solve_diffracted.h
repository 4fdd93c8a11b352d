// Programmes with diffraction.
#pragma once

#include <optional>

#include "optics/planner/solution.h"

namespace lensd::optics {

/// Whether diffraction has a say: there is a wavelength and a sharp limit.
bool CountsDiffraction(const Subproblem& task);

/// As in solve.h.
Solution SolveDiffractedForN(const Subproblem& task);
std::optional<Solution> SolveDiffractedForRatio(const Subproblem& task);

}  // namespace lensd::optics
