// The thin lens as a map between object and image points, and where the sensor must stand to focus.
#pragma once

#include <array>
#include <optional>

#include "base/result.h"
#include "base/units.h"
#include "optics/object_depth.h"

namespace lensd::optics {

/// A point as (x, y, z, w), standing for (x, y, z)/w in metres; w = 0 is a direction, a point at infinity. Object side
/// and image side share the lens centre as origin and have opposite axes, so that real depths are positive on both.
/// Points are equal up to scale.
using HomogeneousPoint = std::array<double, 4>;
using Matrix4 = std::array<std::array<double, 4>, 4>;

/// M with image = M object, and object = M image: M M = f² I. A direction maps onto the plane z = f and a point of the
/// front focal-point plane onto a direction, without a special case.
Matrix4 ThinLensMatrix(Metres focal_length);

/// M p. Self-inverse up to the scale f².
HomogeneousPoint Conjugate(Metres focal_length, const HomogeneousPoint& point);

/// (x, y, z)/w, or nothing for a direction.
std::optional<std::array<Metres, 3>> Cartesian(const HomogeneousPoint& point);

/// Image height from the front half-triangle, X_i/f = X_o/(Z_o - f); nothing at Z_o = f.
std::optional<Metres> ImageHeight(Metres focal_length, Metres object_height, ObjectDepth object);
/// Object height from the rear half-triangle, X_o/f = X_i/(Z_i - f); `extension` is Z_i - f, nothing at 0.
std::optional<Metres> ObjectHeight(Metres focal_length, Metres image_height, Metres extension);

/// Image depth behind the focal point, e = Z_i - f, by Newton's form f²/(Z_o - f) from a distance and f² U/(1 - f U)
/// from a vergence; each is within 4 ulp of exact from its own input. Negative where the image is virtual (Z_o < f) or
/// the object past infinity; infinite at Z_o = f.
Metres Extension(Metres focal_length, ObjectDepth object);
/// Z_i = f + e: negative for a virtual image, nothing at Z_o = f where the image is at infinity.
std::optional<Metres> ImageDepth(Metres focal_length, ObjectDepth object);

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
