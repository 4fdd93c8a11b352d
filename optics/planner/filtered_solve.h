// Programmes without diffraction in floating point, of any length of mantissa: what rounding cannot have changed is
// certain (rounding_filter.h), the rest is for a longer one.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "optics/planner/rounding_filter.h"
#include "optics/planner/solution.h"

namespace lensd::optics {

/// The longest mantissa that the machine calculates with: 64 bits on amd64.
using Extended = long double;

/// The double nearest to the number.
inline double ToDouble(const Number& number) {
  return number.value;
}

/// The Extended nearest to the decimal that the number stands for.
Extended ToExtended(const Number& number);

enum class Verdict { Feasible, Infeasible, Unsure };

namespace filter_detail {

template <class T>
T WidthAt(const FeasibleStrip<T>& strip, const T& n) {
  const std::optional<ConstraintPair<T>> narrowest = Narrowest(strip, n, n);
  return narrowest ? narrowest->width : std::numeric_limits<T>::infinity();
}

/// How far off the N of a pair's zero may be.
template <class T>
T ZeroError(const WidthError<T>& error, const ConstraintPair<T>& facing, const T& n) {
  return facing.slope > 0 ? 2 * error.at(n) / facing.slope : std::numeric_limits<T>::infinity();
}

template <class T>
Verdict CertifyFeasible(const FeasibleStrip<T>& strip, const SmallestNResult<T>& result, const WidthError<T>& error) {
  if (!result.last) return Verdict::Feasible;
  if (!result.before) return result.last->width > error.at(result.n) ? Verdict::Feasible : Verdict::Unsure;
  constexpr double kRelative = 1e-12;
  const T off = ZeroError(error, *result.before, result.n);
  if (!(off <= kRelative * std::abs(result.n))) return Verdict::Unsure;
  const T beyond = result.n + 2 * off;
  if (!strip.n_unbounded && beyond > strip.n_high) return Verdict::Unsure;
  return WidthAt(strip, beyond) > error.at(beyond) ? Verdict::Feasible : Verdict::Unsure;
}

template <class T>
Verdict CertifyInfeasible(const FeasibleStrip<T>& strip, const SmallestNResult<T>& result, const WidthError<T>& error) {
  const T off = result.before ? ZeroError(error, *result.before, result.n) : T(0);
  const bool past_the_end = !strip.n_unbounded && result.n > strip.n_high;
  if (past_the_end) return result.n - off > strip.n_high ? Verdict::Infeasible : Verdict::Unsure;
  // The narrowest pair does not widen: it must be certainly empty here (and where n may be) and at the far end.
  const ConstraintPair<T>& last = *result.last;
  if (!(last.width < -(error.at(result.n) + std::abs(last.slope) * off))) return Verdict::Unsure;
  if (strip.n_unbounded) return last.slope < -error.slope() ? Verdict::Infeasible : Verdict::Unsure;
  return last.alpha + last.slope * strip.n_high < -error.at(strip.n_high) ? Verdict::Infeasible : Verdict::Unsure;
}

template <class T>
bool FocusIsClear(const LinearProgram<T>& programme, const WidthError<T>& error) {
  return programme.low_name != kFocusName || programme.focus_margin > error.at(0);
}

}  // namespace filter_detail

template <class T>
Verdict Certify(const LinearProgram<T>& programme, const FeasibleStrip<T>& strip, const SmallestNResult<T>& result,
                const WidthError<T>& error) {
  if (programme.ill_conditioned || strip.cap) return Verdict::Unsure;
  if (programme.unmeetable) return Verdict::Infeasible;
  return result.feasible ? filter_detail::CertifyFeasible(strip, result, error)
                         : filter_detail::CertifyInfeasible(strip, result, error);
}

/// What a number type made of a programme.
template <class Answer>
struct Attempt {
  Answer answer = {};    ///< as far as it went
  bool certain = false;  ///< rounding cannot have changed it
};

/// Smallest or largest N, and there the least worst ratio and its e.
template <class T>
Attempt<Solution> TrySolveForN(const LinearProgram<T>& programme, WantedN wanted) {
  Attempt<Solution> attempt;
  Solution& solved = attempt.answer;
  const WidthError<T> error(programme);
  if (!filter_detail::FocusIsClear(programme, error)) return attempt;
  attempt.certain = true;
  if (programme.focus_outside) {
    solved.names = NamesOf(programme, SmallestNResult<T>{});
    return attempt;
  }
  const bool largest = wanted == WantedN::Largest;
  std::vector<T> storage;
  const FeasibleStrip<T> searched = largest ? Mirrored(programme.strip, storage) : programme.strip;
  const SmallestNResult<T> result = SmallestN(searched);
  const Verdict verdict = Certify(programme, searched, result, error);
  attempt.certain = verdict != Verdict::Unsure;
  if (verdict == Verdict::Infeasible) {
    solved.names = NamesOf(programme, result);
    return attempt;
  }
  solved.feasible = verdict == Verdict::Feasible || result.feasible;
  const T n = largest ? -result.n : result.n;
  solved.n = static_cast<double>(n);
  if (!solved.feasible || !(n > 0) || programme.strip.high_unbounded) return attempt;
  const std::optional<ConstraintPair<T>> decided = largest ? std::nullopt : result.before;
  const std::optional<LeastRatio<T>> least = LeastRatioAt(programme.strip, n, decided);
  attempt.certain = attempt.certain && least &&
                    (RatioIsGood(programme.strip, error, n) || TightLinesAreClear(programme.strip, error, *least));
  if (!least) return attempt;
  solved.e = static_cast<double>(least->e);
  solved.ratio = static_cast<double>(least->ratio);
  return attempt;
}

template <class T, class Convert>
Attempt<Solution> TrySolveForN(const Subproblem& task, WantedN wanted, const Convert& convert) {
  LinearProgram<T> programme;
  Write(programme, task, convert);
  return TrySolveForN(programme, wanted);
}

/// The least worst ratio over all N, and where. No solution where no ratio is large enough.
template <class T>
Attempt<std::optional<Solution>> TrySolveForRatio(const LinearProgram<T>& programme) {
  const WidthError<T> error(programme);
  if (programme.ill_conditioned || programme.strip.cap || !filter_detail::FocusIsClear(programme, error)) return {};
  if (programme.unmeetable || programme.focus_outside) return {std::nullopt, true};
  const std::optional<LeastRatio<T>> least = LeastRatioOver(programme.strip);
  if (!least || !RatioIsGood(programme.strip, error, least->n)) return {};
  constexpr double kPart = 1e-11;
  if (least->active && !(error.at(least->n) <= kPart * std::abs(least->active->alpha))) {
    return {};  // a ratio that hardly depends on N, or nearly none at all
  }
  return {Solution{.feasible = true,
                   .n = static_cast<double>(least->n),
                   .e = static_cast<double>(least->e),
                   .ratio = static_cast<double>(least->ratio)},
          true};
}

template <class T, class Convert>
Attempt<std::optional<Solution>> TrySolveForRatio(const Subproblem& task, const Convert& convert) {
  LinearProgram<T> programme;
  Write(programme, task, convert);
  return TrySolveForRatio(programme);
}

}  // namespace lensd::optics
