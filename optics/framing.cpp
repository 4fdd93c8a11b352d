// The focal length a framing needs, and the widths a zoom can frame instead.
#include "optics/framing.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/quantity_text.h"
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
  const auto in_mm = [](Metres length) { return Short(length.value * 1e3, 6); };
  std::string text = "framing " + LengthText(field.width, 6) + " at " + LengthText(field.distance, 6) +
                     " needs a focal length of " + in_mm(needed) + " mm, but the zoom reaches " + in_mm(zoom.shortest) +
                     " to " + in_mm(zoom.longest) + " mm";
  const auto widest = WidthFramed(field, sensor_width, zoom.shortest);
  const auto narrowest = WidthFramed(field, sensor_width, zoom.longest);
  ErrorFacts facts{.parameter = "field.widthM"};
  if (widest && narrowest) {
    facts.minimum = narrowest->value;
    facts.maximum = widest->value;
    facts.unit = "m";
    text += ": it frames " + LengthText(*narrowest, 6) + " to " + LengthText(*widest, 6) + " there";
  }
  return Fail(Code::OutOfRange, text, std::move(facts));
}

}  // namespace

Result<Metres> FramingFocalLength(const Field& field, Metres sensor_width, const ZoomRange& zoom) {
  for (const auto& [length, parameter] :
       {std::pair(field.width, "field.widthM"), std::pair(field.distance, "field.distanceM"),
        std::pair(sensor_width, "sensorWidthMm")}) {
    if (IsPositive(length)) continue;
    return Fail(Code::InvalidArgument,
                "the width and the distance of the field and the sensor width must be above zero",
                {.parameter = parameter});
  }
  const double m = sensor_width / field.width;
  const bool from_sensor = field.scale.from == DistanceFrom::Sensor;
  const Metres ahead = field.scale.from == DistanceFrom::Front ? field.scale.front_to_centre : Metres{0.0};
  const Metres reach = field.distance - field.scale.centre_shift - (from_sensor ? field.scale.principal_gap : -ahead);
  if (!IsPositive(reach))
    return Fail(Code::OutOfRange, "the field lies between the principal planes of the lens",
                {.parameter = "field.distanceM"});
  const Metres focal_length = reach * (m / (1.0 + m) / (from_sensor ? 1.0 + m : 1.0));
  constexpr double kRounding = 1e-12;  // the widths at the ends, as they are told, are framed too
  if (focal_length < zoom.shortest * (1.0 - kRounding) || focal_length > zoom.longest * (1.0 + kRounding)) {
    return OutsideZoom(field, sensor_width, zoom, focal_length);
  }
  return std::clamp(focal_length, zoom.shortest, zoom.longest);
}

Metres FieldWidth(Metres focal_length, Metres extension, Metres sensor_width, Metres depth) {
  return sensor_width * (depth / (focal_length + extension));
}

}  // namespace lensd::optics
