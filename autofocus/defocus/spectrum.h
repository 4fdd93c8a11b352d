// One window of one frame in frequency space: what the estimator sees of a picture.
#pragma once

#include <complex>
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
  double mean = 0.0;       ///< of light, full scale is 1
  double noise = 0.0;      ///< power of the noise in every mode: an upper bound where fine texture is sharp
  double saturated = 0.0;  ///< fraction of px at full scale together with most of their neighbours

  int columns() const { return width / 2 + 1; }
};

/// The window to analyse around the one asked for: widened to `least` px a side where the frame allows, cut to `most`,
/// with sides the transform is fast at.
Window AnalysisWindow(const Window& asked, int frame_width, int frame_height, int least, int most);

/// `window` as AnalysisWindow() gives it: inside the frame, even sides.
Spectrum SpectrumOf(const drivers::Frame& frame, const Window& window);

}  // namespace lensd::autofocus::defocus
