// How wide the lens opens.
#pragma once

#include "base/units.h"

namespace lensd::optics {

/// A = f/N. Arguments > 0.
Metres ApertureDiameter(Metres focal_length, FNumber f_number);

/// m = e/f of the plane in focus.
double Magnification(Metres focal_length, Metres extension);

/// N (1 + m/p): what the f-number amounts to at this extension; p is the pupil factor. At p = 1 it is Z_s/A.
FNumber WorkingFNumber(FNumber f_number, double magnification, double pupil_factor = 1.0);

/// The angle in radians under which a point of the sensor on the axis sees the aperture: 2 atan(A/(2 Z_s)).
double SubtendedAngle(FNumber working_f_number);

}  // namespace lensd::optics
