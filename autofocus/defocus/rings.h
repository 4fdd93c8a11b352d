// Rings of equal frequency: the statistics of a few spectra of one scene that the likelihood needs, and no more.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "autofocus/defocus/spectrum.h"

namespace lensd::autofocus::defocus {

constexpr int kMostFrames = 4;  ///< taken together

/// Symmetric n x n, n <= kMostFrames, row-major with stride kMostFrames.
using Matrix = std::array<double, kMostFrames * kMostFrames>;

struct Ring {
  double frequency = 0.0;  ///< cycles per px, mean over its modes
  double spread = 0.0;     ///< cycles per px: how far the window's own blur in frequency reaches (one bin)
  double count = 0.0;      ///< independent modes it is worth
  Matrix power{};          ///< [i][j]: mean of Re(Y_i Y_j*)
};

struct RingStack {
  int frames = 0;
  std::array<double, kMostFrames> noise{};  ///< power of each frame's noise in every mode
  std::vector<Ring> rings;                  ///< those where some frame shows more than noise
};

/// The spectra of one frame, tile by tile.
using Tiles = std::vector<Spectrum>;

/// 1 to kMostFrames frames, each of the same tiles of equal size, of a scene that stood still. What the tiles say is
/// added up.
RingStack StackRings(std::span<const Tiles* const> frames);

/// Enough shows to tell blur from shading.
bool HasTexture(const RingStack& stack);
/// One grating alone: nearly all light but noise is at one frequency, within what the window blurs. Its contrast comes
/// again on either side of focus, and nothing else tells which top is the true one.
bool IsOneGrating(const RingStack& stack);

}  // namespace lensd::autofocus::defocus
