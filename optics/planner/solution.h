// What solving one programme gives, and the steps that every number type shares.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "optics/planner/limit_lines.h"

namespace lensd::optics {

/// Which end of the f-numbers that meet every limit.
enum class WantedN { Smallest, Largest };

/// A solved programme. Infeasible: `names` are limits and bounds that are infeasible together, not yet minimal.
struct Solution {
  bool feasible = false;
  double n = 0.0;
  double e = 0.0;
  double ratio = 0.0;
  std::vector<int> names = {};
  bool scanned = false;    ///< diffraction made the set non-convex: found by branch and bound over N
  bool undecided = false;  ///< which ended too early to be certain
};

/// Names of the lines and bounds that made the search fail.
template <class T>
std::vector<int> NamesOf(const LinearProgram<T>& programme, const SmallestNResult<T>& result) {
  std::vector<int> names;
  const auto add = [&](int name) {
    if (name != kDomainName && std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  };
  if (programme.unmeetable) return {*programme.unmeetable};
  if (programme.focus_outside) {
    add(kFocusName);
    add(programme.focus_bound);
    return names;
  }
  const auto add_pair = [&](const std::optional<ConstraintPair<T>>& facing) {
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

/// The strip with N turned round, N' = -N, so that the smallest N' is the largest N. `storage` keeps the lines.
template <class T>
FeasibleStrip<T> Mirrored(const FeasibleStrip<T>& strip, std::vector<T>& storage) {
  const std::size_t upper = strip.upper.q.size();
  storage.clear();
  storage.reserve(upper + strip.lower.q.size());
  for (const T& q : strip.upper.q) storage.push_back(-q);
  for (const T& q : strip.lower.q) storage.push_back(-q);
  FeasibleStrip<T> turned = strip;
  turned.upper.q = std::span<const T>(storage).subspan(0, upper);
  turned.lower.q = std::span<const T>(storage).subspan(upper);
  turned.n_low = strip.cap && *strip.cap < strip.n_high ? T(-*strip.cap) : T(-strip.n_high);
  turned.n_high = -strip.n_low;
  turned.cap = std::nullopt;
  return turned;
}

}  // namespace lensd::optics
