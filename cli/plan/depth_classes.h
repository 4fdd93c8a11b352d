// Depth maps: which depths each class of the mask occupies.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/result.h"

namespace lensd::cli {

/// Occupied depths of a class in millimetres, ascending, without repetition, never 0.
using OccupiedDepths = std::vector<int>;

/// Reads a 16-bit grey PNG of depths in millimetres (0: unknown) and an 8-bit grey PNG of the same size whose values
/// are classes (0: ignored); without a mask every pixel is of class 1. Returns the depths of each class in `wanted`,
/// found in one pass over the pixels. Errors name the file: Io (cannot be read), BadData (not such a PNG, sizes differ,
/// a class without a known depth, or one with 65535, where 16 bits overflow).
Result<std::map<int, OccupiedDepths>> ReadDepthClasses(const std::string& depth_map, const std::string& mask,
                                                       const std::vector<int>& wanted);

}  // namespace lensd::cli
