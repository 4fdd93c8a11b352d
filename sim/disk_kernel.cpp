#include "disk_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace lensd::sim {
namespace {

/// Area of the disk of radius r inside the quadrant { x' <= x, y' <= y }.
///
/// Cut at x, the disk's part left of it is a segment; within it the height above -r at abscissa t is
/// min(y, h(t)) + h(t) with h(t) = sqrt(r^2 - t^2) where -h(t) < y, and 0 elsewhere. The integral of h is elementary,
/// and the curve h crosses |y| at t = +- sqrt(r^2 - y^2), which splits the interval into at most three parts.
double HalfChordIntegral(double r, double t) {
  const double clamped = std::clamp(t, -r, r);
  return 0.5 * (clamped * std::sqrt(std::max(0.0, r * r - clamped * clamped)) + r * r * std::asin(clamped / r));
}

double DiskInQuadrant(double r, double x, double y) {
  if (x <= -r || y <= -r) return 0.0;
  const double end = std::min(x, r);
  const auto chord = [r](double from, double to) { return HalfChordIntegral(r, to) - HalfChordIntegral(r, from); };
  if (y >= r) return 2.0 * chord(-r, end);
  const double crossing = std::sqrt(r * r - y * y);
  // Where |t| < crossing the line at height y cuts the disk: what is below is y + h(t). Beyond, all (y > 0) or nothing.
  const double inside_end = std::clamp(end, -crossing, crossing);
  double area = y * (inside_end + crossing) + chord(-crossing, inside_end);
  if (y > 0.0) {
    area += 2.0 * chord(-r, std::min(end, -crossing));
    if (end > crossing) area += 2.0 * chord(crossing, end);
  }
  return area;
}

/// Cover of the cell in column x, row y (both >= 0): exactly 1 or 0 where the circle does not cross it.
double CellCover(double diameter, const ApertureShape& shape, int x, int y) {
  const double r = 0.5 * diameter;
  if (shape.is_circle() && std::hypot(x + 0.5, y + 0.5) <= r) return 1.0;
  if (std::hypot(std::max(0.0, x - 0.5), std::max(0.0, y - 0.5)) >= shape.reach() * diameter) return 0.0;
  // Whole cells must be equal to the last bit: the running sums pass over what does not change.
  constexpr double kRounding = 1e-12;
  const double area = shape.AreaIn(diameter, x - 0.5, y - 0.5, x + 0.5, y + 0.5);
  return area > 1.0 - kRounding ? 1.0 : area < kRounding ? 0.0 : area;
}

}  // namespace

double DiskInRectangle(double diameter, double x0, double y0, double x1, double y1) {
  const double r = 0.5 * diameter;
  return DiskInQuadrant(r, x1, y1) - DiskInQuadrant(r, x0, y1) - DiskInQuadrant(r, x1, y0) + DiskInQuadrant(r, x0, y0);
}

DiskKernel::DiskKernel(double diameter_px, const ApertureShape& shape)
    : reach(std::max(0, static_cast<int>(std::ceil(shape.reach() * diameter_px - 0.5)))) {
  const int side = 2 * reach + 1;
  weights.resize(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  if (reach == 0) {
    weights[0] = 1.0;
    return;
  }
  // One part is worked out and mirrored, so that the kernel is symmetric to the last bit: a quarter, of a disk an
  // octant.
  const auto set = [&](int x, int y, double value) {
    weights[static_cast<std::size_t>((y + reach) * side + (x + reach))] = value;
  };
  for (int y = 0; y <= reach; ++y) {
    for (int x = shape.is_circle() ? y : 0; x <= reach; ++x) {
      const double area = CellCover(diameter_px, shape, x, y);
      for (const int a : {x, -x}) {
        for (const int b : {y, -y}) {
          set(a, b, area);
          if (shape.is_circle()) set(b, a, area);
        }
      }
    }
  }
  double sum = 0.0;
  for (const double weight : weights) sum += weight;
  for (double& weight : weights) weight /= sum;
}

}  // namespace lensd::sim
