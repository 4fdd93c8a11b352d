// What textures look like before anything is known of this one: the logarithm of their power is close to a parabola in
// the logarithm of frequency, falling like most of the natural world does.
#pragma once

#include <array>

namespace lensd::autofocus::defocus {

/// Regression of log power on {1, L, L^2}, L = ln(frequency / 0.06), with a prior on slope and bend.
class TexturePrior {
 public:
  static constexpr double kScatter = 0.45;  ///< standard deviation of a ring's log power about the curve

  /// Coordinates of a ring; computed once for a frequency in cycles per px.
  struct Place {
    double l = 0.0;
    double l2 = 0.0;
  };
  static Place PlaceOf(double frequency);

  /// One ring's log power, known with a variance of 1/weight about the curve.
  void Add(Place place, double log_power, double weight);
  /// Solves for the curve. Call once, after every Add().
  void Fit();
  double At(Place place) const { return curve_[0] + curve_[1] * place.l + curve_[2] * place.l2; }
  /// Logarithm of the prior's density at the curve found.
  double LogDensity() const;

 private:
  std::array<double, 6> normal_{};  ///< upper triangle of the normal matrix
  std::array<double, 3> right_{};
  std::array<double, 3> curve_{};
};

}  // namespace lensd::autofocus::defocus
