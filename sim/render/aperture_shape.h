// The outline of the aperture: what shape a blur disk has.
#pragma once

#include <complex>
#include <vector>

namespace lensd::sim {

/// A point of the aperture, in aperture diameters from its centre.
struct AperturePoint {
  double x = 0.0;
  double y = 0.0;
};

/// A circle, or the regular polygon of the same area that the straight blades of an iris leave open, one corner at the
/// right. Lengths are in diameters of that circle: f-number and light do not depend on the shape.
class ApertureShape {
 public:
  /// A circle.
  ApertureShape() = default;
  /// `blades` >= 3, or 0 for a circle.
  explicit ApertureShape(int blades);

  bool is_circle() const { return corners_.empty(); }
  /// 0 for a circle.
  int blades() const { return static_cast<int>(corners_.size()); }
  /// Whether it looks the same in a mirror, held either way: circles and even numbers of blades.
  bool is_even() const { return corners_.size() % 2 == 0; }
  /// From the centre to the farthest point: 1/2 for a circle.
  double reach() const { return reach_; }
  /// From the centre to the nearest side.
  double inner_reach() const;

  /// The point of the shape that a point of the circle (length at most 1/2) goes to; equal areas go to equal areas.
  /// `turns` is the circle point's angle, 0 to 1, `radius` its distance from the centre.
  AperturePoint PointAt(double radius, double turns) const;
  /// Area of the shape, enlarged by `diameter` about the origin (negative: turned by half a turn too), inside the
  /// rectangle [x0, x1] x [y0, y1]; exact to rounding.
  double AreaIn(double diameter, double x0, double y0, double x1, double y1) const;
  /// Mean of exp(-i k . h) over the shape: what blur with a diameter of 1 leaves of a plane wave, k in radians.
  std::complex<double> Transfer(double kx, double ky) const;

 private:
  std::vector<AperturePoint> corners_;  ///< counterclockwise; of a circle none
  double reach_ = 0.5;
};

}  // namespace lensd::sim
