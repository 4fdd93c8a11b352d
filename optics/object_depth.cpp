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
  const double f = focal_length.value;
  if (!is_distance_) return std::fma(-f, value_, 1.0);
  return std::isinf(value_) ? 1.0 : (value_ - f) / value_;
}

Dioptres VergenceDifference(ObjectDepth a, ObjectDepth b) {
  if (a.is_distance_ != b.is_distance_) {
    // One of each: U - 1/Z = (U Z - 1)/Z, with the product rounded once.
    const double vergence = a.is_distance_ ? b.value_ : a.value_;
    const double distance = a.is_distance_ ? a.value_ : b.value_;
    const double difference = std::isinf(distance) ? vergence : std::fma(vergence, distance, -1.0) / distance;
    return {a.is_distance_ ? -difference : difference};
  }
  if (!a.is_distance_) return {a.value_ - b.value_};
  if (std::isinf(a.value_)) return {-1.0 / b.value_};
  if (std::isinf(b.value_)) return {1.0 / a.value_};
  return {(b.value_ - a.value_) / a.value_ / b.value_};
}

}  // namespace lensd::optics
