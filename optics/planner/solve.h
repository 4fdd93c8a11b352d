// Solves one programme, with or without diffraction.
#pragma once

#include <optional>

#include "optics/planner/solution.h"

namespace lensd::optics {

/// The wanted end of N, then the smallest worst ratio. Needs every name in force and N bounded if its
/// (n, e, ratio) are to be used; else only the verdict counts.
Solution SolveForN(const Subproblem& task, WantedN wanted = WantedN::Smallest);
/// Smallest worst ratio over the range of N, whether or not it is at most 1. Nothing when no ratio is enough.
std::optional<Solution> SolveForRatio(const Subproblem& task);

}  // namespace lensd::optics
