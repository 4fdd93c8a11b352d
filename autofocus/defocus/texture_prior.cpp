// Weighted least squares in closed form: the constructor solves three equations, once for every place an estimate
// tries. The slope and bend expected, and how sure of them it is, are the constants at the top.
#include "autofocus/defocus/texture_prior.h"

#include <cmath>

namespace lensd::autofocus::defocus {
namespace {

constexpr double kSlope = -2.4;
constexpr double kSlopeWeight = 1.0 / (0.8 * 0.8);
constexpr double kBendWeight = 1.0 / (0.35 * 0.35);
constexpr double kLevelWeight = 1e-6;

}  // namespace

TexturePrior::Place TexturePrior::PlaceOf(double frequency) {
  const double l = std::log(frequency / 0.06);
  return {l, l * l};
}

/// Gaussian elimination of a positive definite 3 x 3 system.
TexturePrior::TexturePrior(const Sums& sums) {
  const auto& [normal, right] = sums;
  const double a = normal[0] + kLevelWeight;
  const double b = normal[1];
  const double c = normal[2];
  const double d = normal[3] + kSlopeWeight - b * b / a;
  const double e = normal[4] - b * c / a;
  const double f = normal[5] + kBendWeight - c * c / a;
  const double y = right[1] + kSlope * kSlopeWeight - b * right[0] / a;
  const double z = right[2] - c * right[0] / a;
  curve_[2] = (z - e * y / d) / (f - e * e / d);
  curve_[1] = (y - e * curve_[2]) / d;
  curve_[0] = (right[0] - b * curve_[1] - c * curve_[2]) / a;
}

double TexturePrior::LogDensity() const {
  const double slope = curve_[1] - kSlope;
  return -0.5 * (kSlopeWeight * slope * slope + kBendWeight * curve_[2] * curve_[2]);
}

}  // namespace lensd::autofocus::defocus
