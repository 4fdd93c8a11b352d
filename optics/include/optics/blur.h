// Thin-lens blur: the diameter of the disk a point makes on the sensor, in the form that keeps its digits.
#pragma once

#include "base/units.h"
#include "optics/object_depth.h"

namespace lensd::optics {

/// A thin lens focused by its extension e = Z_s - f. Requires f > 0, N > 0, e > -f; e < 0 is focused past infinity.
struct ThinLens {
  Metres focal_length;
  FNumber f_number;
  Metres extension;
};

/// Signed blur s = A (f + e)(U_s - U): positive behind the plane in focus (farther), negative in front of it. Any
/// depth above zero is legal, inside the focal length too, where blur is well defined though no real image forms.
/// Correct to about twice double precision before its last rounding, so that it stays good where it is nearly zero.
Metres SignedBlur(const ThinLens& lens, ObjectDepth object);
/// |SignedBlur|: the diameter of the blur disk.
Metres Blur(const ThinLens& lens, ObjectDepth object);

/// What a pupil factor p (exit over entrance pupil diameter) divides the thin lens's blur by: 1 + f U (1/p - 1).
/// 1 for a symmetric lens and for subjects at infinity. Requires p > 0 and a divisor above zero.
double PupilDivisor(Metres focal_length, ObjectDepth object, double pupil_factor);

}  // namespace lensd::optics
