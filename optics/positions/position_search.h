// The best of all pairs of a lens' positions.
#pragma once

#include <cstddef>

#include "optics/focus_blocks.h"
#include "optics/positions/position_blur.h"

namespace lensd::optics {

/// Limits hold on positions up to this ratio: rounding.
inline constexpr double kPositionHolds = 1.0 + 1e-12;

/// One pair of positions, and the worst of all limits there.
struct PositionPair {
  std::size_t focus = 0;
  std::size_t iris = 0;
  double ratio = 0.0;
};

/// A pair that holds and is the best for the request's objective, of equals the first; where none holds the pair that
/// comes closest, whose ratio is above kPositionHolds. `choice`: of this request.
PositionPair BestPair(const PlanRequest& request, const LensPositions& lens, const FocusBlocks& blocks,
                      const PositionBlur& blur, const PositionChoice& choice);

}  // namespace lensd::optics
