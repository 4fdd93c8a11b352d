// Areas and moments of a circle or a regular polygon, by the geometry of its sides; disk diameters may be negative,
// which mirrors the shape.
#include "sim/render/aperture_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/render/disk_kernel.h"

namespace lensd::sim {
namespace {

constexpr double kArea = 0.25 * std::numbers::pi;  // of every shape, in squared diameters

/// The part of a convex polygon where a x + b y <= c, walking its sides and cutting those that cross the line.
std::vector<AperturePoint> CutBy(const std::vector<AperturePoint>& polygon, double a, double b, double c) {
  std::vector<AperturePoint> rest;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const AperturePoint& from = polygon[i];
    const AperturePoint& to = polygon[(i + 1) % polygon.size()];
    const double from_over = a * from.x + b * from.y - c;
    const double to_over = a * to.x + b * to.y - c;
    if (from_over <= 0.0) rest.push_back(from);
    if ((from_over < 0.0 && to_over > 0.0) || (from_over > 0.0 && to_over < 0.0)) {
      const double along = from_over / (from_over - to_over);
      rest.push_back({from.x + along * (to.x - from.x), from.y + along * (to.y - from.y)});
    }
  }
  return rest;
}

double AreaOf(const std::vector<AperturePoint>& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const AperturePoint& from = polygon[i];
    const AperturePoint& to = polygon[(i + 1) % polygon.size()];
    twice += from.x * to.y - to.x * from.y;
  }
  return 0.5 * twice;
}

}  // namespace

ApertureShape::ApertureShape(int blades) {
  if (blades == 0) return;
  // A triangle between the centre and two neighbouring corners has the area R^2/2 sin(2 pi/n).
  const double turn = 2.0 * std::numbers::pi / blades;
  reach_ = std::sqrt(2.0 * kArea / (blades * std::sin(turn)));
  for (int i = 0; i < blades; ++i) corners_.push_back({reach_ * std::cos(i * turn), reach_ * std::sin(i * turn)});
}

double ApertureShape::inner_reach() const {
  return is_circle() ? reach_ : reach_ * std::cos(std::numbers::pi / static_cast<double>(corners_.size()));
}

AperturePoint ApertureShape::PointAt(double radius, double turns) const {
  if (is_circle()) {
    const double angle = 2.0 * std::numbers::pi * turns;
    return {radius * std::cos(angle), radius * std::sin(angle)};
  }
  // The angle chooses a place along the outline, the radius how far toward it.
  const double along = turns * static_cast<double>(corners_.size());
  const std::size_t side = std::min(static_cast<std::size_t>(along), corners_.size() - 1);
  const double past = along - static_cast<double>(side);
  const AperturePoint& from = corners_[side];
  const AperturePoint& to = corners_[(side + 1) % corners_.size()];
  const double out = 2.0 * radius;
  return {out * (from.x + past * (to.x - from.x)), out * (from.y + past * (to.y - from.y))};
}

double ApertureShape::AreaIn(double diameter, double x0, double y0, double x1, double y1) const {
  if (is_circle()) return DiskInRectangle(std::abs(diameter), x0, y0, x1, y1);
  std::vector<AperturePoint> polygon = corners_;
  for (AperturePoint& corner : polygon) corner = {diameter * corner.x, diameter * corner.y};
  polygon = CutBy(polygon, 1.0, 0.0, x1);
  polygon = CutBy(polygon, -1.0, 0.0, -x0);
  polygon = CutBy(polygon, 0.0, 1.0, y1);
  polygon = CutBy(polygon, 0.0, -1.0, -y0);
  return AreaOf(polygon);
}

std::complex<double> ApertureShape::Transfer(double kx, double ky) const {
  const double length = std::hypot(kx, ky);
  // Not std::cyl_bessel_j, which sets signgam, a variable of all threads.
  if (is_circle()) return length < 2e-8 ? 1.0 : 2.0 * ::j1(0.5 * length) / (0.5 * length);
  if (length < 1e-6) return 1.0;
  // By Gauss's theorem an integral along the sides, over each of which the wave's mean is its value in the middle times
  // sin(x)/x, x being half its phase along the side.
  std::complex<double> sum = 0.0;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const AperturePoint& from = corners_[i];
    const AperturePoint& to = corners_[(i + 1) % corners_.size()];
    const double half_phase = 0.5 * (kx * (to.x - from.x) + ky * (to.y - from.y));
    const double mean = std::abs(half_phase) < 1e-8 ? 1.0 : std::sin(half_phase) / half_phase;
    const double outward = kx * (to.y - from.y) - ky * (to.x - from.x);
    sum += outward * mean * std::polar(1.0, -0.5 * (kx * (from.x + to.x) + ky * (from.y + to.y)));
  }
  return std::complex<double>(0.0, 1.0) * sum / (length * length * kArea);
}

}  // namespace lensd::sim
