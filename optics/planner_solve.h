// Solves one programme: in double precision where an error bound vouches for the verdict, else exactly.
#pragma once

#include <optional>
#include <vector>

#include "planner_task.h"

namespace lensd::optics {

/// A solved programme. Infeasible: `names` are limits and bounds that are infeasible together, not yet minimal.
struct Solved {
  bool feasible = false;
  double n = 0.0;
  double e = 0.0;
  double ratio = 0.0;
  std::vector<int> names = {};
  bool scanned = false;    ///< diffraction made the set non-convex: found by branch and bound over N
  bool undecided = false;  ///< which ended too early to be certain
};

/// Smallest N (largest if `largest`), then the smallest worst ratio. Needs every name in force and N bounded if its
/// (n, e, ratio) are to be used; else only the verdict counts.
Solved SolveForN(const Task& task, bool largest = false);
/// Smallest worst ratio over the range of N, whether or not it is at most 1. Nothing when no ratio is enough.
std::optional<Solved> SolveForRatio(const Task& task);

/// About the ratio of SolveForRatio(), in double precision, for an order of what to solve first; maybe nothing.
std::optional<double> RoughRatio(const Task& task);
/// Whether it is proven, in double precision, that no setting meets every sharp limit times `ratio` and every blurred
/// one over it. False: maybe.
bool CertainlyNeedsMore(const Task& task, double ratio);

/// Without diffraction.
Solved SolveLinearForN(const Task& task, bool largest = false);
std::optional<Solved> SolveLinearForRatio(const Task& task);
/// The same, always in exact arithmetic (verdict and N rational; the ratio to 100 digits).
Solved SolveForNExactly(const Task& task, bool largest);
/// The same with every row taken exactly, however many there are.
Solved SolveRowsExactly(const Task& task, bool largest);
std::optional<Solved> SolveForRatioExactly(const Task& task);

/// Whether diffraction has a say: there is a wavelength and a sharp limit.
bool CountsDiffraction(const Task& task);
/// With diffraction; nothing below `start` is feasible. Exactly: to 100 digits, equal within 1e-80 counting as equal.
Solved SolveDiffractedForN(const Task& task);
Solved SolveDiffractedForNExactly(const Task& task, double start);
std::optional<Solved> SolveDiffractedForRatio(const Task& task);

/// Sign of f U - 1 (or of f - Z): above 0 inside the focal length, 0 at it. Exact; the depth is finite.
int CompareFocalPower(const Number& focal_length, const PlanDepth& depth);

/// Names of the lines and bounds that made the search fail.
template <class T>
std::vector<int> NamesOf(const Programme<T>& programme, const SmallestNResult<T>& result);

/// The strip with N turned round, N' = -N, so that the smallest N' is the largest N. `storage` keeps the lines.
template <class T>
Strip<T> TurnedRound(const Strip<T>& strip, std::vector<T>& storage);

// ---- templates ----

template <class T>
std::vector<int> NamesOf(const Programme<T>& programme, const SmallestNResult<T>& result) {
  std::vector<int> names;
  const auto add = [&](int name) {
    if (name != kDomainName && std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  };
  if (programme.never) return {*programme.never};
  if (programme.focus_outside) {
    add(kFocusName);
    add(programme.focus_bound);
    return names;
  }
  const auto add_pair = [&](const std::optional<Facing<T>>& facing) {
    if (!facing) return;
    add(facing->pair.upper >= 0 ? programme.upper_name[static_cast<std::size_t>(facing->pair.upper)]
                                : programme.high_name);
    add(facing->pair.lower >= 0 ? programme.lower_name[static_cast<std::size_t>(facing->pair.lower)]
                                : programme.low_name);
  };
  add_pair(result.before);
  add_pair(result.last);
  if (result.beyond_cap) add(programme.cap_name);
  if (!programme.strip.n_unbounded) add(kFNumberName);
  return names;
}

template <class T>
Strip<T> TurnedRound(const Strip<T>& strip, std::vector<T>& storage) {
  const std::size_t upper = strip.upper.q.size();
  storage.clear();
  storage.reserve(upper + strip.lower.q.size());
  for (const T& q : strip.upper.q) storage.push_back(-q);
  for (const T& q : strip.lower.q) storage.push_back(-q);
  Strip<T> turned = strip;
  turned.upper.q = std::span<const T>(storage).subspan(0, upper);
  turned.lower.q = std::span<const T>(storage).subspan(upper);
  turned.n_low = strip.cap && *strip.cap < strip.n_high ? T(-*strip.cap) : T(-strip.n_high);
  turned.n_high = -strip.n_low;
  turned.cap = std::nullopt;
  return turned;
}

}  // namespace lensd::optics
