// From spectra to a blur and its interval.
#pragma once

#include <vector>

#include "spectra.h"

namespace lensd::verify {

inline constexpr double kQuantisation = 1.0 / 12;  ///< variance of rounding, levels^2

/// The disk that turns the reference into the picture, over one part of the frame.
struct DiameterFit {
  long pixels = 0;       ///< used
  double low_px = 0.0;   ///< 95 % interval; 0: the frames cannot tell the blur from none
  double high_px = 0.0;  ///< its upper end; where low_px is 0, what the blur is at most (99 %)
  bool open = false;     ///< the frames set no upper end: every diameter tried will do
  PartModel model;       ///< the likeliest
};

/// Likeliest diameter and likelihood-ratio interval. The texture is unknown and has no prior: per frequency, the misfit
/// |P - g H(d) R|^2 is weighed by its variance, which is the picture's noise plus that of the reference after gain and
/// disk. The latter is taken out of the misfit, else larger disks would be favoured for leaving less of it. The
/// picture's noise is what the best fit leaves. Needs eight steps or more.
DiameterFit FitDiameter(const Spectra& spectra);

}  // namespace lensd::verify
