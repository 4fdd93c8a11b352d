// By how much a picture has grown and moved from one frame to the next, from the pictures alone.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "merge/picture.h"

namespace lensd::merge {

/// Of the second picture against the first.
struct Drift {
  double scale = 1.0;     ///< its size over the first one's
  double right_px = 0.0;  ///< its middle against the first one's
  double down_px = 0.0;
};

/// `expected`: a first idea of the scale. Both of one size. Made for neighbours of a stack, whose blur differs little:
/// the least squares of their difference over what growing, moving and brightening would change, at a width of 300 to
/// 600 pixels. Where there is no texture, nothing has moved.
Drift MeasureDrift(const Picture& first, const Picture& second, double expected = 1.0);

/// How the frames of a stack lie over each other.
struct Alignment {
  std::vector<double> scales;      ///< one a frame, as of Station
  std::optional<std::size_t> law;  ///< which of the laws that is; none: as the pictures themselves grow
  double misfit_px = 0.0;          ///< by how much the law that fits best and the pictures differ in a corner, in all
  double largest_shift_px = 0.0;   ///< of the middle from one frame to the next: the camera or everything moved
  std::size_t shifted_after = 0;   ///< the frame before that
};

/// The law that fits best of those that the lens may follow, each the scales of all frames; the pictures' own growth
/// where none fits within 1.5 px. `drifts`: from each frame to the next. `size`: of a frame, for its corner.
Alignment Align(const std::vector<Drift>& drifts, const std::vector<std::vector<double>>& laws, const Picture& size);

}  // namespace lensd::merge
