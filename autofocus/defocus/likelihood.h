// How well a focus position explains a few frames.
//
// A frame taken at position p of a subject in focus at x has the signed blur s = slope (p - x), in pixels. Blur
// multiplies the subject's spectrum by the disk's response H(s f), so over a ring of equal frequency the frames'
// spectra have the covariance C = S G + noise, G_ij = H(s_i f) H(s_j f), with one unknown, the texture's power S in
// that ring. The window smears frequency by a bin, so G is averaged over neighbouring frequencies. S is found by two
// steps of Fisher scoring under a prior that knows what textures look like; what is left is the likelihood of x and the
// slope.
#pragma once

#include <array>
#include <span>

#include "autofocus/defocus/ring_fit.h"

namespace lensd::autofocus::defocus {

class Likelihood {
 public:
  /// `positions`: of the stack's frames, in pixels of blur.
  Likelihood(const RingStack& stack, std::span<const double> positions);

  /// `uneven`: half the logarithm of the slope above the focus over that below.
  Fit At(double focus, double slope, double uneven = 0.0) const;

  std::span<const double> positions() const { return {positions_.data(), static_cast<std::size_t>(rings_.frames())}; }

 private:
  RingColumns rings_;
  std::array<double, kMostFrames> positions_{};
};

}  // namespace lensd::autofocus::defocus
