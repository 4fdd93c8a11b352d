// How much of each pixel a disk covers: the kernel of a blur disk over pixels.
#pragma once

#include <cstddef>
#include <vector>

#include "aperture_shape.h"

namespace lensd::sim {

/// Area of the disk of diameter `diameter` around the origin inside the rectangle [x0, x1] x [y0, y1], exact to
/// rounding.
double DiskInRectangle(double diameter, double x0, double y0, double x1, double y1);

/// The share of a blur disk's area in each pixel of a square of 2 reach + 1 pixels around the pixel it is centred on.
/// The weights add up to 1. A disk no larger than a pixel stays in its own.
struct DiskKernel {
  int reach = 0;
  std::vector<double> weights;  ///< row-major, (2 reach + 1)^2

  /// `shape` is even.
  explicit DiskKernel(double diameter_px, const ApertureShape& shape = {});
  double At(int x, int y) const {
    return weights[static_cast<std::size_t>((y + reach) * (2 * reach + 1) + (x + reach))];
  }
};

}  // namespace lensd::sim
