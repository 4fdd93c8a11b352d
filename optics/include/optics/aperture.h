// The two lowest rungs of the ladder: a pinhole, and a hole of finite size without a lens.
#pragma once

#include "base/units.h"
#include "optics/conjugates.h"
#include "optics/object_depth.h"

namespace lensd::optics {

/// A round hole of `diameter` with the sensor `sensor_distance` behind it; both > 0, the diameter may be 0 (a pinhole).
struct Aperture {
  Metres diameter;
  Metres sensor_distance;
};

/// A disk across the axis: its centre and its diameter.
struct Disk {
  Metres x;
  Metres y;
  Metres diameter;
};

/// Where a pinhole images `object` (z > 0, directions allowed): X_i/Z_i = X_o/Z_o, on the image side's axes.
std::array<Metres, 2> PinholeImage(Metres sensor_distance, const HomogeneousPoint& object);

/// Forward projection: the sensor area lit by the scene point `object` (z > 0, directions allowed) through the hole.
Disk LitBy(const Aperture& aperture, const HomogeneousPoint& object);
/// Reverse projection: the area of the plane at `depth` that the sensor point (x, y) sees through the hole.
Disk SeenFrom(const Aperture& aperture, Metres x, Metres y, Metres depth);

/// Blur on the sensor b = A (1 + d U): never less than the hole.
Metres Blur(const Aperture& aperture, ObjectDepth object);

}  // namespace lensd::optics
