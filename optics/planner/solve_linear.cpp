// Programmes without diffraction: double precision where the filter vouches for it, else exactly.
#include "planner/solve_linear.h"

#include <cmath>
#include <limits>

#include "planner/many_limits.h"
#include "planner/rounding_filter.h"
#include "planner/solve_exact.h"

namespace lensd::optics {

namespace {

enum class Verdict { Feasible, Infeasible, Unsure };

double Double(const Number& number) {
  return number.value;
}

double WidthAt(const FeasibleStrip<double>& strip, double n) {
  const std::optional<ConstraintPair<double>> narrowest = Narrowest(strip, n, n);
  return narrowest ? narrowest->width : std::numeric_limits<double>::infinity();
}

/// How far off the N of a pair's zero may be.
double ZeroError(const WidthError& error, const ConstraintPair<double>& facing, double n) {
  return facing.slope > 0 ? 2.0 * error.at(n) / facing.slope : std::numeric_limits<double>::infinity();
}

Verdict CertifyFeasible(const FeasibleStrip<double>& strip, const SmallestNResult<double>& result,
                        const WidthError& error) {
  if (!result.last) return Verdict::Feasible;
  if (!result.before) return result.last->width > error.at(result.n) ? Verdict::Feasible : Verdict::Unsure;
  constexpr double kRelative = 1e-12;
  const double off = ZeroError(error, *result.before, result.n);
  if (!(off <= kRelative * std::abs(result.n))) return Verdict::Unsure;
  const double beyond = result.n + 2.0 * off;
  if (!strip.n_unbounded && beyond > strip.n_high) return Verdict::Unsure;
  return WidthAt(strip, beyond) > error.at(beyond) ? Verdict::Feasible : Verdict::Unsure;
}

Verdict CertifyInfeasible(const FeasibleStrip<double>& strip, const SmallestNResult<double>& result,
                          const WidthError& error) {
  const double off = result.before ? ZeroError(error, *result.before, result.n) : 0.0;
  const bool past_the_end = !strip.n_unbounded && result.n > strip.n_high;
  if (past_the_end) return result.n - off > strip.n_high ? Verdict::Infeasible : Verdict::Unsure;
  // The narrowest pair does not widen: it must be certainly empty here (and where n may be) and at the far end.
  const ConstraintPair<double>& last = *result.last;
  if (!(last.width < -(error.at(result.n) + std::abs(last.slope) * off))) return Verdict::Unsure;
  if (strip.n_unbounded) return last.slope < -error.slope() ? Verdict::Infeasible : Verdict::Unsure;
  return last.alpha + last.slope * strip.n_high < -error.at(strip.n_high) ? Verdict::Infeasible : Verdict::Unsure;
}

Verdict Certify(const LinearProgram<double>& programme, const FeasibleStrip<double>& strip,
                const SmallestNResult<double>& result, const WidthError& error) {
  if (programme.ill_conditioned || strip.cap) return Verdict::Unsure;
  if (programme.unmeetable) return Verdict::Infeasible;
  return result.feasible ? CertifyFeasible(strip, result, error) : CertifyInfeasible(strip, result, error);
}

bool FocusIsClear(const LinearProgram<double>& programme, const WidthError& error) {
  return programme.low_name != kFocusName || programme.focus_margin > error.at(0.0);
}

}  // namespace

Solution SolveLinearForN(const Subproblem& task, WantedN wanted) {
  LinearProgram<double> programme;
  Write(programme, task, Double);
  const WidthError error(programme);
  if (!FocusIsClear(programme, error)) return SolveForNExactly(task, wanted);
  const bool largest = wanted == WantedN::Largest;
  Solution solved;
  if (programme.focus_outside) {
    solved.names = NamesOf(programme, SmallestNResult<double>{});
    return solved;
  }
  std::vector<double> storage;
  const FeasibleStrip<double> searched = largest ? Mirrored(programme.strip, storage) : programme.strip;
  const SmallestNResult<double> result = SmallestN(searched);
  const Verdict verdict = Certify(programme, searched, result, error);
  if (verdict == Verdict::Unsure) return SolveForNExactly(task, wanted);
  if (verdict == Verdict::Infeasible) {
    solved.names = NamesOf(programme, result);
    return solved;
  }
  solved.feasible = true;
  solved.n = largest ? -result.n : result.n;
  if (!(solved.n > 0.0) || programme.strip.high_unbounded) return solved;
  if (!RatioIsGood(programme.strip, error, solved.n)) return SolveForNExactly(task, wanted);
  const std::optional<LeastRatio<double>> least = LeastRatioAt(programme.strip, solved.n);
  if (!least) return SolveForNExactly(task, wanted);
  solved.e = least->e;
  solved.ratio = least->ratio;
  return solved;
}

std::optional<Solution> SolveLinearForRatio(const Subproblem& task) {
  LinearProgram<double> programme;
  Write(programme, task, Double);
  const WidthError error(programme);
  if (programme.ill_conditioned || programme.strip.cap || !FocusIsClear(programme, error))
    return SolveForRatioExactly(task);
  if (programme.unmeetable || programme.focus_outside) return std::nullopt;
  const std::optional<LeastRatio<double>> least = LeastRatioOver(programme.strip);
  if (!least || !RatioIsGood(programme.strip, error, least->n)) return SolveForRatioExactly(task);
  constexpr double kPart = 1e-11;
  if (least->active && !(error.at(least->n) <= kPart * std::abs(least->active->alpha))) {
    return SolveForRatioExactly(task);  // a ratio that hardly depends on N, or nearly none at all
  }
  return Solution{true, least->n, least->e, least->ratio, {}, false};
}

std::optional<double> RoughRatio(const Subproblem& task) {
  LinearProgram<double> programme;
  Write(programme, task, Double);
  if (programme.unmeetable || programme.focus_outside) return std::nullopt;
  const std::optional<LeastRatio<double>> least = LeastRatioOver(programme.strip);
  return least ? std::optional(least->ratio) : std::nullopt;
}

// Diffraction only adds to blur: what is impossible without it is impossible. The limits' rounding is a change of the
// ratio by an ulp.
bool CertainlyNeedsMore(const Subproblem& task, double ratio) {
  if (!std::isfinite(ratio) || !(ratio > 0.0)) return false;
  LinearProgram<double> programme;
  Write(programme, task, Double);
  if (programme.strip.cap || programme.ill_conditioned) return false;
  for (std::size_t i = 0; i < programme.upper_q.size(); ++i) {
    programme.upper_q[i] *= i < programme.upper_sharp ? ratio : 1.0 / ratio;
  }
  for (std::size_t i = 0; i < programme.lower_q.size(); ++i) {
    programme.lower_q[i] *= i < programme.lower_sharp ? ratio : 1.0 / ratio;
  }
  const WidthError error(programme);
  if (programme.unmeetable || programme.focus_outside || !FocusIsClear(programme, error)) return false;
  const SmallestNResult<double> result = SmallestN(programme.strip);
  return Certify(programme, programme.strip, result, error) == Verdict::Infeasible;
}

}  // namespace lensd::optics
