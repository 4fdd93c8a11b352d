// Zoom framing: the focal length that makes a field of a given width fill the sensor.
#pragma once

#include "base/result.h"
#include "base/units.h"
#include "optics/focus_scale.h"

namespace lensd::optics {

/// A field to frame: `width` across at `distance` on `scale`. All lengths > 0 and finite.
struct Field {
  Metres width;
  Metres distance;
  FocusScale scale;
};

/// The focal lengths a zoom reaches, inclusive.
struct ZoomRange {
  Metres shortest;
  Metres longest;
};

/// The focal length that frames `field` on a sensor `sensor_width` wide with focus on the field: with m = W/WIDTH,
/// f = m Z_o/(1 + m) from the lens centre and f = m (D - gap)/(1 + m)² from the sensor mark. OutOfRange where the zoom
/// does not reach it, naming the widths it can frame there; InvalidArgument for lengths that are not above zero.
Result<Metres> FramingFocalLength(const Field& field, Metres sensor_width, const ZoomRange& zoom);

/// Width of the field at `depth` from the lens centre that the sensor sees with the focus elsewhere: the magnification
/// of its blur disks' centres is m = (f + e)/Z_o.
Metres FieldWidth(Metres focal_length, Metres extension, Metres sensor_width, Metres depth);

}  // namespace lensd::optics
