// Blur by one disk in the way that is quickest.
#pragma once

#include "sim/render/disk_kernel.h"
#include "sim/render/raster.h"

namespace lensd::sim {

/// `light` over `rect`, blurred by the kernel of a disk of that diameter. `light` goes on beyond for the kernel's
/// reach.
Raster BlurredBy(const DiskKernel& kernel, double diameter_px, const Raster& light, PixelRect rect);

}  // namespace lensd::sim
