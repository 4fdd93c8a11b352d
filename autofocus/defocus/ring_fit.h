// How well signed blurs explain the rings of a few frames: the sums behind Likelihood, several rings at a time.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "autofocus/defocus/rings.h"

namespace lensd::autofocus::defocus {

struct Fit {
  double log_likelihood = 0.0;  ///< of the frames, given texture, focus and slope
  double log_prior = 0.0;       ///< of the texture
  double excess = 0.0;          ///< mean of (tr C^-1 R)/n - 1 over all modes: above 0, more than the model can explain
};

/// What does not depend on blur, by ring: one column for each quantity. The last rings are there to fill a vector, and
/// count for nothing.
class RingColumns {
 public:
  enum Column : std::size_t {
    kFrequency,  ///< cycles per px
    kCount,      ///< independent modes
    kCoherence,  ///< what small displacements leave of the correlation of two frames
    kLog,        ///< of the frequency, as TexturePrior has it
    kLog2,
    kNear,                     ///< three columns: frequencies that the window smears into the ring ...
    kNearWeight = kNear + 3,   ///< ... and their shares
    kPower = kNearWeight + 3,  ///< Ring::power, row by row up to the diagonal
    kColumns = kPower + kMostFrames * (kMostFrames + 1) / 2,
  };
  static constexpr std::size_t kAbreast = 8;  ///< doubles of the widest vector

  explicit RingColumns(const RingStack& stack);

  int frames() const { return frames_; }
  std::size_t rings() const { return rings_; }  ///< a multiple of kAbreast
  double count() const { return count_; }       ///< independent modes in all
  double noise(int frame) const { return noise_[static_cast<std::size_t>(frame)]; }
  const double* operator[](std::size_t column) const { return values_.data() + column * rings_; }

 private:
  int frames_ = 0;
  std::size_t rings_ = 0;
  double count_ = 0.0;
  std::array<double, kMostFrames> noise_{};
  std::vector<double> values_;
};

/// `blur`: of each frame, px of diameter, signed. Any thread may ask.
Fit FitRings(const RingColumns& rings, const std::array<double, kMostFrames>& blur);

}  // namespace lensd::autofocus::defocus
