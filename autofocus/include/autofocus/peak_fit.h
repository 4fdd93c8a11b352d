// Where a sharpness curve has its top, from a few samples around it.
#pragma once

#include <optional>
#include <span>

namespace lensd::autofocus {

struct CurvePoint {
  double position = 0.0;
  double value = 0.0;           ///< > 0
  double sigma = 0.0;           ///< standard deviation of `value`, > 0
  double position_sigma = 0.0;  ///< standard deviation of `position`
};

struct PeakFit {
  double position = 0.0;
  double sigma = 0.0;   ///< of `position`, from the scatter of the points or their own sigmas, whichever says more
  double height = 0.0;  ///< of the curve there
  double width = 0.0;   ///< standard deviation of the Gaussian that the parabola is the logarithm of
};

/// Weighted least-squares parabola through ln(value): the logarithm of a sharpness curve is close to a parabola over a
/// wider stretch than the curve itself. With a `power` below 0 (L of peak_model.h) through value^power, which is one
/// farther down the sides of a curve with long tails. Nothing where fewer than three points are given or they do not
/// curve downward.
std::optional<PeakFit> FitPeak(std::span<const CurvePoint> points, double power = 0.0);

}  // namespace lensd::autofocus
