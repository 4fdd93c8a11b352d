// Blur whose diameter changes from pixel to pixel.
#pragma once

#include "sim/render/disk_filter.h"

namespace lensd::sim {

/// Each pixel of `out` becomes the mean of `source` over its own disk, whose diameter in pixels `diameters` holds
/// (>= 0, same rectangle as `out`). Between the diameters of a fixed ladder, whose filters are used tile by tile where
/// they are needed, results are interpolated. `source` must reach ReachOf(largest diameter) beyond `out`.
void BlurVarying(const SummedRaster& source, const Raster& diameters, Raster& out, const ApertureShape& shape = {});

/// Interpolating between two rungs of the ladder acts like moving the light by at most so many pixels.
inline constexpr double kLadderMove = 0.02;

/// Cells beyond a pixel that BlurVarying may read for diameters up to this one.
int ReachOf(double diameter_px, const ApertureShape& shape = {});

}  // namespace lensd::sim
