// From raw scores of one window to sharpness values that can be compared between frames.
//
// Gradient energy grows with the square of the exposure and contains the energy of the noise. So the noise's share is
// taken off and the rest divided by the squared mean. The noise estimate of a single frame is an upper bound, raised by
// fine texture; the lowest one of a run comes from its most blurred frame, and is used for all.
#pragma once

#include <vector>

#include "autofocus/measures.h"

namespace lensd::autofocus {

struct Sharpness {
  double value =
      0.0;  ///< gradient energy without noise over squared mean; about 0 where nothing can be seen, a black frame too
  double sigma = 0.0;  ///< its standard deviation from frame to frame
};

/// Variance of the noise of frames of one scene: the least over the scores, at least that of quantisation with
/// `bits`. In full scale squared.
double NoiseVariance(const std::vector<FocusScore>& scores, int bits);

Sharpness SharpnessOf(const FocusScore& score, double noise_variance, int pixels);

}  // namespace lensd::autofocus
