// Pictures of a stack, and where each of them stands in it.
#pragma once

#include <cstddef>
#include <vector>

namespace lensd::merge {

/// Row-major, channels interleaved, in any unit that is the same for the whole stack.
struct Picture {
  int width = 0;     ///< px
  int height = 0;    ///< px
  int channels = 1;  ///< 1 (luminance) or 3 (red, green, blue)
  std::vector<float> samples;

  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};

/// One frame of a stack. Stacks are in the order of their places, which rise or fall strictly.
struct Station {
  double place = 0.0;  ///< of the plane in focus: vergence in 1/m, or any coordinate that blur is nearly even in
  double scale = 1.0;  ///< size of the picture about its middle, over that of the others; > 0
};

/// A pixel that sees a scene point at (x, y) from the middle of a frame of scale s sees it at (x, y) S/s in the merged
/// picture, S being the largest scale of the stack: no frame has to show more than it saw.
double MergedScale(const std::vector<Station>& stations);

}  // namespace lensd::merge
