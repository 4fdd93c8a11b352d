// Why no position of a lens holds.
#pragma once

#include <string>
#include <vector>

#include "optics/positions/position_search.h"

namespace lensd::optics {

/// `conflict`, found for a lens that is everywhere what this one is at one position, or what has to be added to it for
/// that no position of this lens meets it: each has depths, a focal length and bounds of its own.
std::vector<std::string> ConflictOnPositions(const PlanRequest& request, const LensPositions& lens,
                                             const FocusBlocks& blocks, const DistanceOrigin& origin,
                                             const std::vector<std::string>& conflict);

}  // namespace lensd::optics
