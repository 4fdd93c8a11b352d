// Whether a part of the window, judged on its own, allows the focus that the whole window gave.
#pragma once

#include <vector>

#include "defocus/shift.h"
#include "defocus/spectrum.h"

namespace lensd::autofocus::defocus {

struct PartFrame {
  double at = 0.0;  ///< position in pixels of blur
  const drivers::Frame* frame = nullptr;
  Shift shift;  ///< that lays its picture on the others'
};

/// What a part of the window says of itself.
struct PartFocus {
  bool textured = false;   ///< enough to say anything
  double focus = 0.0;      ///< px of blur: the most likely between the limits
  bool elsewhere = false;  ///< clearly more likely there than within half a depth of field of the place asked about
};

/// `frames`: 1 to kMostFrames.
PartFocus FocusOfPart(const std::vector<PartFrame>& frames, Window part, double asked_about, double slope,
                      double lowest, double highest);

}  // namespace lensd::autofocus::defocus
