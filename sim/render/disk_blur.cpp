// Sums over the disk's rows or a Fourier transform. Which is quicker was measured on frames of 192x128 to 1280x1024;
// both agree to rounding.
#include "sim/render/disk_blur.h"

#include "sim/render/disk_filter.h"
#include "sim/render/disk_fourier.h"

namespace lensd::sim {

Raster BlurredBy(const DiskKernel& kernel, double diameter_px, const Raster& light, PixelRect rect) {
  // Sums cost as the pixels and the diameter, the transform as the pixels and those beside them, twice above and below
  // since halves travel.
  constexpr double kPerDiameter = 0.16;
  const double width = rect.width, height = rect.height, beside = 2.0 * kernel.reach;
  Raster blurred(rect);
  if ((width + beside) * (height + 2.0 * beside) < kPerDiameter * diameter_px * width * height) {
    DiskFourier(kernel, rect.width, rect.height).Blur(light, blurred);
  } else {
    DiskFilter(kernel, DiskFilter::MethodFor(diameter_px)).Blur(light, blurred);
  }
  return blurred;
}

}  // namespace lensd::sim
