#include "optics/conjugates.h"

#include <cmath>
#include <cstdio>
#include <string>

namespace lensd::optics {
namespace {

std::string Length(Metres length) {
  char text[48];
  const bool small = std::abs(length.value) < 1.0;
  std::snprintf(text, sizeof text, small ? "%.9g mm" : "%.9g m", length.value * (small ? 1000.0 : 1.0));
  return text;
}

std::string Place(ObjectDepth object) {
  if (const auto distance = object.distance()) return Length(*distance);
  return "infinity";
}

std::string TooClose(Metres focal_length, ObjectDepth object, std::optional<Metres> longest_extension) {
  std::string text = "cannot focus at " + Place(object) + ", at or inside the focal length of " + Length(focal_length) +
                     ": the closest focus is ";
  const auto closest = longest_extension ? FocalPlaneDistance(focal_length, *longest_extension) : std::nullopt;
  return text + (closest ? Length(*closest) : "just beyond " + Length(focal_length));
}

bool IsPositive(double value) {
  return value > 0.0 && std::isfinite(value);
}

bool IsDepth(ObjectDepth object) {
  const double vergence = object.vergence().value;
  return std::isfinite(vergence) && (!object.is_distance() || vergence >= 0.0);
}

}  // namespace

Matrix4 ThinLensMatrix(Metres focal_length) {
  const double f = focal_length.value;
  return {{{f, 0, 0, 0}, {0, f, 0, 0}, {0, 0, f, 0}, {0, 0, 1, -f}}};
}

HomogeneousPoint Conjugate(Metres focal_length, const HomogeneousPoint& point) {
  const double f = focal_length.value;
  const auto& [x, y, z, w] = point;
  return {f * x, f * y, f * z, std::fma(-f, w, z)};
}

std::optional<std::array<Metres, 3>> Cartesian(const HomogeneousPoint& point) {
  const auto& [x, y, z, w] = point;
  if (w == 0.0) return std::nullopt;
  return std::array{Metres{x / w}, Metres{y / w}, Metres{z / w}};
}

std::optional<Metres> ImageHeight(Metres focal_length, Metres object_height, ObjectDepth object) {
  const double gap = object.FocusGap(focal_length);
  if (gap == 0.0) return std::nullopt;
  return Metres{object_height.value * (focal_length.value * object.vergence().value / gap)};
}

std::optional<Metres> ObjectHeight(Metres focal_length, Metres image_height, Metres extension) {
  if (extension.value == 0.0) return std::nullopt;
  return Metres{image_height.value * (focal_length / extension)};
}

Metres Extension(Metres focal_length, ObjectDepth object) {
  const double f = focal_length.value;
  if (const auto distance = object.distance(); object.is_distance() && distance) return {f * f / (distance->value - f)};
  return {f * f * object.vergence().value / object.FocusGap(focal_length)};
}

std::optional<Metres> ImageDepth(Metres focal_length, ObjectDepth object) {
  const double gap = object.FocusGap(focal_length);
  if (gap == 0.0) return std::nullopt;
  return focal_length / gap;
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
  const double f = focal_length.value;
  return {extension.value / (f * (f + extension.value))};
}

std::optional<Metres> FocalPlaneDistance(Metres focal_length, Metres extension) {
  if (!(extension.value > 0.0)) return std::nullopt;
  const double f = focal_length.value;
  return Metres{f + f * f / extension.value};
}

}  // namespace lensd::optics
