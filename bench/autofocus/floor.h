// The least error that any autofocus could have on a scene: what the light itself allows.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/result.h"
#include "sim/pictures.h"

namespace lensd::bench {

/// Cramér-Rao bound of a focus position from frames of known blur slope and a disk PSF, where every mode of the texture
/// is unknown: from the sharp picture's own spectrum and the sensor's noise in the region of truth.
class FocusFloor {
 public:
  /// Renders the scene in focus once. Errors as Pictures::At(); InvalidArgument: several subjects, or none.
  static Result<FocusFloor> Create(sim::Pictures& pictures);

  /// Standard deviation in px of blur, for frames whose signed blur diameters (px) are given; infinite where they do
  /// not decide, 0 for a noiseless camera. `slope_sigma`: how well it is known how much blur a motion makes, relative
  /// standard deviation; 0: exactly.
  double BoundPx(std::span<const double> blurs_px, double slope_sigma = 0.0) const;
  /// What one step of the focus motor leaves, px of blur: step / sqrt(12).
  double quantisation_px() const { return quantisation_px_; }
  /// Contrast of the region over the noise of one px.
  double signal_to_noise() const { return signal_to_noise_; }
  /// Standard deviation of light over its mean in the region, when in focus.
  double contrast() const { return contrast_; }

 private:
  struct Mode {
    double frequency = 0.0;  ///< cycles per px
    double power = 0.0;      ///< of the sharp texture, over that of the noise
  };
  std::vector<Mode> modes_;
  double quantisation_px_ = 0.0;
  double signal_to_noise_ = 0.0;
  double contrast_ = 0.0;
};

}  // namespace lensd::bench
