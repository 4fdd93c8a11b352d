// What the kernels of disks get wrong in light that is as fine as the pixels.
#pragma once

#include "sim/render/view.h"

namespace lensd::sim {

/// Of full scale: what at most one pixel in a thousand is off by beside what the renderers' bounds count, since kernels
/// on a grid of pixels do not have the disk's transform exactly. 0 where no light changes from pixel to pixel.
double ShortPeriodError(const View& view);

}  // namespace lensd::sim
