// The planner's programme with diffraction, in any number type.
//
// A sharp limit now bounds sqrt(b² + b_d²). With w = W/g, m = f U/g (g the pupil divisor), b = |w e - f m|/N and
// b_d = k N (f + e/p), k = 2.44 λ/f: at a given N a quadratic in e, so that the limit leaves a closed-form interval
//   e = p (f w' m - f k² N⁴ ± N √D)/a,   w' = p w,   a = w'² + k² N⁴,   D = c² a - k² f² p² N²,
// empty if D < 0. Blur over a depth interval is largest at an end, so each end bounds e from both sides. b² + b_d² is
// convex in N² too: over a tolerance ε of the f-number it is largest at N (1 - ε) or N (1 + ε), so that each limit
// makes two such curves. While c N/(f p) <= 0.355, or for every N below f p/c if 2 w' c² < k f² p², the set left of the
// plane (N, e) is convex: the strip's width is then concave in N, its tangents are upper bounds, and Newton from the
// left never passes a zero. In r (limits times r) each bound is concave for every N.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "optics/planner/limit_lines.h"

namespace lensd::optics {

/// A sharp limit at one depth.
template <class T>
struct SharpCurve {
  T w{};  ///< W/g
  T m{};  ///< f U/g
  T limit{};
  T stretch{};  ///< 1 - ε or 1 + ε: the f-number at which it holds is N times this
  int name = 0;
};

/// Lines of the blurred limits and the box, curves of the sharp ones.
template <class T>
struct DiffractionStrip {
  const LinearProgram<T>* lines = nullptr;  ///< everything without diffraction: a superset
  std::vector<SharpCurve<T>> curves;
  T k{};
};

/// The extensions at which a curve holds at N with its limit times r, the sensor tolerance not taken off; nothing where
/// diffraction alone breaks it.
template <class T>
struct CurveInterval {
  T low{}, high{};
};
template <class T>
std::optional<CurveInterval<T>> IntervalOf(const SharpCurve<T>& curve, const LensNumbers<T>& lens, const T& k,
                                           const T& n, const T& r) {
  using std::sqrt;
  const T c = curve.limit * r;
  const T w = lens.pupil * curve.w;
  const T held = n * curve.stretch;
  const T kn2 = k * held * held;
  const T a = w * w + kn2 * kn2;
  const T kf = k * lens.f * lens.pupil * held;
  const T d = c * c * a - kf * kf;
  if (d < 0) return std::nullopt;
  const T middle = lens.f * (w * curve.m - kn2 * kn2);
  const T half = held * sqrt(d);
  return CurveInterval<T>{T(lens.pupil * (middle - half) / a), T(lens.pupil * (middle + half) / a)};
}

/// The strip at one (N, r): where its two narrowest bounds are and how they move.
template <class T>
struct Gap {
  bool empty = false;  ///< some curve leaves nothing at all
  int upper_name = kDomainName;
  int lower_name = kDomainName;
  bool unbounded = false;
  T high{}, low{};
  T high_slope_n{}, low_slope_n{};
  T high_slope_r{}, low_slope_r{};
  T width() const { return high - low; }
  T slope_n() const { return high_slope_n - low_slope_n; }
  T slope_r() const { return high_slope_r - low_slope_r; }
};

namespace diffraction_detail {

template <class T>
void Lower(Gap<T>& gap, const T& value, const T& slope_n, const T& slope_r, int name) {
  if (!gap.unbounded && (value > gap.high || (value == gap.high && !(slope_n < gap.high_slope_n)))) return;
  gap.unbounded = false;
  gap.high = value;
  gap.high_slope_n = slope_n;
  gap.high_slope_r = slope_r;
  gap.upper_name = name;
}

template <class T>
void Raise(Gap<T>& gap, const T& value, const T& slope_n, const T& slope_r, int name) {
  if (value < gap.low || (value == gap.low && !(slope_n > gap.low_slope_n))) return;
  gap.low = value;
  gap.low_slope_n = slope_n;
  gap.low_slope_r = slope_r;
  gap.lower_name = name;
}

template <class T>
struct Slopes {
  T n{}, r{};
};

/// How an end of a curve's interval moves with the f-number `n` it holds at, from the quadratic by implicit
/// differentiation.
template <class T>
Slopes<T> SlopesAt(const SharpCurve<T>& curve, const LensNumbers<T>& lens, const T& k, const T& n, const T& r,
                   const T& e) {
  const T s = curve.w * e - lens.f * curve.m;
  const T distance = lens.f + e / lens.pupil;
  const T by_e = 2 * curve.w * s / (n * n) + 2 * k * k * n * n * distance / lens.pupil;
  if (by_e == 0) return {};
  const T by_n = -2 * s * s / (n * n * n) + 2 * k * k * n * distance * distance;
  const T by_r = -2 * curve.limit * curve.limit * r;
  return {T(-by_n / by_e), T(-by_r / by_e)};
}

}  // namespace diffraction_detail

/// The bounds at N > 0 and r > 0.
template <class T>
Gap<T> GapAt(const DiffractionStrip<T>& strip, const T& n, const T& r) {
  const LinearProgram<T>& lines = *strip.lines;
  const LensNumbers<T>& lens = lines.lens;
  Gap<T> gap;
  gap.unbounded = lines.strip.high_unbounded;
  gap.high = lines.strip.high;
  gap.low = lines.strip.low;
  gap.upper_name = lines.high_name;
  gap.lower_name = lines.low_name;
  const T u = n / r;
  for (std::size_t i = lines.strip.upper.sharp; i < lines.upper_p.size(); ++i) {
    const T& q = lines.upper_q[i];
    diffraction_detail::Lower(gap, T(lines.upper_p[i] + q * u), T(q / r), T(-q * u / r), lines.upper_name[i]);
  }
  for (std::size_t i = lines.strip.lower.sharp; i < lines.lower_p.size(); ++i) {
    const T& q = lines.lower_q[i];
    diffraction_detail::Raise(gap, T(lines.lower_p[i] + q * u), T(q / r), T(-q * u / r), lines.lower_name[i]);
  }
  for (const SharpCurve<T>& curve : strip.curves) {
    const std::optional<CurveInterval<T>> interval = IntervalOf(curve, lens, strip.k, n, r);
    if (!interval) {
      gap.empty = true;
      gap.upper_name = gap.lower_name = curve.name;
      return gap;
    }
    const auto& [low, high] = *interval;
    const T held = n * curve.stretch;
    const auto at_high = diffraction_detail::SlopesAt(curve, lens, strip.k, held, r, high);
    const auto at_low = diffraction_detail::SlopesAt(curve, lens, strip.k, held, r, low);
    diffraction_detail::Lower(gap, T(high - lens.delta), T(at_high.n * curve.stretch), at_high.r, curve.name);
    diffraction_detail::Raise(gap, T(low + lens.delta), T(at_low.n * curve.stretch), at_low.r, curve.name);
  }
  return gap;
}

/// A ratio below which some curve is empty at N.
template <class T>
T LeastOpenRatio(const DiffractionStrip<T>& strip, const T& n) {
  using std::sqrt;
  T least{};
  for (const SharpCurve<T>& curve : strip.curves) {
    const T w = strip.lines->lens.pupil * curve.w;
    const T held = n * curve.stretch;
    const T kn2 = strip.k * held * held;
    const T ratio =
        strip.k * strip.lines->lens.f * strip.lines->lens.pupil * held / (curve.limit * sqrt(T(w * w + kn2 * kn2)));
    if (ratio > least) least = ratio;
  }
  return least;
}

/// The smallest worst ratio at N and where, and the sign of its slope over N.
template <class T>
struct DiffractionRatio {
  T ratio{};
  T n{};
  T e{};
  int trend = 0;
};

/// Nothing when no ratio opens the strip. Concave and rising in r: tangents from below, chords from above, until the
/// two meet within `precision`.
template <class T>
std::optional<DiffractionRatio<T>> DiffractionRatioAt(const DiffractionStrip<T>& strip, const T& n,
                                                      const T& precision) {
  const std::optional<LeastRatio<T>> without = LeastRatioAt(strip.lines->strip, n);
  if (!without) return std::nullopt;
  const T open = LeastOpenRatio(strip, n);
  T low = without->ratio > open ? without->ratio : T(open * (1 + precision));
  if (!(low > 0)) low = precision;
  Gap<T> at_low = GapAt(strip, n, low);
  const auto result = [&](const T& ratio, int trend) {
    const Gap<T> gap = GapAt(strip, n, ratio);
    return DiffractionRatio<T>{ratio, n, gap.width() < 0 ? T((gap.low + gap.high) / 2) : gap.low, trend};
  };
  if (!at_low.empty &&
      !(at_low.width() < 0)) {  // blurred limits alone set it, or diffraction alone: smaller N is better
    return result(low, without->ratio > open ? strip_detail::Trend(*without, strip.lines->strip) : 1);
  }
  T high = low * 2;
  Gap<T> at_high = GapAt(strip, n, high);
  for (int doubling = 0; at_high.empty || at_high.width() < 0; ++doubling) {
    if (doubling > 200) return std::nullopt;
    if (!at_high.empty) low = high, at_low = at_high;
    high = high * 2;
    at_high = GapAt(strip, n, high);
  }
  for (int step = 0; step < 2000 && high - low > precision * high; ++step) {
    T next = (low + high) / 2;
    if (!at_low.empty && at_low.slope_r() > 0) {
      const T tangent = low - at_low.width() / at_low.slope_r();
      const T chord = low - at_low.width() * (high - low) / (at_high.width() - at_low.width());
      if (tangent > low && tangent < high) {  // both are nearer than half-way once the bracket is short
        const T beside = tangent + precision * high / 2;
        next = step % 3 == 2                                  ? next
               : step % 3 == 1 && chord > low && chord < high ? chord
               : beside < high                                ? beside
                                                              : tangent;
      }
    }
    if (!(next > low) || !(next < high)) break;
    const Gap<T> middle = GapAt(strip, n, next);
    if (middle.empty || middle.width() < 0) {
      low = next;
      at_low = middle;
    } else {
      high = next;
      at_high = middle;
    }
  }
  // Just below the answer the bounds that set it are the ones that overlap.
  const T slope = at_low.empty ? T(-1) : at_low.slope_n();
  return result(high, slope > 0 ? -1 : slope < 0 ? 1 : 0);
}

/// Whether the strip is convex for every N up to `n`, limits times r.
template <class T>
bool IsConvexUpTo(const DiffractionStrip<T>& strip, const T& n, const T& r) {
  const LensNumbers<T>& lens = strip.lines->lens;
  const T f = lens.f * lens.pupil;
  for (const SharpCurve<T>& curve : strip.curves) {
    const T c = curve.limit * r;
    const T held = n * curve.stretch;
    const bool small = c * held <= 0.355 * f;
    const bool diffracted = 2 * lens.pupil * curve.w * c * c < strip.k * f * f && c * held < f;
    if (!small && !diffracted) return false;
  }
  return true;
}

/// How the search for the smallest N with diffraction ended.
template <class T>
struct DiffractionSearch {
  bool feasible = false;
  bool at_start = false;   ///< feasible where it began: N is the low end
  bool undecided = false;  ///< infeasible as far as was looked: it took too long
  T n{};
  T width{};               ///< at the end of the search
  T slope{};               ///< of the width at the last infeasible N
  std::vector<int> names;  ///< who decided
};

/// Smallest N >= `start` of a convex strip, tangents from the left; widths above -`tolerance` count as zero.
template <class T>
DiffractionSearch<T> SmallestNConvex(const DiffractionStrip<T>& strip, const T& start, const T& end,
                                     const T& tolerance) {
  DiffractionSearch<T> search;
  search.n = start;
  search.at_start = true;
  constexpr int kMostSteps = 2000;
  for (int step = 0; step < kMostSteps; ++step) {
    if (search.n > end) return search;
    const Gap<T> gap = GapAt(strip, search.n, T(1));
    for (const int name : {gap.upper_name, gap.lower_name}) search.names.push_back(name);
    search.width = gap.width();
    if (gap.empty) return search;
    if (gap.unbounded || !(gap.width() < -tolerance)) {
      search.feasible = true;
      return search;
    }
    search.slope = gap.slope_n();
    if (!(search.slope > 0)) return search;
    const T next = search.n - gap.width() / search.slope;
    if (!(next > search.n)) {
      search.feasible = true;
      return search;
    }
    search.at_start = false;
    search.n = next;
  }
  return search;
}

/// The two curves of a sharp limit at one depth; the same one without a tolerance of the f-number.
template <class T>
std::array<SharpCurve<T>, 2> CurvesOf(const DepthNumbers<T>& depth, const LensNumbers<T>& lens, const T& limit,
                                      int name) {
  SharpCurve<T> low{T(depth.w / depth.g), T(depth.v / (lens.f * depth.g)), limit, lens.narrow, name}, high = low;
  high.stretch = lens.widen;
  return {low, high};
}

/// Curves and constants of a task whose lines are written already.
template <class T, class Convert>
DiffractionStrip<T> WriteCurves(const LinearProgram<T>& lines, const Subproblem& task, const T& wavelength_factor,
                                const Convert& convert) {
  DiffractionStrip<T> strip;
  strip.lines = &lines;
  strip.k = wavelength_factor / lines.lens.f;
  for (const LimitRow& row : task.rows) {
    if (row.kind != RowKind::SharpFar && row.kind != RowKind::SharpNear) continue;
    const auto curves = CurvesOf(NumbersOf(*row.depth, lines.lens, convert), lines.lens, convert(*row.limit), row.name);
    strip.curves.insert(strip.curves.end(), curves.begin(),
                        lines.lens.widen > lines.lens.narrow ? curves.end() : curves.begin() + 1);
  }
  return strip;
}

}  // namespace lensd::optics
