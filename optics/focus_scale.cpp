// Distances of the three scales, turned into depths from the lens centre.
#include "optics/focus_scale.h"

#include <cmath>
#include <string>

#include "base/quantity_text.h"

namespace lensd::optics {
namespace {

std::unexpected<Error> TooShort(const char* rule, Metres shortest) {
  return Fail(Code::OutOfRange,
              std::string("the distance is too short: ") + rule + ", so give more than " + LengthText(shortest, 6));
}

/// What this scale shows beyond the depth from the lens centre.
Metres Offset(const FocusScale& scale, Metres focal_length, Metres extension) {
  switch (scale.from) {
    case DistanceFrom::Lens:
      return scale.centre_shift;
    case DistanceFrom::Sensor:
      return focal_length + extension + scale.principal_gap + scale.centre_shift;
    case DistanceFrom::Front:
      break;
  }
  return scale.centre_shift - scale.front_to_centre;
}

/// Z_o = D'/2 (1 + sqrt(1 - 4 f/D')), with the root taken of (D' - 4 f)/D', which keeps its digits near D' = 4 f.
Result<ObjectDepth> FromSensor(Metres focal_length, Metres gap, Metres distance) {
  const double span = distance.value - gap.value;
  const double spare = span - 4.0 * focal_length.value;
  if (!(spare >= 0.0)) {
    return TooShort("from the sensor nothing nearer than four focal lengths is in focus", 4.0 * focal_length + gap);
  }
  return ObjectDepth(Metres{std::isinf(span) ? span : 0.5 * span * (1.0 + std::sqrt(spare / span))});
}

}  // namespace

Result<ObjectDepth> DepthInFocus(const FocusScale& scale, Metres focal_length, Metres distance) {
  if (scale.from == DistanceFrom::Sensor) {
    return FromSensor(focal_length, scale.principal_gap + scale.centre_shift, distance);
  }
  return DepthAt(scale, focal_length, Metres{0.0}, distance);
}

Result<ObjectDepth> DepthAt(const FocusScale& scale, Metres focal_length, Metres extension, Metres distance) {
  const Metres offset = Offset(scale, focal_length, extension);
  const Metres depth = distance - offset;
  if (!(depth.value > 0.0)) return TooShort("it does not reach the lens centre", offset);
  return ObjectDepth(depth);
}

Metres DistanceShown(const FocusScale& scale, Metres focal_length, Metres extension, Metres depth) {
  return depth + Offset(scale, focal_length, extension);
}

}  // namespace lensd::optics
