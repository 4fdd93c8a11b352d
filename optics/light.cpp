#include "optics/light.h"

#include <cmath>

namespace lensd::optics {

Metres ApertureDiameter(Metres focal_length, FNumber f_number) {
  return focal_length / f_number.value;
}

FNumber FNumberFromAperture(Metres focal_length, Metres aperture_diameter) {
  return {focal_length / aperture_diameter};
}

double Magnification(Metres focal_length, Metres extension) {
  return extension / focal_length;
}

FNumber WorkingFNumber(FNumber f_number, double magnification, double pupil_factor) {
  return f_number * (1.0 + magnification / pupil_factor);
}

double SubtendedAngle(FNumber working_f_number) {
  return 2.0 * std::atan(0.5 / working_f_number.value);
}

double ParaxialLight(FNumber working_f_number) {
  return 1.0 / (working_f_number.value * working_f_number.value);
}

// With t = tan θ = 1/(2 N_w): 4 sin²θ = 4 t²/(1 + t²).
double ExactLight(FNumber working_f_number) {
  return 1.0 / (working_f_number.value * working_f_number.value + 0.25);
}

}  // namespace lensd::optics
