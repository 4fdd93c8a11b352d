// A window's sharpness by small tiles, so that what cannot be trusted is left out and parts at different distances
// show.
#pragma once

#include <memory>
#include <vector>

#include "autofocus/measures.h"

namespace lensd::autofocus {

/// Sums of one tile of a frame, in sample units.
struct TileSum {
  double gradient = 0.0;  ///< of FocusSums::gradient
  double noise = 0.0;
  double noise_pixels = 0.0;
  double light = 0.0;
  double pixels = 0.0;
  int clear = 0;  ///< px around it in which nothing is too bright for the sensor, at most kMostClear
};
inline constexpr int kMostClear = 4;  ///< px: what is too bright spoils its surroundings

/// All tiles of a window, row by row. Two windows of one size have the same tiles.
struct TileScores {
  int columns = 0;
  int rows = 0;
  double full_scale = 1.0;
  int bits = 8;
  double rounding = 0.0;  ///< variance that rounding to those leaves, full scale squared
  std::vector<TileSum> tiles;
  /// The same window by smaller tiles, for where clipped light leaves none of these; nullptr: there are no smaller
  /// ones.
  std::shared_ptr<const TileScores> finer;
};

/// `window` is inside the frame and at least 16 x 16 px.
std::shared_ptr<const TileScores> ScoreTiles(const drivers::Frame& frame, const Window& window);

/// The sums of the tiles that `left_out` does not name (nonzero), as one score; `pixels` becomes how many they are.
FocusScore ScoreOf(const TileScores& scores, const std::vector<char>& left_out, int& pixels);

}  // namespace lensd::autofocus
