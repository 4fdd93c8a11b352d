// What an autofocus run concludes, whatever the method.
#pragma once

#include <optional>
#include <string>

#include "base/units.h"

namespace lensd::autofocus {

/// The end of one run in a method's own coordinate: extension in metres where the lens is calibrated, native units
/// where it is not.
struct Verdict {
  bool focused = false;
  double position = 0.0;    ///< best focus; meaningless unless focused
  double sigma = 0.0;       ///< standard deviation of `position`
  double confidence = 0.0;  ///< 0..1: how sure the method is that `position` is the sharpest place
  std::string reason;       ///< why it believes, or why it refuses: one line for people
};

}  // namespace lensd::autofocus
