// The filter: floating point first, believed only where rounding cannot have changed the answer.
//
// Every line's P and Q carry a relative error of a few ulp, more the closer the depth comes to the focal length (by
// 1 + P/f), decimal inputs rounded to the type included. From that follows one bound on the width at N, and from the
// width's slope one on N itself. A verdict closer than that, or an N or a ratio that this error would spoil, is left to
// a longer mantissa, and in the end to exact arithmetic.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "optics/planner/limit_lines.h"

namespace lensd::optics {

/// The largest absolute value, and at least `least`. Four at a time: one maximum waits for the other.
template <class T>
T Largest(std::span<const T> values, T least = T(0)) {
  std::array<T, 4> most{least, least, least, least};
  std::size_t i = 0;
  for (; i + 4 <= values.size(); i += 4) {
    for (std::size_t k = 0; k < 4; ++k) most[k] = std::max(most[k], std::abs(values[i + k]));
  }
  for (; i < values.size(); ++i) most[0] = std::max(most[0], std::abs(values[i]));
  return std::max(std::max(most[0], most[1]), std::max(most[2], most[3]));
}

/// Bounds the rounding error of a width at N: `at(n)`, for a programme in T.
template <class T>
class WidthError {
 public:
  /// `stretch`: how much steeper than the programme's lines others are that it shall hold for.
  explicit WidthError(const LinearProgram<T>& programme, T stretch = T(1)) {
    const FeasibleStrip<T>& strip = programme.strip;
    const T box = std::max(std::abs(strip.low), std::abs(strip.high));
    const bool computed = programme.low_name == kFocusName;  // else its ends are given, and only rounded
    box_ = std::numeric_limits<T>::epsilon() * box;
    p_ = Largest<T>(strip.lower.p, Largest<T>(strip.upper.p, computed ? box : T(0)));
    q_ = stretch * Largest<T>(strip.lower.q, Largest<T>(strip.upper.q));
    const T pupil = std::max<T>(programme.lens.pupil, 1 / programme.lens.pupil);
    constexpr T kUlps = 12;
    unit_ = kUlps * (pupil == 1 ? T(1) : 1 + pupil) * (1 + p_ / programme.lens.f) * std::numeric_limits<T>::epsilon();
    p_ += programme.lens.delta;
  }
  T at(T n) const { return unit_ * (p_ + q_ * std::abs(n)) + box_; }
  T slope() const { return unit_ * q_; }

 private:
  T p_{}, q_{}, unit_{}, box_{};
};

/// The part of a line's reach by which rounding may change e and the ratio.
inline constexpr double kRatioError = 2e-12;

/// Whether rounding leaves e and the ratio as good as the limits ask: a small part of the tightest line's reach.
template <class T>
bool RatioIsGood(const FeasibleStrip<T>& strip, const WidthError<T>& error, T n) {
  const auto all_reach = [&](std::span<const T> lines, T least) {
    bool all = true;
    for (const T q : lines) all &= std::abs(q) >= least;
    return all;
  };
  const T least = error.at(n) / (kRatioError * n);
  return all_reach(strip.upper.q, least) && all_reach(strip.lower.q, least);
}

/// Whether that holds for the lines which are near the solution, and the others have no part in it: at its e and ratio
/// every tighter line has room for what rounding may do to it, for a part of its reach beside, and it is not so tight
/// that its own ratio there means nothing. Lines with such room open before the least ratio is reached, with whatever
/// faces them, so that those near the solution decide it.
template <class T>
bool TightLinesAreClear(const FeasibleStrip<T>& strip, const WidthError<T>& error, const LeastRatio<T>& at) {
  constexpr double kRoom = 1e-6, kOwnError = 1e-9;
  const T t = at.n * at.ratio, u = at.ratio > 0 ? at.n / at.ratio : T(0);
  const T least = error.at(at.n) / at.n, most = 8 * error.at(std::max({at.n, t, u}));
  const auto clear = [&](const Lines<T>& lines, int sign) {
    for (std::size_t i = 0; i < lines.q.size(); ++i) {
      const T reach = std::abs(lines.q[i]), value = lines.p[i] + lines.q[i] * (i < lines.sharp ? t : u);
      if (reach * kRatioError >= least) continue;
      if (!(reach * kOwnError >= least) || !(sign * (value - at.e) > kRoom * reach * at.n + most)) return false;
    }
    return true;
  };
  return clear(strip.upper, 1) && clear(strip.lower, -1);
}

}  // namespace lensd::optics
