// Where the sensor must stand to focus, and what is in focus where it stands.
#pragma once

#include <optional>

#include "base/result.h"
#include "base/units.h"
#include "optics/object_depth.h"

namespace lensd::optics {

/// Image depth behind the focal point, e = Z_i - f, by Newton's form f²/(Z_o - f) from a distance and f² U/(1 - f U)
/// from a vergence; each is within 4 ulp of exact from its own input. Negative where the image is virtual (Z_o < f) or
/// the object past infinity; infinite at Z_o = f.
Metres Extension(Metres focal_length, ObjectDepth object);

/// The extension that focuses on `object`. OutOfRange at or inside the focal length, naming the closest focus: that of
/// `longest_extension` where the lens has one, else the focal length itself. InvalidArgument for a focal length or a
/// depth that is not a positive number.
Result<Metres> FocusExtension(Metres focal_length, ObjectDepth object,
                              std::optional<Metres> longest_extension = std::nullopt);

/// Vergence of the plane in focus at extension e > -f: U_s = e/(f (f + e)). Zero at infinity, negative past it.
Dioptres FocalPlane(Metres focal_length, Metres extension);
/// Its distance f + f²/e from the lens centre; nothing at and past infinity.
std::optional<Metres> FocalPlaneDistance(Metres focal_length, Metres extension);

}  // namespace lensd::optics
