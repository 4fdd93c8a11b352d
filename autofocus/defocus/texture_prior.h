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

  /// Of the rings' log powers y, each of weight w, 1 over its variance about the curve.
  struct Sums {
    std::array<double, 6> normal{};  ///< of w, w L, w L^2, w L L, w L L^2, w L^2 L^2: the normal matrix' upper triangle
    std::array<double, 3> right{};   ///< of w y, w y L, w y L^2
  };

  TexturePrior() = default;
  /// The curve that rings of these sums have.
  explicit TexturePrior(const Sums& sums);

  /// What multiplies 1, L and L^2.
  const std::array<double, 3>& curve() const { return curve_; }
  /// Logarithm of the prior's density at the curve found.
  double LogDensity() const;

 private:
  std::array<double, 3> curve_{};
};

}  // namespace lensd::autofocus::defocus
