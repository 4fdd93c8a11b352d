// White noise adds a known share to the mean squared gradient, the constant below; a client's own score is taken as it
// is.
#include "autofocus/sharpness.h"

#include <algorithm>
#include <cmath>

namespace lensd::autofocus {

double NoiseVariance(const std::vector<FocusScore>& scores, int bits) {
  const double step = 1.0 / (std::exp2(bits) - 1.0);
  double least = scores.empty() ? 0.0 : scores.front().noise;
  for (const FocusScore& score : scores) least = std::min(least, score.noise);
  return std::max(least * least, step * step / 12.0);
}

Sharpness SharpnessOf(const FocusScore& score, double noise_variance, int pixels) {
  // White noise of variance v adds 0.375 v to the mean squared Sobel gradient, scattered by 0.64 v/sqrt(M): the squares
  // of neighbouring gradients are correlated. Noise on top of a gradient adds a term proportional to both.
  constexpr double kNoiseGain = 0.375;
  constexpr double kNoiseScatter = 0.41;
  const double energy = score.gradient_energy - kNoiseGain * noise_variance;
  const double variance =
      (kNoiseScatter * noise_variance * noise_variance + 2.0 * std::max(energy, 0.0) * noise_variance) / pixels;
  if (score.energy_sigma > 0) {
    const double light = std::max(score.mean * score.mean, 1e-12);
    return {score.gradient_energy / light, score.energy_sigma / light};
  }
  // Out of focus a few points of light on black are rounded away, and the mean says nothing.
  const double light = score.mean * score.mean + noise_variance;
  return {energy / light, std::sqrt(variance) / light};
}

}  // namespace lensd::autofocus
