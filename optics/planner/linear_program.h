// The planner's linear programme in (N, e), in any number type: double for speed, exact for what double cannot decide.
//
// With W = 1 - f U and g = 1 + f U (1/p - 1) the signed blur at depth U is (W e - f² U)/(N g). A limit at one depth is
// therefore a half-plane, and at a given N a bound on e: a line  e <= P + Q N  (upper) or  e >= P + Q N  (lower) with
// P = f² U/W, moved inwards by the sensor tolerance, and |Q| = limit g/W. All lines together with the box on e make a
// strip whose width at N is a concave function, so that the smallest feasible N is found from the left in few steps,
// each ending at an intersection of two lines. Asked for a worst ratio r instead of 1, a sharp line reads P + Q N r and
// a blurred one P + Q N/r: still concave in r.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "optics/planner/row_scan.h"

namespace lensd::optics {

/// Lines that bound e from one side at t = N r (the first `sharp` of them) and at u = N/r (the others).
template <class T>
struct Lines {
  std::span<const T> p;
  std::span<const T> q;
  std::size_t sharp = 0;
};

inline constexpr int kBox = -1;  ///< in a Pair: the box on e instead of a line

/// Which upper and lower line face each other.
struct Pair {
  int upper = kBox;
  int lower = kBox;
  friend bool operator==(const Pair&, const Pair&) = default;
};

/// The programme: lines, a box low <= e <= high, and the range of N.
template <class T>
struct FeasibleStrip {
  Lines<T> upper;
  Lines<T> lower;
  T low{};
  T high{};
  T n_low{};
  T n_high{};
  bool n_unbounded = false;     ///< there is no n_high
  bool n_above_low = false;     ///< n_low itself is excluded
  bool high_unbounded = false;  ///< there is no high
  std::optional<T> cap{};       ///< N <= cap r (a blurred limit exactly at the focal length)
};

/// An upper and a lower line facing each other, this far apart: alpha + sharp N r - floor N/r.
template <class T>
struct ConstraintPair {
  Pair pair;
  T alpha{};
  T sharp{};
  T floor{};
  T width{};
  T slope{};  ///< of the width over N at r = 1
};

namespace strip_detail {

/// The lowest line (sign +1) or the highest (-1), its value in `value`; -1 without lines. Of equals the one that
/// narrows the strip fastest.
template <int sign, class T>
int Outermost(const Lines<T>& lines, const T& t, const T& u, T& value) {
  const std::size_t count = lines.p.size();
  if constexpr (std::is_same_v<T, double>) {
    if (count >= kWorthScanning) {
      const ScannedLine found = (sign > 0 ? LowestLine : HighestLine)(lines.p, lines.q, lines.sharp, t, u);
      value = found.value;
      return found.index;
    }
  }
  const auto beyond = [](const T& a, const T& b) { return sign > 0 ? a < b : a > b; };
  int best = -1;
  for (std::size_t i = 0; i < count; ++i) {
    T v = lines.p[i] + lines.q[i] * (i < lines.sharp ? t : u);
    if (best >= 0 && !beyond(v, value) &&
        !(v == value && beyond(lines.q[i], lines.q[static_cast<std::size_t>(best)]))) {
      continue;
    }
    value = v;
    best = static_cast<int>(i);
  }
  return best;
}

template <class T>
int Lowest(const Lines<T>& lines, const T& t, const T& u, T& value) {
  return Outermost<1>(lines, t, u, value);
}

template <class T>
int Highest(const Lines<T>& lines, const T& t, const T& u, T& value) {
  return Outermost<-1>(lines, t, u, value);
}

}  // namespace strip_detail

/// The pair (upper, lower) as a function of N and r. kBox stands for the box.
template <class T>
ConstraintPair<T> PairOf(const FeasibleStrip<T>& strip, Pair pair) {
  ConstraintPair<T> facing;
  facing.pair = pair;
  T p_upper = strip.high, p_lower = strip.low;
  if (pair.upper >= 0) {
    const auto i = static_cast<std::size_t>(pair.upper);
    p_upper = strip.upper.p[i];
    (i < strip.upper.sharp ? facing.sharp : facing.floor) +=
        i < strip.upper.sharp ? strip.upper.q[i] : T(-strip.upper.q[i]);
    facing.slope += strip.upper.q[i];
  }
  if (pair.lower >= 0) {
    const auto i = static_cast<std::size_t>(pair.lower);
    p_lower = strip.lower.p[i];
    (i < strip.lower.sharp ? facing.sharp : facing.floor) +=
        i < strip.lower.sharp ? T(-strip.lower.q[i]) : strip.lower.q[i];
    facing.slope -= strip.lower.q[i];
  }
  facing.alpha = p_upper - p_lower;
  return facing;
}

/// The narrowest pair at (t, u) = (N r, N/r) other than the box with itself; nothing without lines. Of equals the one
/// that narrows fastest with N.
template <class T>
std::optional<ConstraintPair<T>> Narrowest(const FeasibleStrip<T>& strip, const T& t, const T& u) {
  T highest{}, lowest{};
  const int upper = strip_detail::Lowest(strip.upper, t, u, lowest);
  const int lower = strip_detail::Highest(strip.lower, t, u, highest);
  std::optional<ConstraintPair<T>> best;
  const auto consider = [&](Pair pair, const T& width) {
    if (best && best->width < width) return;
    ConstraintPair<T> facing = PairOf(strip, pair);
    facing.width = width;
    if (!best || width < best->width || facing.slope < best->slope) best = facing;
  };
  if (upper >= 0 && lower >= 0) consider({upper, lower}, lowest - highest);
  if (upper >= 0) consider({upper, kBox}, lowest - strip.low);
  if (lower >= 0 && !strip.high_unbounded) consider({kBox, lower}, strip.high - highest);
  return best;
}

/// How the search for the smallest N ended.
template <class T>
struct SmallestNResult {
  bool feasible = false;
  T n{};
  std::optional<ConstraintPair<T>> last;  ///< the pair that decided: narrowest at n, or never wide enough from n on
  std::optional<ConstraintPair<T>>
      before;               ///< the pair that excludes everything below n; nothing when n is the low end
  bool beyond_cap = false;  ///< infeasible only because of the cap on N
};

/// Smallest N in the strip's range at which some e is left. Newton from the left: the width of the narrowest pair is an
/// upper bound of the strip's, so that nothing feasible lies before its zero; and once the narrowest pair does not
/// widen any more, concavity says that nothing ever will.
template <class T>
SmallestNResult<T> SmallestN(const FeasibleStrip<T>& strip) {
  SmallestNResult<T> result;
  result.n = strip.n_low;
  const auto within = [&](const T& n) {
    if (strip.cap && (n > *strip.cap)) return false;
    return strip.n_unbounded || !(n > strip.n_high);
  };
  for (;;) {
    if (!within(result.n)) {
      result.beyond_cap = strip.cap && result.n > *strip.cap;
      return result;
    }
    std::optional<ConstraintPair<T>> narrowest = Narrowest(strip, result.n, result.n);
    result.last = narrowest;
    const bool at_open_end = strip.n_above_low && !result.before;
    if (at_open_end && strip.cap && !(*strip.cap > result.n)) {
      result.beyond_cap = true;
      return result;
    }
    if (!narrowest || narrowest->width > 0 || (narrowest->width == 0 && (!at_open_end || !(narrowest->slope < 0)))) {
      result.feasible = true;
      return result;
    }
    if (!(narrowest->slope > 0)) return result;
    T next = -narrowest->alpha / narrowest->slope;
    if (!(next > result.n)) {  // the pair's zero is here, up to rounding
      result.feasible = true;
      return result;
    }
    result.before = narrowest;
    result.n = next;
  }
}

/// The smallest worst ratio at one N or over all, and where.
template <class T>
struct LeastRatio {
  T ratio{};
  T n{};
  T e{};
  std::optional<ConstraintPair<T>> active;
};

/// Where alpha + sharp N r - floor N/r = 0: the ratio below which the pair is empty. Nothing when no ratio opens it.
template <class T>
std::optional<T> RatioOf(const ConstraintPair<T>& facing, const T& n) {
  using std::sqrt;
  if (!(facing.floor > 0)) {
    if (!(facing.alpha < 0)) return T(0);
    if (!(facing.sharp > 0)) return std::nullopt;
    return T(-facing.alpha / (facing.sharp * n));
  }
  if (!(facing.sharp > 0)) {
    if (!(facing.alpha > 0)) return std::nullopt;
    return T(facing.floor * n / facing.alpha);
  }
  const T root = sqrt(T(facing.alpha * facing.alpha + 4 * facing.floor * facing.sharp * n * n));
  if (facing.alpha > 0) return T(2 * facing.floor * n / (facing.alpha + root));
  return T((root - facing.alpha) / (2 * facing.sharp * n));
}

namespace strip_detail {

/// A ratio that is certainly not above the least one, and above zero if there are blurred lines.
template <class T>
std::optional<T> RatioToStartFrom(const FeasibleStrip<T>& strip, const T& n) {
  T start = strip.cap ? T(n / *strip.cap) : T(0);
  const auto raise = [&](Pair pair) {
    const std::optional<T> ratio = RatioOf(PairOf(strip, pair), n);
    if (ratio && *ratio > start) start = *ratio;
    return ratio.has_value();
  };
  if (strip.upper.sharp < strip.upper.p.size() && !raise({static_cast<int>(strip.upper.sharp), kBox}))
    return std::nullopt;
  if (strip.lower.sharp < strip.lower.p.size()) {
    const int floor = static_cast<int>(strip.lower.sharp);
    if (!strip.high_unbounded && !raise({kBox, floor})) return std::nullopt;
  }
  return start;
}

}  // namespace strip_detail

/// Smallest worst ratio at `n` > 0 and the smallest e that has it; the middle of the box without lines. Nothing when no
/// ratio is large enough. The width of every pair is concave and rises with r, so stepping from a ratio too small to
/// the zero of the narrowest pair there never passes the answer, and ends on it. `narrow`: a pair that may be the
/// narrowest, to start from.
template <class T>
std::optional<LeastRatio<T>> LeastRatioAt(const FeasibleStrip<T>& strip, const T& n,
                                          const std::optional<ConstraintPair<T>>& narrow = std::nullopt) {
  std::optional<T> start = strip_detail::RatioToStartFrom(strip, n);
  if (start && narrow) start = std::max(start, RatioOf(*narrow, n));
  if (!start) return std::nullopt;
  LeastRatio<T> least;
  least.ratio = *start;
  least.n = n;
  if (strip.upper.p.empty() && strip.lower.p.empty()) {
    least.e = (strip.low + strip.high) / 2;
    return least;
  }
  constexpr int kMostSteps = 1000;
  for (int step = 0; step < kMostSteps; ++step) {
    const T u = least.ratio > 0 ? T(n / least.ratio) : T(0);
    std::optional<ConstraintPair<T>> narrowest = Narrowest(strip, T(n * least.ratio), u);
    if (!narrowest) break;
    const bool settled = least.active && least.active->pair == narrowest->pair;
    if (!least.active || narrowest->width < 0) least.active = narrowest;
    if (settled || !(narrowest->width < 0)) break;
    const std::optional<T> next = RatioOf(*narrowest, n);
    if (!next) return std::nullopt;
    if (!(*next > least.ratio)) break;
    least.ratio = *next;
  }
  const T t = n * least.ratio;
  const T u = least.ratio > 0 ? T(n / least.ratio) : T(0);
  T bound{};
  least.e = strip.low;
  if (strip_detail::Highest(strip.lower, t, u, bound) >= 0 && bound > least.e) least.e = bound;
  if (strip_detail::Lowest(strip.upper, t, u, bound) >= 0 && bound < least.e) least.e = bound;
  if (!strip.high_unbounded && strip.high < least.e) least.e = strip.high;
  if (least.e < strip.low) least.e = strip.low;
  return least;
}

namespace strip_detail {

/// Where two pairs need the same ratio at the same N: linear in (N r, N/r). Nothing when they do not cross.
template <class T>
std::optional<T> CrossingN(const ConstraintPair<T>& a, const ConstraintPair<T>& b) {
  using std::sqrt;
  const T det = a.floor * b.sharp - a.sharp * b.floor;
  if (det == 0) return std::nullopt;
  const T t = (a.alpha * b.floor - a.floor * b.alpha) / det;
  const T u = (b.sharp * a.alpha - a.sharp * b.alpha) / det;
  if (!(t > 0) || !(u > 0)) return std::nullopt;
  return T(sqrt(T(t * u)));
}

/// +1 where the pair's ratio rises with N, -1 where it falls, 0 where it does not depend on N.
template <class T>
int Trend(const LeastRatio<T>& at, const FeasibleStrip<T>& strip) {
  if (strip.cap && !(at.ratio > at.n / *strip.cap)) return 1;
  if (!at.active) return 0;
  if (at.active->alpha < 0) return -1;
  if (!(at.active->floor > 0)) return 0;
  return at.active->alpha > 0 ? 1 : 0;
}

}  // namespace strip_detail

/// Smallest worst ratio over the whole (bounded) range of N, n_low > 0; of equals the smallest N. Each pair's ratio
/// rises or falls with N throughout, so the least worst ratio is at an end of the range or where a falling and a rising
/// one cross; the bracket closes on that crossing.
template <class T>
std::optional<LeastRatio<T>> LeastRatioOver(const FeasibleStrip<T>& strip) {
  std::optional<LeastRatio<T>> left = LeastRatioAt(strip, strip.n_low);
  if (!left || strip_detail::Trend(*left, strip) >= 0) return left;
  std::optional<LeastRatio<T>> right = LeastRatioAt(strip, strip.n_high);
  if (!right || strip_detail::Trend(*right, strip) < 0) return right;
  constexpr int kMostSteps = 1000;
  for (int step = 0; step < kMostSteps; ++step) {
    std::optional<T> crossing;
    if (left->active && right->active) crossing = strip_detail::CrossingN(*left->active, *right->active);
    if (crossing && (!(*crossing > left->n) || !(*crossing < right->n))) crossing = std::nullopt;
    const T n = crossing ? *crossing : T((left->n + right->n) / 2);
    if (!(n > left->n) || !(n < right->n)) break;
    std::optional<LeastRatio<T>> middle = LeastRatioAt(strip, n);
    if (!middle) return std::nullopt;
    if (crossing) {
      const std::optional<T> bound = RatioOf(*left->active, n);  // no ratio near here is smaller
      if (bound && !(middle->ratio > *bound * (1 + 4 * std::numeric_limits<T>::epsilon()))) return middle;
    }
    (strip_detail::Trend(*middle, strip) < 0 ? left : right) = middle;
  }
  return right->ratio < left->ratio ? right : left;
}

}  // namespace lensd::optics
