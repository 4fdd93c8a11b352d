// A smooth curve through measured points that turns only where the points do.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "base/result.h"

namespace lensd::rig {

/// Piecewise cubic between its knots (PCHIP: between two knots it never leaves the range of their values, so that
/// rising points give a rising curve), straight beyond them. Immutable, cheap to copy.
class Curve {
 public:
  struct Knot {
    double at = 0.0;
    double value = 0.0;
  };
  /// At least two knots, finite, `at` rising. InvalidArgument says what is wrong.
  static Result<Curve> Through(const std::vector<Knot>& knots);

  double At(double x) const;
  double low() const { return first_.at; }
  double high() const { return last_.at; }
  /// Values all rise, or all fall, from knot to knot.
  bool rising() const { return rising_; }
  bool falling() const { return falling_; }
  /// Where the value is `value`: a rising or a falling curve only.
  double Inverse(double value) const;

 private:
  Curve() = default;

  std::shared_ptr<const std::function<double(double)>> between_;
  Knot first_, last_;
  double first_slope_ = 0.0, last_slope_ = 0.0;
  bool rising_ = false, falling_ = false;
};

/// x with f(x) = value to rounding, for a continuous f that rises or falls throughout and is unbounded; [low, high] is
/// where to look first, low < high.
double SolveMonotone(const std::function<double(double)>& f, double value, double low, double high);

}  // namespace lensd::rig
