// The filter: double precision first, believed only where rounding cannot have changed the answer.
//
// Every line's P and Q carry a relative error of a few ulp, more the closer the depth comes to the focal length (by
// 1 + P/f), decimal inputs rounded to doubles included. From that follows one bound on the width at N, and from the
// width's slope one on N itself. A verdict closer than that, or an N or a ratio that this error would spoil, is left to
// exact arithmetic.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "planner/limit_lines.h"

namespace lensd::optics {

/// The largest absolute value, and at least `least`. Four at a time: one maximum waits for the other.
inline double Largest(std::span<const double> values, double least = 0.0) {
  std::array<double, 4> most{least, least, least, least};
  std::size_t i = 0;
  for (; i + 4 <= values.size(); i += 4) {
    for (std::size_t k = 0; k < 4; ++k) most[k] = std::max(most[k], std::abs(values[i + k]));
  }
  for (; i < values.size(); ++i) most[0] = std::max(most[0], std::abs(values[i]));
  return std::max(std::max(most[0], most[1]), std::max(most[2], most[3]));
}

/// Bounds the rounding error of a width at N: `at(n)`. `stretch`: how much steeper than the programme's lines others
/// are that it shall hold for.
class WidthError {
 public:
  explicit WidthError(const LinearProgram<double>& programme, double stretch = 1.0) {
    const FeasibleStrip<double>& strip = programme.strip;
    const double box = std::max(std::abs(strip.low), std::abs(strip.high));
    const bool computed = programme.low_name == kFocusName;  // else its ends are given, and only rounded
    box_ = std::numeric_limits<double>::epsilon() * box;
    p_ = Largest(strip.lower.p, Largest(strip.upper.p, computed ? box : 0.0));
    q_ = stretch * Largest(strip.lower.q, Largest(strip.upper.q));
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
inline bool RatioIsGood(const FeasibleStrip<double>& strip, const WidthError& error, double n) {
  constexpr double kPart = 2e-12;
  const auto all_reach = [&](std::span<const double> lines, double least) {
    bool all = true;
    for (const double q : lines) all &= std::abs(q) >= least;
    return all;
  };
  const double least = error.at(n) / (kPart * n);
  return all_reach(strip.upper.q, least) && all_reach(strip.lower.q, least);
}

}  // namespace lensd::optics
