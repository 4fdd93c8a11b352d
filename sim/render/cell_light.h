// Light inside the cells of the picture's grid, for rays.
//
// A ray meets a surface at one point; a pixel's light is the mean over its rays, which cover the pixel and the
// aperture. So rays need the picture itself, not its pixel means: the band-limited picture whose means are the samples,
// in each cell the parabola in x and y closest to it. The parabola's mean is the sample to the last bit.
#pragma once

#include <array>

#include "sim/render/canvas.h"
#include "sim/render/raster.h"

namespace lensd::sim {

/// Light at (dx, dy) from a cell's middle: mean + slope_x dx + slope_y dy + bend_x (dx² - 1/12) + bend_y (dy² - 1/12) +
/// twist dx dy, each a raster of the same cells.
struct CellLight {
  enum Part { kSlopeX, kSlopeY, kBendX, kBendY, kTwist, kParts };
  Raster mean;
  std::array<Raster, kParts> parts;  ///< empty where the canvas has one colour

  /// Of the canvas' samples, cells outside its region included.
  CellLight(const Canvas& canvas, PixelRect rect);
  double At(int x, int y, double dx, double dy) const;
};

}  // namespace lensd::sim
