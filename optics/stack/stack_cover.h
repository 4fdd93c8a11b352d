// The greedy cover of a focus stack at one f-number, in double or in exact rational numbers.
//
// Every depth is named by its conjugate extension a = f² U/(1 - f U), which rises with vergence. In it the blur of a
// sensor at extension e is (e - a)/(N (1 + a/(f p))), linear in both, so that a depth is sharp for extensions between a
// lowest and a highest one that both rise with a. Going from far to near, the farthest depth not yet covered forces
// a shot no nearer than its highest extension; shooting exactly there covers the most of what follows, which is why no
// other cover needs fewer shots.
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace lensd::optics {

/// All depths from `far` to `near` (conjugate extensions, far <= near) shall blur by at most `limit`.
template <class T>
struct Need {
  T far{};
  T near{};
  T limit{};
};

/// Geometric blur at one f-number.
template <class T>
struct GeometricReach {
  T scale{};  ///< f p
  T delta{};  ///< sensor tolerance
  T n{};      ///< f-number times (1 - its tolerance)

  T HighestFor(const T& a, const T& limit) const { return T(a + limit * n * (1 + a / scale) - delta); }
  T LowestFor(const T& a, const T& limit) const { return T(a - limit * n * (1 + a / scale) + delta); }
  /// The nearest depth sharp at extension e; nothing where every nearer depth is.
  std::optional<T> NearestAt(const T& e, const T& limit) const {
    const T left = 1 - limit * n / scale;
    if (!(left > 0)) return std::nullopt;
    return T((e - delta + limit * n) / left);
  }
  T FarthestAt(const T& e, const T& limit) const { return T((e + delta - limit * n) / (1 + limit * n / scale)); }
};

enum class CoverEnd { Covered, TooFar, TooNear, Tolerance, TooMany };

/// Where the shots stand, or which need stopped them.
template <class T>
struct Cover {
  CoverEnd end = CoverEnd::Covered;
  std::vector<T> extensions;
  std::vector<T> forced_by;  ///< for each shot, the depth that could not wait for a nearer one
  std::size_t need = 0;      ///< the need it ended at
};

inline constexpr std::size_t kMostShots = 10000;

namespace stack_detail {

/// How far a cover has come: the farthest depth of each need that is still open.
template <class T>
struct Open {
  T from{};
  bool done = false;
};

/// The open need whose farthest open depth has the smallest highest extension.
template <class T, class Reach>
std::optional<std::size_t> MostUrgent(const std::vector<Need<T>>& needs, const std::vector<Open<T>>& open,
                                      const Reach& reach, T& highest) {
  std::optional<std::size_t> urgent;
  for (std::size_t i = 0; i < needs.size(); ++i) {
    if (open[i].done) continue;
    T here = reach.HighestFor(open[i].from, needs[i].limit);
    if (urgent && !(here < highest)) continue;
    urgent = i;
    highest = here;
  }
  return urgent;
}

/// Takes what a shot at `e` covers off the need. True where that is anything.
template <class T, class Reach>
bool Take(const Need<T>& need, Open<T>& open, const Reach& reach, const T& e) {
  if (reach.LowestFor(open.from, need.limit) > e) return false;
  const std::optional<T> nearest = reach.NearestAt(e, need.limit);
  open.done = need.far == need.near || !nearest || !(*nearest < need.near);
  if (open.done) return true;
  const bool moved = *nearest > open.from;
  if (moved) open.from = *nearest;
  return moved;
}

}  // namespace stack_detail

/// The fewest extensions within [low, high] that cover the needs, given up beyond `most_shots`; needs do not overlap.
template <class T, class Reach>
Cover<T> GreedyCover(const std::vector<Need<T>>& needs, const Reach& reach, const T& low, const T& high,
                     std::size_t most_shots = kMostShots) {
  Cover<T> cover;
  std::vector<stack_detail::Open<T>> open(needs.size());
  for (std::size_t i = 0; i < needs.size(); ++i) open[i].from = needs[i].far;
  for (;;) {
    T e{};
    const auto urgent = stack_detail::MostUrgent(needs, open, reach, e);
    if (!urgent) return cover;
    cover.need = *urgent;
    const T lowest = reach.LowestFor(open[*urgent].from, needs[*urgent].limit);
    if (e < lowest) return cover.end = CoverEnd::Tolerance, cover;
    if (e < low) return cover.end = CoverEnd::TooFar, cover;
    if (lowest > high) return cover.end = CoverEnd::TooNear, cover;
    if (high < e) e = high;
    if (cover.extensions.size() == most_shots) return cover.end = CoverEnd::TooMany, cover;
    const T forced_by = open[*urgent].from;
    bool progress = false;
    for (std::size_t i = 0; i < needs.size(); ++i) {
      if (!open[i].done && stack_detail::Take(needs[i], open[i], reach, e) && i == *urgent) progress = true;
    }
    if (!progress) return cover.end = e == high ? CoverEnd::TooNear : CoverEnd::Tolerance, cover;
    cover.extensions.push_back(e);
    cover.forced_by.push_back(forced_by);
  }
}

/// The stretch of asked-for depths around the one that forced the shot which a shot at `e` covers without a gap.
template <class Reach>
std::pair<double, double> CoveredAround(const std::vector<Need<double>>& needs, const Reach& reach, double e,
                                        double forced_by) {
  std::pair<double, double> stretch{forced_by, forced_by};
  double start = 0.0;
  bool open = false;  // the need before was covered to its end
  for (const Need<double>& need : needs) {
    double far = std::max(need.far, reach.FarthestAt(e, need.limit));
    const double near = std::min(need.near, reach.NearestAt(e, need.limit).value_or(need.near));
    const bool forced_here = forced_by >= need.far && forced_by <= need.near;
    if (forced_here) far = std::min(far, forced_by);
    const bool any = far <= near;
    if (!open || !any || far > need.far) start = far;
    if (any && start <= forced_by) stretch = {start, near};
    open = any && near == need.near;
    if (!open && need.near >= forced_by) break;
  }
  return stretch;
}

namespace stack_detail {

/// Appends a need, or lengthens the last one where it touches and asks for the same.
template <class T>
void Append(std::vector<Need<T>>& needs, Need<T> next) {
  if (!needs.empty() && needs.back().near == next.far && needs.back().limit == next.limit) {
    needs.back().near = next.near;
  } else {
    needs.push_back(std::move(next));
  }
}

}  // namespace stack_detail

/// Needs that overlap at most in their ends, far to near, and ask for the same as `needs`: wherever several hold, the
/// tightest limit wins. A sweep over all ends, which keeps the limits in force.
template <class T>
std::vector<Need<T>> Disjoint(const std::vector<Need<T>>& needs) {
  std::map<T, std::vector<const Need<T>*>> starts;
  std::map<T, std::vector<const Need<T>*>> stops;
  for (const Need<T>& need : needs) {
    starts[need.far].push_back(&need);
    stops[need.near].push_back(&need);
    starts[need.near];
    stops[need.far];
  }
  std::multiset<T> in_force;
  std::vector<Need<T>> disjoint;
  for (auto start = starts.begin(), stop = stops.begin(); start != starts.end(); ++start, ++stop) {
    for (const Need<T>* need : start->second) in_force.insert(need->limit);
    stack_detail::Append(disjoint, {start->first, start->first, *in_force.begin()});
    for (const Need<T>* need : stop->second) in_force.erase(in_force.find(need->limit));
    const auto next = std::next(start);
    if (!in_force.empty()) stack_detail::Append(disjoint, {start->first, next->first, *in_force.begin()});
  }
  return disjoint;
}

}  // namespace lensd::optics
