// How two frames of one camera differ: by noise alone, or because what they show does.
#pragma once

#include <span>

#include "autofocus/measures.h"
#include "drivers/api/camera.h"

namespace lensd::autofocus {

/// Pixels of one row of a window.
std::span<const std::uint16_t> RowOf(const drivers::Frame& frame, const Window& window, int y);

/// Neighbouring differences of noise have nothing to do with each other, nor with the picture: both frames are equally
/// sharp, which tells noise from a change of contrast.
struct Difference {
  bool is_noise = false;       ///< or nothing
  bool texture_shows = false;  ///< the slopes of the picture are steeper than such noise makes them
};
Difference DifferenceOf(const drivers::Frame& one, const drivers::Frame& other, const Window& window);

/// The same question the other way round: what is in doubt counts as no change here, and as no noise there. Light that
/// comes and goes is divided out.
struct Change {
  bool shows = false;       ///< the difference is smooth, or one of the frames is sharper
  bool is_sharper = false;  ///< one of them is
  double power = 0.0;       ///< mean square of the difference
};
Change ChangeBetween(const drivers::Frame& one, const drivers::Frame& other, const Window& window);

}  // namespace lensd::autofocus
