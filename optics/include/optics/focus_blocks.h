// Positions of focus in blocks of neighbours. What those of a block have in common is measured, whatever follows what,
// so that a search may leave out a block that cannot hold what it looks for.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "base/units.h"

namespace lensd::optics {

struct FocusPosition;

/// Between what the positions of a block lie.
struct FocusRange {
  struct Ends {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
  };
  Ends focal_length, extension, sensor_distance, focal_plane, bound;
  /// All of it is finite, focal lengths and sensor distances are above zero; else nothing follows from the ends.
  bool sound = true;
};

/// Blocks of positions, of such blocks and so on, up to a last few.
class FocusBlocks {
 public:
  static constexpr std::size_t kOfABlock = 8;

  explicit FocusBlocks(const std::vector<FocusPosition>& positions);

  /// Level 0 are the positions themselves; at least 1.
  std::size_t levels() const { return blocks_.size(); }
  std::size_t positions() const { return positions_; }
  /// Of level 1 to levels().
  const std::vector<FocusRange>& OfLevel(std::size_t level) const { return blocks_[level - 1]; }
  /// The parts of a block, positions or blocks of one level less: from the first to the one past the last.
  struct Parts {
    std::size_t first = 0, end = 0;
  };
  Parts PartsOf(std::size_t level, std::size_t block) const;
  /// The positions a block holds.
  Parts PositionsOf(std::size_t level, std::size_t block) const;

 private:
  std::size_t positions_ = 0;
  std::vector<std::vector<FocusRange>> blocks_;
};

}  // namespace lensd::optics
