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

#include "defocus/rings.h"
#include "defocus/texture_prior.h"

namespace lensd::autofocus::defocus {

struct Fit {
  double log_likelihood = 0.0;  ///< of the frames, given texture, focus and slope
  double log_prior = 0.0;       ///< of the texture
  double excess = 0.0;          ///< mean of (tr C^-1 R)/n - 1 over all modes: above 0, more than the model can explain
};

class Likelihood {
 public:
  /// `positions`: of the stack's frames, in pixels of blur. The stack outlives this.
  Likelihood(const RingStack& stack, std::span<const double> positions);

  /// `uneven`: half the logarithm of the slope above the focus over that below.
  Fit At(double focus, double slope, double uneven = 0.0) const;

  int frames() const { return stack_.frames; }
  int rings() const { return static_cast<int>(stack_.rings.size()); }
  double count() const { return count_; }  ///< independent modes in all
  std::span<const double> positions() const { return {positions_.data(), static_cast<std::size_t>(stack_.frames)}; }

 private:
  template <int n>
  Fit FitOf(double focus, double slope, double uneven) const;
  template <int n>
  Matrix Gains(const Ring& ring, std::size_t index, const std::array<double, kMostFrames>& blur) const;

  const RingStack& stack_;
  std::array<double, kMostFrames> positions_{};
  std::vector<TexturePrior::Place> places_;
  std::vector<double> coherence_;  ///< by ring: what small displacements leave of the correlation of two frames
  double count_ = 0.0;
};

}  // namespace lensd::autofocus::defocus
