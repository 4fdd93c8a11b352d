// What an f-number amounts to at an extension.
#include "optics/light.h"

#include <cmath>

namespace lensd::optics {

Metres ApertureDiameter(Metres focal_length, FNumber f_number) {
  return focal_length / f_number.value;
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

}  // namespace lensd::optics
