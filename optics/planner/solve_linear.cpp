// Programmes without diffraction: in double precision where the filter vouches for it, else with a longer mantissa,
// else exactly. Each is at least ten times slower than the one before, and hardly ever needed.
#include "optics/planner/solve_linear.h"

#include <cmath>

#include "optics/planner/filtered_solve.h"
#include "optics/planner/many_limits.h"
#include "optics/planner/solve_exact.h"

namespace lensd::optics {

Solution SolveLinearForN(const Subproblem& task, WantedN wanted) {
  Attempt<Solution> rough = TrySolveForN<double>(task, wanted, ToDouble);
  return rough.certain ? std::move(rough.answer) : SolveForNPrecisely(task, wanted, rough.answer);
}

std::optional<Solution> SolveLinearForRatio(const Subproblem& task) {
  if (const auto solved = TrySolveForRatio<double>(task, ToDouble); solved.certain) return solved.answer;
  if (const auto solved = TrySolveForRatio<Extended>(task, ToExtended); solved.certain) return solved.answer;
  return SolveForRatioExactly(task);
}

std::optional<double> RoughRatio(const Subproblem& task) {
  LinearProgram<double> programme;
  Write(programme, task, ToDouble);
  if (programme.unmeetable || programme.focus_outside) return std::nullopt;
  const std::optional<LeastRatio<double>> least = LeastRatioOver(programme.strip);
  return least ? std::optional(least->ratio) : std::nullopt;
}

// Diffraction only adds to blur: what is impossible without it is impossible. The limits' rounding is a change of the
// ratio by an ulp.
bool CertainlyNeedsMore(const Subproblem& task, double ratio) {
  if (!std::isfinite(ratio) || !(ratio > 0.0)) return false;
  LinearProgram<double> programme;
  Write(programme, task, ToDouble);
  if (programme.strip.cap || programme.ill_conditioned) return false;
  for (std::size_t i = 0; i < programme.upper_q.size(); ++i) {
    programme.upper_q[i] *= i < programme.strip.upper.sharp ? ratio : 1.0 / ratio;
  }
  for (std::size_t i = 0; i < programme.lower_q.size(); ++i) {
    programme.lower_q[i] *= i < programme.strip.lower.sharp ? ratio : 1.0 / ratio;
  }
  const WidthError<double> error(programme);
  if (programme.unmeetable || programme.focus_outside || !filter_detail::FocusIsClear(programme, error)) return false;
  const SmallestNResult<double> result = SmallestN(programme.strip);
  return Certify(programme, programme.strip, result, error) == Verdict::Infeasible;
}

}  // namespace lensd::optics
