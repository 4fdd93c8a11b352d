// How much more one frame is blurred than another, from the frames alone.
#pragma once

#include <span>
#include <vector>

#include "base/result.h"
#include "verify/plane.h"

namespace lensd::verify {

/// The blur found where the depth lies in [near_m, far_m): the diameter of the picture's disk, in pixels.
struct SliceBlur {
  double near_m = 0.0;
  double far_m = 0.0;
  double mean_m = 0.0;       ///< of the pixels used, each weighed by its contrast
  long pixels = 0;           ///< used; below kFewestPixels nothing is claimed and the rest is 0
  double diameter_px = 0.0;  ///< the likeliest
  double low_px = 0.0;       ///< 95 % interval; 0: no blur cannot be told from some ...
  double high_px = 0.0;      ///< ... and the blur is at most this
  bool open = false;         ///< not even that is known: any diameter up to `largest_px` will do
  double gain = 0.0;         ///< brightness of the picture over the reference's

  bool at_most() const { return low_px <= 0.0; }
};
inline constexpr long kFewestPixels = 400;

/// Two frames taken alike through a small aperture (their difference tells the noise), and the picture to judge; linear
/// light.
struct FramesToCompare {
  Plane reference_a;
  Plane reference_b;
  Plane picture;
  double reference_opening = 0.0;  ///< diameter of the references' aperture over the picture's, below 1
};

/// For every slice between neighbouring `edges_m`, the disk by which the reference must be blurred to look like the
/// picture, which may also be brighter and displaced sideways as a whole. Noise is taken from the frames: the
/// references' from their difference, as a straight line over the level; the picture's from what the best fit leaves.
/// Only pixels whose surroundings lie at about their own depth are used, so that no nearer or farther thing bleeds in.
/// `depth_m` has one depth a pixel, 0 where unknown. `largest_px` ends the search. Errors: InvalidArgument where sizes
/// differ.
Result<std::vector<SliceBlur>> BlurBetween(const FramesToCompare& frames, const std::vector<float>& depth_m,
                                           std::span<const double> edges_m, double largest_px);

}  // namespace lensd::verify
