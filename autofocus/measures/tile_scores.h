// A window's sharpness by small tiles, so that what cannot be trusted is left out and parts at different distances
// show.
#pragma once

#include <array>
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

/// The pixels beside a window, as far as the frame goes, in bands that end so many px from it: light of what lies there
/// enters the window once its blur is twice as wide.
inline constexpr std::array kBandEndsPx = {4, 8, 16, 32};
struct Band {
  double energy = 0.0;  ///< sum of FocusScore::gradient_energy over its pixels
  double pixels = 0.0;
};
using Bands = std::array<Band, kBandEndsPx.size()>;

/// All tiles of a window, row by row. Two windows of one size have the same tiles.
struct TileScores {
  int columns = 0;
  int rows = 0;
  double full_scale = 1.0;
  int bits = 8;
  double rounding = 0.0;  ///< variance that rounding to those leaves, full scale squared
  std::vector<TileSum> tiles;
  Bands around;
  /// The same window by smaller tiles, for where clipped light leaves none of these; nullptr: there are no smaller
  /// ones.
  std::shared_ptr<const TileScores> finer;
};

/// `window` is inside the frame and at least 16 x 16 px.
std::shared_ptr<const TileScores> ScoreTiles(const drivers::Frame& frame, const Window& window);

/// The sums of the tiles that `left_out` does not name (nonzero), as one score; `pixels` becomes how many they are.
FocusScore ScoreOf(const TileScores& scores, const std::vector<char>& left_out, int& pixels);

}  // namespace lensd::autofocus
