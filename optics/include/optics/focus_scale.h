// Distances as people measure them: from the lens centre, from the sensor mark, or from the front of the lens.
#pragma once

#include "base/result.h"
#include "base/units.h"
#include "optics/object_depth.h"

namespace lensd::optics {

/// Where a distance starts.
enum class DistanceFrom {
  Lens,    ///< the centre of the virtual thin lens: what the model itself measures from
  Sensor,  ///< the sensor mark on the camera body: tape measures and focus scales
  Front,   ///< the front of the lens, a fixed length ahead of its centre
};

/// A distance scale of one lens. `principal_gap` is the distance between the principal planes (for Sensor);
/// `front_to_centre` from the front of the lens to its centre (for Front), 0 where unknown, so that Front then equals
/// Lens. Both >= 0. `centre_shift`: so far the centre has moved toward the scene since distances on this scale were
/// defined, which a zoom may make it do; every distance on it is that much longer than from the centre where it is now.
struct FocusScale {
  DistanceFrom from = DistanceFrom::Lens;
  Metres principal_gap{0.0};
  Metres front_to_centre{0.0};
  Metres centre_shift{0.0};
};

/// Object depth from the lens centre for a `distance` on this scale, infinity allowed, of an object in focus. From the
/// sensor, D = Z_o + Z_s + gap has two solutions; this is the farther one, magnification at most 1. OutOfRange when the
/// distance is shorter than any focused pair (D - gap < 4 f from the sensor), naming the shortest.
Result<ObjectDepth> DepthInFocus(const FocusScale& scale, Metres focal_length, Metres distance);

/// Object depth for a `distance` on this scale with the sensor standing at extension e, in focus or not. OutOfRange
/// when that lies at or behind the lens centre.
Result<ObjectDepth> DepthAt(const FocusScale& scale, Metres focal_length, Metres extension, Metres distance);

/// What the scale shows for a `depth` from the lens centre with the sensor standing at extension e.
Metres DistanceShown(const FocusScale& scale, Metres focal_length, Metres extension, Metres depth);

}  // namespace lensd::optics
