// Depth maps: which depths each class of the mask occupies.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/result.h"

namespace lensd::cli {

/// Occupied depths of a class in millimetres, ascending, without repetition, never 0; only its two ends where that is
/// all that was asked for.
using OccupiedDepths = std::vector<int>;

/// A class of the mask, 1 to 255, and whether all its depths are wanted or its nearest and farthest alone.
struct WantedClass {
  int number = 1;
  bool every_depth = false;
};

/// Reads a 16-bit grey PNG of depths in millimetres (0: unknown) and an 8-bit grey PNG of the same size whose values
/// are classes (0: ignored); without a mask every pixel is of class 1. Returns the depths of each class in `wanted`.
/// Errors name the file: Io (cannot be read), BadData (not such a PNG, sizes differ, a class without a known depth, or
/// one with 65535, where 16 bits overflow).
Result<std::map<int, OccupiedDepths>> ReadDepthClasses(const std::string& depth_map, const std::string& mask,
                                                       const std::vector<WantedClass>& wanted);

}  // namespace lensd::cli
