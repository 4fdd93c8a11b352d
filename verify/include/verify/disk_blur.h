// Blurring a frame by a disk, exactly up to the sampling limit.
#pragma once

#include <complex>
#include <vector>

#include "verify/plane.h"

namespace lensd::verify {

/// A sideways displacement of the picture, px.
struct Shift {
  double x = 0.0;
  double y = 0.0;
};

enum class Transform { Forward, Inverse };

/// Two-dimensional discrete Fourier transform of height rows of width, not scaled either way.
std::vector<std::complex<float>> Transformed(const std::vector<std::complex<float>>& in, int width, int height,
                                             Transform way);

/// What a uniform disk leaves of a sinusoid of that frequency (cycles/px): 2 J1(x)/x with x = pi d f.
double DiskResponse(double diameter_px, double frequency);

/// What is left of it after a disk of `diameter_px` rather than one `opening` (0 to below 1) times as large: the ratio
/// of both responses. Near the smaller disk's first zero, where nothing can be told, its response counts as 0.3.
double ResponseBetween(double diameter_px, double opening, double frequency);

/// Blurs one plane, itself taken through an aperture `opening` times as large, into what the whole aperture makes of
/// it: the spectrum is multiplied by ResponseBetween. Edges are mirrored.
class DiskBlur {
 public:
  /// `margin_px`: how far the mirrored edge must reach, half the largest diameter or more.
  DiskBlur(const Plane& plane, double opening, int margin_px);
  /// The plane as by a disk of `diameter_px` >= 0, and moved by `shift`.
  Plane Blurred(double diameter_px, Shift shift) const;

 private:
  double opening_;
  int width_, height_, margin_;
  int padded_width_, padded_height_;
  std::vector<std::complex<float>> spectrum_;  // padded_height_ rows of padded_width_
};

}  // namespace lensd::verify
