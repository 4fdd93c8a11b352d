// The filter: double precision first, believed only where rounding cannot have changed the answer.
//
// Every line's P and Q carry a relative error of a few ulp, more the closer the depth comes to the focal length (by
// 1 + P/f), decimal inputs rounded to doubles included. From that follows one bound on the width at N, and from the
// width's slope one on N itself. A verdict closer than that, or an N or a ratio that this error would spoil, is left to
// exact arithmetic.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "planner_task.h"

namespace lensd::optics {

inline double Largest(std::span<const double> values, double least = 0.0) {
  for (const double value : values) least = std::max(least, std::abs(value));
  return least;
}

/// Bounds the rounding error of a width at N: `at(n)`.
class WidthError {
 public:
  explicit WidthError(const Programme<double>& programme) {
    const Strip<double>& strip = programme.strip;
    const double box = std::max(std::abs(strip.low), std::abs(strip.high));
    const bool computed = programme.low_name == kFocusName;  // else its ends are given, and only rounded
    box_ = std::numeric_limits<double>::epsilon() * box;
    p_ = Largest(strip.lower.p, Largest(strip.upper.p, computed ? box : 0.0));
    q_ = Largest(strip.lower.q, Largest(strip.upper.q));
    const double pupil = std::max(programme.lens.pupil, 1.0 / programme.lens.pupil);
    constexpr double kUlps = 12.0;
    unit_ = kUlps * (pupil == 1.0 ? 1.0 : 1.0 + pupil) * (1.0 + p_ / programme.lens.f) *
            std::numeric_limits<double>::epsilon();
    p_ += programme.lens.delta;
  }
  double at(double n) const { return unit_ * (p_ + q_ * std::abs(n)) + box_; }
  double slope() const { return unit_ * q_; }

 private:
  double p_ = 0.0, q_ = 0.0, unit_ = 0.0, box_ = 0.0;
};

/// Whether rounding leaves e and the ratio as good as the limits ask: a small part of the tightest line's reach.
inline bool RatioIsGood(const Strip<double>& strip, const WidthError& error, double n) {
  constexpr double kPart = 2e-12;
  double least = std::numeric_limits<double>::infinity();
  for (const double q : strip.upper.q) least = std::min(least, std::abs(q));
  for (const double q : strip.lower.q) least = std::min(least, std::abs(q));
  return error.at(n) <= kPart * least * n;
}

}  // namespace lensd::optics
