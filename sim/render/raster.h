// A rectangle of floats somewhere on the picture's grid.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/render.h"

namespace lensd::sim {

/// Values of the cells of `rect`, row-major.
struct Raster {
  PixelRect rect;
  std::vector<float> values;

  Raster() = default;
  explicit Raster(PixelRect where)
      : rect(where), values(static_cast<std::size_t>(where.width) * static_cast<std::size_t>(where.height)) {}

  /// First value of row y of the picture; cell x of it is Row(y)[x - rect.x].
  float* Row(int y) { return values.data() + static_cast<std::ptrdiff_t>(y - rect.y) * rect.width; }
  const float* Row(int y) const { return values.data() + static_cast<std::ptrdiff_t>(y - rect.y) * rect.width; }
  float At(int x, int y) const { return Row(y)[x - rect.x]; }
  bool Holds(int x, int y) const {
    return x >= rect.x && y >= rect.y && x < rect.x + rect.width && y < rect.y + rect.height;
  }
};

/// `rect` grown by `margin` on every side.
inline PixelRect Grown(PixelRect rect, int margin) {
  return {rect.x - margin, rect.y - margin, rect.width + 2 * margin, rect.height + 2 * margin};
}

}  // namespace lensd::sim
