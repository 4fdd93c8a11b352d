// What noise alone adds to the sharpness of a frame, by how bright it is.
#pragma once

#include <array>
#include <vector>

#include "sharpness.h"

namespace lensd::merge {

/// Learned from frames of one stack, most of which are blurred in most places: there nothing but noise is left.
class NoiseFloor {
 public:
  /// `brightest`: about the largest luminance of the stack.
  explicit NoiseFloor(float brightest);
  void Learn(const Sharpness& frame, int width, int height);
  /// Expected mean square of the detail of noise at that luminance; > 0.
  float At(float light) const;
  /// Once all is learned: makes At() follow it.
  void Settle();

 private:
  static constexpr int kBins = 16;
  float per_light_ = 0.0f;
  float least_ = 0.0f;
  std::array<float, kBins> quiet_{};  ///< of the quietest frame; < 0: nothing learned
};

}  // namespace lensd::merge
