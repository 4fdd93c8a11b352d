// One pass finds the extreme value, a second one the first line that has it. Lines are added and multiplied exactly as
// one by one, so that the verdict and the answer do not hang on the processor.
#include "optics/planner/row_scan.h"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "optics/planner/row_scan.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lensd::optics::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::ScalableTag<double>;
using Vec = hn::Vec<Doubles>;

/// sign +1: the lower one, -1: the higher.
template <int sign>
HWY_INLINE Vec Beyond(Vec a, Vec b) {
  return sign > 0 ? hn::Min(a, b) : hn::Max(a, b);
}

template <int sign>
HWY_INLINE bool IsBeyond(double a, double b) {
  return sign > 0 ? a < b : a > b;
}

/// Lines [from, to) at one t.
struct Stretch {
  const double* p;
  const double* q;
  std::size_t from, to;
  double t;

  HWY_INLINE Vec At(std::size_t i, Vec at) const {
    const Doubles d;
    return hn::Add(hn::LoadU(d, p + i), hn::Mul(hn::LoadU(d, q + i), at));
  }
  HWY_INLINE double At(std::size_t i) const { return p[i] + q[i] * t; }
};

template <int sign>
HWY_INLINE double ExtremeValue(const Stretch& lines, double best) {
  const Doubles d;
  const std::size_t lanes = hn::Lanes(d);
  const Vec at = hn::Set(d, lines.t);
  Vec first = hn::Set(d, best), second = first, third = first, fourth = first;
  std::size_t i = lines.from;
  for (; i + 4 * lanes <= lines.to; i += 4 * lanes) {
    first = Beyond<sign>(lines.At(i, at), first);
    second = Beyond<sign>(lines.At(i + lanes, at), second);
    third = Beyond<sign>(lines.At(i + 2 * lanes, at), third);
    fourth = Beyond<sign>(lines.At(i + 3 * lanes, at), fourth);
  }
  for (; i + lanes <= lines.to; i += lanes) first = Beyond<sign>(lines.At(i, at), first);
  const Vec all = Beyond<sign>(Beyond<sign>(first, second), Beyond<sign>(third, fourth));
  best = hn::GetLane(sign > 0 ? hn::MinOfLanes(d, all) : hn::MaxOfLanes(d, all));
  for (; i < lines.to; ++i) {
    if (IsBeyond<sign>(lines.At(i), best)) best = lines.At(i);
  }
  return best;
}

/// Takes line i, whose value is the extreme one, if it is the better of the equals.
template <int sign>
HWY_INLINE void Take(const Stretch& lines, std::size_t i, int& best) {
  if (best < 0 || IsBeyond<sign>(lines.q[i], lines.q[best])) best = static_cast<int>(i);
}

template <int sign>
HWY_INLINE void FindAt(const Stretch& lines, double value, int& best) {
  const Doubles d;
  const std::size_t lanes = hn::Lanes(d);
  const Vec at = hn::Set(d, lines.t), wanted = hn::Set(d, value);
  std::size_t i = lines.from;
  for (; i + lanes <= lines.to; i += lanes) {
    if (HWY_LIKELY(hn::AllFalse(d, hn::Eq(lines.At(i, at), wanted)))) continue;
    for (std::size_t k = i; k < i + lanes; ++k) {
      if (lines.At(k) == value) Take<sign>(lines, k, best);
    }
  }
  for (; i < lines.to; ++i) {
    if (lines.At(i) == value) Take<sign>(lines, i, best);
  }
}

template <int sign>
ScannedLine Scan(std::span<const double> p, std::span<const double> q, std::size_t sharp, double t, double u) {
  if (p.empty()) return {};
  const std::size_t split = t == u ? p.size() : sharp;
  const Stretch first{p.data(), q.data(), 0, split, t}, second{p.data(), q.data(), split, p.size(), u};
  constexpr double kNone = sign * std::numeric_limits<double>::infinity();
  ScannedLine found;
  found.value = ExtremeValue<sign>(second, ExtremeValue<sign>(first, kNone));
  FindAt<sign>(first, found.value, found.index);
  FindAt<sign>(second, found.value, found.index);
  return found;
}

ScannedLine Lowest(std::span<const double> p, std::span<const double> q, std::size_t sharp, double t, double u) {
  return Scan<1>(p, q, sharp, t, u);
}

ScannedLine Highest(std::span<const double> p, std::span<const double> q, std::size_t sharp, double t, double u) {
  return Scan<-1>(p, q, sharp, t, u);
}

}  // namespace lensd::optics::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lensd::optics {

HWY_EXPORT(Lowest);
HWY_EXPORT(Highest);

ScannedLine LowestLine(std::span<const double> p, std::span<const double> q, std::size_t sharp, double t, double u) {
  return HWY_DYNAMIC_DISPATCH(Lowest)(p, q, sharp, t, u);
}

ScannedLine HighestLine(std::span<const double> p, std::span<const double> q, std::size_t sharp, double t, double u) {
  return HWY_DYNAMIC_DISPATCH(Highest)(p, q, sharp, t, u);
}

}  // namespace lensd::optics
#endif  // HWY_ONCE
