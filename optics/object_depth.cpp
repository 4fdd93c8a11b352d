// The two forms of a depth, and their way into each other.
#include "optics/object_depth.h"

#include <cmath>

namespace lensd::optics {

Dioptres ObjectDepth::vergence() const {
  return {is_distance_ ? 1.0 / value_ : value_};
}

std::optional<Metres> ObjectDepth::distance() const {
  const double distance = is_distance_ ? value_ : 1.0 / value_;
  if (!(distance > 0.0) || std::isinf(distance)) return std::nullopt;
  return Metres{distance};
}

double ObjectDepth::FocusGap(Metres focal_length) const {
  const auto at = place();
  return thin_lens::BeyondFocalPoint(focal_length.value, at) / at.z;
}

}  // namespace lensd::optics
