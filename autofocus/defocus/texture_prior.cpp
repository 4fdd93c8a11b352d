// Weighted least squares in closed form: Fit() solves three equations, once for every place an estimate tries. The
// slope and bend expected, and how sure of them it is, are the constants at the top.
#include "defocus/texture_prior.h"

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

void TexturePrior::Add(Place place, double log_power, double weight) {
  normal_[0] += weight;
  normal_[1] += weight * place.l;
  normal_[2] += weight * place.l2;
  normal_[3] += weight * place.l * place.l;
  normal_[4] += weight * place.l * place.l2;
  normal_[5] += weight * place.l2 * place.l2;
  right_[0] += weight * log_power;
  right_[1] += weight * log_power * place.l;
  right_[2] += weight * log_power * place.l2;
}

/// Gaussian elimination of a positive definite 3 x 3 system.
void TexturePrior::Fit() {
  const double a = normal_[0] + kLevelWeight;
  const double b = normal_[1];
  const double c = normal_[2];
  const double d = normal_[3] + kSlopeWeight - b * b / a;
  const double e = normal_[4] - b * c / a;
  const double f = normal_[5] + kBendWeight - c * c / a;
  const double y = right_[1] + kSlope * kSlopeWeight - b * right_[0] / a;
  const double z = right_[2] - c * right_[0] / a;
  curve_[2] = (z - e * y / d) / (f - e * e / d);
  curve_[1] = (y - e * curve_[2]) / d;
  curve_[0] = (right_[0] - b * curve_[1] - c * curve_[2]) / a;
}

double TexturePrior::LogDensity() const {
  const double slope = curve_[1] - kSlope;
  return -0.5 * (kSlopeWeight * slope * slope + kBendWeight * curve_[2] * curve_[2]);
}

}  // namespace lensd::autofocus::defocus
