// Whether a part of the window, judged on its own, allows the focus that the whole window gave.
#pragma once

#include <vector>

#include "defocus/spectrum.h"

namespace lensd::autofocus::defocus {

struct PartFrame {
  double at = 0.0;  ///< position in pixels of blur
  const drivers::Frame* frame = nullptr;
};

/// False where the part shows texture that is clearly sharper elsewhere than at `focus`. A part without texture agrees
/// with everything. `frames`: 1 to kMostFrames.
bool PartAgrees(const std::vector<PartFrame>& frames, Window part, double focus, double slope);

}  // namespace lensd::autofocus::defocus
