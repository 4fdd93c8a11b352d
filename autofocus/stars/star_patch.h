// The part of a frame in which stars are looked for, without its background.
#pragma once

#include <cstddef>
#include <vector>

#include "autofocus/measures.h"
#include "drivers/api/camera.h"

namespace lensd::autofocus {

/// A part of a frame in full scales, linear in light, less its background.
struct Patch {
  int x = 0, y = 0, width = 0, height = 0;
  std::vector<double> light;
  std::vector<char> full;  ///< too bright for the sensor
  double noise = 0.0;      ///< standard deviation of a pixel
  double At(int column, int row) const { return light[Index(column, row)]; }
  std::size_t Index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
  }
};

/// The window and what lies around it, as far as the circles of its stars reach.
Patch PatchOf(const drivers::Frame& frame, const Window& window);

/// The middle one; not empty.
double MedianOf(std::vector<double> values);

}  // namespace lensd::autofocus
