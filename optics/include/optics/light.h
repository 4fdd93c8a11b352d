// How wide the lens opens and how much light reaches the sensor.
#pragma once

#include "base/units.h"

namespace lensd::optics {

/// A = f/N, and back. Arguments > 0.
Metres ApertureDiameter(Metres focal_length, FNumber f_number);
FNumber FNumberFromAperture(Metres focal_length, Metres aperture_diameter);

/// m = e/f of the plane in focus.
double Magnification(Metres focal_length, Metres extension);

/// N (1 + m/p): what the f-number amounts to at this extension; p is the pupil factor. At p = 1 it is Z_s/A.
FNumber WorkingFNumber(FNumber f_number, double magnification, double pupil_factor = 1.0);

/// The angle in radians under which a point of the sensor on the axis sees the aperture: 2 atan(A/(2 Z_s)).
double SubtendedAngle(FNumber working_f_number);

/// Light on the axis relative to an aperture as wide as its distance: (A/Z_s)² paraxially; exactly 4 sin²θ with
/// tan θ = A/(2 Z_s), 0.17 stop less at f/1.4.
double ParaxialLight(FNumber working_f_number);
double ExactLight(FNumber working_f_number);

}  // namespace lensd::optics
