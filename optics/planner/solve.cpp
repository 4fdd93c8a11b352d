// The one place where it is decided which solver a programme needs.
#include "optics/planner/solve.h"

#include "optics/planner/solve_diffracted.h"
#include "optics/planner/solve_linear.h"

namespace lensd::optics {

Solution SolveForN(const Subproblem& task, WantedN wanted) {
  return CountsDiffraction(task) ? SolveDiffractedForN(task) : SolveLinearForN(task, wanted);
}

std::optional<Solution> SolveForRatio(const Subproblem& task) {
  return CountsDiffraction(task) ? SolveDiffractedForRatio(task) : SolveLinearForRatio(task);
}

}  // namespace lensd::optics
