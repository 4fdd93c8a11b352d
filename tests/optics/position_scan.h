// The choice of positions by trying every one of them in turn, which the search among blocks has to equal.
#pragma once

#include <cstddef>
#include <vector>

#include "optics/positions/position_search.h"

namespace lensd::optics {

struct ScannedChoice {
  std::vector<std::size_t> focus;
  bool focus_reachable = true;
};
/// The positions of focus a request admits.
ScannedChoice ScanChoice(const PlanRequest& request, const LensPositions& lens, const PositionBlur& blur);

/// The best pair of `focus` and `iris` for the objectives light and sharp.
PositionPair ScanPairs(const PlanRequest& request, const LensPositions& lens, const PositionBlur& blur,
                       const std::vector<std::size_t>& focus, const std::vector<std::size_t>& iris);

}  // namespace lensd::optics
