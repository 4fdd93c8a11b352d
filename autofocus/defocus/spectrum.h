// One window of one frame in frequency space: what the estimator sees of a picture.
#pragma once

#include <complex>
#include <cstdint>
#include <vector>

#include "autofocus/measures.h"

namespace lensd::autofocus::defocus {

/// Fourier transform of light over its mean minus 1, under a Hann window. White noise of relative variance v gives
/// every mode the power v. Modes: column i (0 .. width/2) has frequency i/width along x, row j (0 .. height-1) has
/// j/height (or j/height - 1 above 1/2) along y, in cycles per px; row-major, width/2 + 1 a row.
struct Spectrum {
  int width = 0;   ///< px, even
  int height = 0;  ///< px
  std::vector<std::complex<float>> modes;
  double mean = 0.0;      ///< of light, full scale is 1
  double noise = 0.0;     ///< power of the noise in every mode: an upper bound where fine texture is sharp
  double rounding = 0.0;  ///< the part of it that rounding to whole samples has, at least
  int columns() const { return width / 2 + 1; }
};

/// Pixels of a window that say nothing about focus, row by row; nonzero: left out. Empty: none.
using Mask = std::vector<std::uint8_t>;

/// Adds to `mask` what is too bright for the sensor in this frame, with its surroundings. A lone pixel at full scale is
/// noise on a bright picture.
void MaskClipped(const drivers::Frame& frame, const Window& window, Mask& mask);

/// The window cut into tiles of equal size, at most `most` px a side, that lie inside it and cover all of it but for
/// what rounding to sides the transform is fast at leaves over.
std::vector<Window> TilesOf(const Window& window, int most);

/// `tile` as TilesOf() gives it, a part of `window`, to which `mask` belongs: what it leaves out is filled with the
/// mean of its surroundings.
Spectrum SpectrumOf(const drivers::Frame& frame, const Window& tile, const Window& window = {}, const Mask& mask = {});

}  // namespace lensd::autofocus::defocus
