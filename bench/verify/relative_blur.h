// How much more one frame is blurred than another, from the frames alone.
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "base/result.h"

namespace lensd::bench {

/// Grey levels, row-major, width * height.
struct Plane {
  int width = 0;   ///< px
  int height = 0;  ///< px
  std::vector<float> values;
};

/// The blur found where the depth lies in [near_m, far_m).
struct SliceBlur {
  double near_m = 0.0;
  double far_m = 0.0;
  long pixels = 0;           ///< pixels used; below kFewestPixels nothing is claimed and the rest is 0
  double diameter_px = 0.0;  ///< disk diameter that turns the reference into the picture
  double sigma_px = 0.0;     ///< standard error of the diameter
  double gain = 0.0;         ///< brightness of the picture over the reference's
};
inline constexpr long kFewestPixels = 400;

/// Two frames taken alike through a small aperture (their difference tells the noise), and the picture to judge.
struct FramesToCompare {
  Plane reference_a;
  Plane reference_b;
  Plane picture;
};

/// For every slice between neighbouring `edges_m`, the diameter of the disk by which the reference must be blurred to
/// look like the picture: least squares over brightness and offset, with the part of the misfit that is the reference's
/// own noise taken out. Only pixels whose surroundings lie at about their own depth are used, so that no nearer or
/// farther thing bleeds in. `depth_m` has one depth a pixel, 0 where unknown. `largest_px` ends the search.
/// Errors: InvalidArgument where sizes differ.
Result<std::vector<SliceBlur>> BlurBetween(const FramesToCompare& frames, const std::vector<float>& depth_m,
                                           std::span<const double> edges_m, double largest_px);

/// Convolves one plane with uniform disks of any diameter, exactly up to the sampling limit: the spectrum is multiplied
/// by 2 J1(pi d f)/(pi d f). Edges are mirrored.
class DiskBlur {
 public:
  /// `margin_px`: how far the mirrored edge must reach, half the largest diameter or more.
  DiskBlur(const Plane& plane, int margin_px);
  /// The plane blurred by a disk of `diameter_px` >= 0.
  Plane Blurred(double diameter_px) const;
  /// What the disk leaves of white noise's variance: the mean of its squared transfer function.
  double NoiseGain(double diameter_px) const;

 private:
  std::vector<float> Transfer(double diameter_px) const;

  int width_, height_, margin_;
  int padded_width_, padded_height_;
  std::vector<std::complex<float>> spectrum_;  // padded_height_ rows of padded_width_
};

}  // namespace lensd::bench
