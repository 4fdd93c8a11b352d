// Blur by one disk through the Fourier transform: the same cost for every diameter.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/render/disk_kernel.h"
#include "sim/render/fourier_plan.h"
#include "sim/render/raster.h"

namespace lensd::sim {

/// Convolution with the kernel of a disk or an even polygon for rasters of one size. Two halves of the
/// picture travel as the real and imaginary parts of one: the kernel is symmetric, so its transform is real and keeps
/// them apart. Rows and columns of the spectrum stay in the order the forward transform leaves them in, which the way
/// back undoes.
class DiskFourier {
 public:
  /// For results of `width` x `height` px.
  DiskFourier(double diameter_px, int width, int height, const ApertureShape& shape = {});

  DiskFourier(const DiskKernel& kernel, int width, int height);

  int reach() const { return reach_; }
  /// Fills `out`, of the size given above, whose rectangle grown by reach() lies within the source's.
  void Blur(const Raster& source, Raster& out) const;

 private:
  int reach_;
  int width_;
  int height_;
  int half_;  ///< rows that travel as the real part
  FourierPlan down_;
  FourierPlan along_;
  std::vector<float> transfer_;  ///< of the kernel over the number of samples, in the spectrum's order
};

}  // namespace lensd::sim
