// Focusing, and in which words it is refused.
#include "optics/conjugates.h"

#include <cmath>
#include <string>

#include "base/quantity_text.h"

namespace lensd::optics {
namespace {

std::string Place(ObjectDepth object) {
  if (const auto distance = object.distance()) return LengthText(*distance, 6);
  return "infinity";
}

std::string TooClose(Metres focal_length, ObjectDepth object, std::optional<Metres> longest_extension) {
  std::string text = "cannot focus at " + Place(object) + ", at or inside the focal length of " +
                     LengthText(focal_length, 6) + ": the closest focus is ";
  const auto closest = longest_extension ? FocalPlaneDistance(focal_length, *longest_extension) : std::nullopt;
  return text + (closest ? LengthText(*closest, 6) : "just beyond " + LengthText(focal_length, 6));
}

bool IsPositive(double value) {
  return value > 0.0 && std::isfinite(value);
}

bool IsDepth(ObjectDepth object) {
  const double vergence = object.vergence().value;
  return std::isfinite(vergence) && (!object.is_distance() || vergence >= 0.0);
}

}  // namespace

Metres Extension(Metres focal_length, ObjectDepth object) {
  return {thin_lens::Extension(focal_length.value, object.place())};
}

Result<Metres> FocusExtension(Metres focal_length, ObjectDepth object, std::optional<Metres> longest_extension) {
  if (!IsPositive(focal_length.value)) return Fail(Code::InvalidArgument, "the focal length must be above zero");
  if (!IsDepth(object)) return Fail(Code::InvalidArgument, "the distance to focus at must be above zero, or infinity");
  if (!(object.FocusGap(focal_length) > 0.0)) {
    return Fail(Code::OutOfRange, TooClose(focal_length, object, longest_extension));
  }
  return Extension(focal_length, object);
}

Dioptres FocalPlane(Metres focal_length, Metres extension) {
  return {thin_lens::FocalPlane(focal_length.value, extension.value)};
}

std::optional<Metres> FocalPlaneDistance(Metres focal_length, Metres extension) {
  if (!(extension.value > 0.0)) return std::nullopt;
  const double f = focal_length.value;
  return Metres{f + f * f / extension.value};
}

}  // namespace lensd::optics
