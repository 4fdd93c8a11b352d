// What a blur disk does to pixels: the kernels that all renderers share.
//
// A texture's samples are pixel means of a band-limited picture, and so are the pixels of a frame. Blur multiplies the
// picture's spectrum by the disk's own, 2 J1(x)/x, whatever the pixels are. Neither the share of the disk in each pixel
// does that nor any sum that takes a pixel's light as gathered in its middle or spread evenly over it: below about 8 px
// the disk's spectrum beyond the band comes back into it. So the weights of small disks are those that fit 2 J1(x)/x
// best over the band. Those of large ones differ from shares of area in a rim of some 2 px to each side: cover of half
// pixels, filtered to whole ones so that the band passes and what lies beyond does not.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/render/aperture_shape.h"

namespace lensd::sim {

/// Periods from here on keep the contrast they should to a hundredth under fitted kernels; shorter ones to a few.
inline constexpr double kShortestPeriod = 2.5;
/// px; kernels of larger disks are filtered from half pixels: off by at most 0.3 diameter^-1.5 up to 0.4 cycles a
/// pixel.
inline constexpr double kLargestFitted = 8.0;

/// Area of the disk of diameter `diameter` around the origin inside the rectangle [x0, x1] x [y0, y1], exact to
/// rounding.
double DiskInRectangle(double diameter, double x0, double y0, double x1, double y1);

/// Weights over a square of 2 reach + 1 pixels around the pixel a blur disk is centred on. They add up to 1.
struct DiskKernel {
  int reach = 0;
  std::vector<double> weights;  ///< row-major, (2 reach + 1)^2

  /// From pixel means of a band-limited picture to those of the blurred one. A few weights are below 0: a step
  /// overshoots by 1.5 % at most. `shape` is even.
  explicit DiskKernel(double diameter_px, const ApertureShape& shape = {});
  /// For what is no band-limited picture but has sharp sides between the pixels: from values that hold all over their
  /// pixel to pixel means. No weight is below 0.
  static DiskKernel OfCells(double diameter_px, const ApertureShape& shape = {});
  /// For pictures that need many diameters at once: as the first, but of disks above kLargestFitted shares of area,
  /// which take half as many steps of running sums.
  static DiskKernel Sparse(double diameter_px, const ApertureShape& shape = {});
  /// No kernel of this diameter or a smaller one reaches farther.
  static int LargestReach(double diameter_px, const ApertureShape& shape = {});

  /// Of the same light: the one less the other. The weights add up to 0.
  DiskKernel operator-(const DiskKernel& other) const;

  double At(int x, int y) const {
    return weights[static_cast<std::size_t>((y + reach) * (2 * reach + 1) + (x + reach))];
  }

 private:
  DiskKernel() = default;
  friend class KernelTable;
};

}  // namespace lensd::sim
