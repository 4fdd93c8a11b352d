#include "optics/framing.h"

#include <cmath>
#include <cstdio>

#include "optics/conjugates.h"

namespace lensd::optics {
namespace {

bool IsPositive(Metres length) {
  return length.value > 0.0 && std::isfinite(length.value);
}

/// The width that fills the sensor at the field's distance, focused there; nothing if that lies inside `focal_length`.
std::optional<Metres> WidthFramed(const Field& field, Metres sensor_width, Metres focal_length) {
  const auto depth = DepthInFocus(field.scale, focal_length, field.distance);
  if (!depth || !(depth->FocusGap(focal_length) > 0.0)) return std::nullopt;
  return FieldWidth(focal_length, Extension(focal_length, *depth), sensor_width, *depth->distance());
}

std::unexpected<Error> OutsideZoom(const Field& field, Metres sensor_width, const ZoomRange& zoom, Metres needed) {
  char text[320];
  int used = std::snprintf(text, sizeof text,
                           "framing %.6g m at %.6g m needs a focal length of %.6g mm, but the zoom reaches %.6g to "
                           "%.6g mm",
                           field.width.value, field.distance.value, needed.value * 1e3, zoom.shortest.value * 1e3,
                           zoom.longest.value * 1e3);
  const auto widest = WidthFramed(field, sensor_width, zoom.shortest);
  const auto narrowest = WidthFramed(field, sensor_width, zoom.longest);
  if (widest && narrowest) {
    std::snprintf(text + used, sizeof text - static_cast<std::size_t>(used), ": it frames %.6g to %.6g m there",
                  narrowest->value, widest->value);
  }
  return Fail(Code::OutOfRange, text);
}

}  // namespace

Result<Metres> FramingFocalLength(const Field& field, Metres sensor_width, const ZoomRange& zoom) {
  if (!IsPositive(field.width) || !IsPositive(field.distance) || !IsPositive(sensor_width)) {
    return Fail(Code::InvalidArgument,
                "the width and the distance of the field and the sensor width must be above zero");
  }
  const double m = sensor_width / field.width;
  const bool from_sensor = field.scale.from == DistanceFrom::Sensor;
  const Metres ahead = field.scale.from == DistanceFrom::Front ? field.scale.front_to_centre : Metres{0.0};
  const Metres reach = field.distance - (from_sensor ? field.scale.principal_gap : -ahead);
  if (!IsPositive(reach)) return Fail(Code::OutOfRange, "the field lies between the principal planes of the lens");
  const Metres focal_length = reach * (m / (1.0 + m) / (from_sensor ? 1.0 + m : 1.0));
  if (focal_length < zoom.shortest || focal_length > zoom.longest) {
    return OutsideZoom(field, sensor_width, zoom, focal_length);
  }
  return focal_length;
}

Metres FieldWidth(Metres focal_length, Metres extension, Metres sensor_width, Metres depth) {
  return sensor_width * (depth / (focal_length + extension));
}

}  // namespace lensd::optics
