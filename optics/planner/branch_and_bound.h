// Outside the convex range of diffraction: branch and bound over N.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "optics/planner/diffraction_curves.h"

namespace lensd::optics {

/// An upper bound of the strip's width for every N in [a, b], limits times r: geometric blur as at b, diffraction and
/// blurred limits as at a. Nothing where some curve is empty throughout.
template <class T>
std::optional<T> WidthBound(const DiffractionStrip<T>& strip, const T& a, const T& b, const T& r) {
  using std::sqrt;
  const LinearProgram<T>& lines = *strip.lines;
  const LensNumbers<T>& lens = lines.lens;
  T high = lines.strip.high, low = lines.strip.low;
  bool unbounded = lines.strip.high_unbounded;
  const auto lower = [&](const T& value) {
    if (unbounded || value < high) high = value;
    unbounded = false;
  };
  for (std::size_t i = lines.strip.upper.sharp; i < lines.upper_p.size(); ++i) {
    lower(T(lines.upper_p[i] + lines.upper_q[i] * a / r));
  }
  for (std::size_t i = lines.strip.lower.sharp; i < lines.lower_p.size(); ++i) {
    low = std::max<T>(low, lines.lower_p[i] + lines.lower_q[i] * a / r);
  }
  for (const SharpCurve<T>& curve : strip.curves) {
    const T s = curve.stretch;
    const T w = lens.pupil * curve.w, kab = strip.k * s * s * a * b, kfa = strip.k * lens.f * lens.pupil * s * a;
    const T scale = w * w + kab * kab, c = curve.limit * r;
    const T d = c * c * scale - kfa * kfa;
    if (d < 0) return std::nullopt;
    const T middle = lens.f * (w * curve.m - kab * kab), half = s * b * sqrt(d);
    lower(T(lens.pupil * (middle + half) / scale - lens.delta));
    low = std::max<T>(low, lens.pupil * (middle - half) / scale + lens.delta);
  }
  return unbounded ? T(1) : T(high - low);
}

/// Smallest N in [start, end] with limits times r, convex or not, by branch and bound, leftmost box first;
/// widths above -`tolerance` count as zero. What it may
/// miss is a stretch of f-numbers narrower than 1e-15 of themselves, less than a double tells apart.
template <class T>
DiffractionSearch<T> SmallestNByScan(const DiffractionStrip<T>& strip, const T& start, const T& end, const T& r,
                                     const T& tolerance, int most_boxes = 100000) {
  struct Box {
    T a, b;
  };
  DiffractionSearch<T> search;
  if (end < start) return search;
  std::vector<Box> boxes{{start, end}};
  const T narrow(1e-15);
  for (int visited = 0; !boxes.empty(); ++visited) {
    if (visited == most_boxes) {
      search.undecided = true;
      return search;
    }
    const Box box = boxes.back();
    boxes.pop_back();
    const Gap<T> gap = GapAt(strip, box.a, r);
    if (!gap.empty && (gap.unbounded || !(gap.width() < -tolerance))) {
      search.feasible = true;
      search.n = box.a;
      return search;
    }
    const std::optional<T> bound = WidthBound(strip, box.a, box.b, r);
    if (!bound || *bound < -tolerance || box.b - box.a <= narrow * box.b) continue;
    const T middle = (box.a + box.b) / 2;
    boxes.push_back({middle, box.b});
    boxes.push_back({box.a, middle});
  }
  return search;
}

}  // namespace lensd::optics
