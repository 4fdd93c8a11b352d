// The formulas of thin_lens.h on quantities with units.
#include "optics/blur.h"

#include <cmath>

namespace lensd::optics {
Metres SignedBlur(const ThinLens& lens, ObjectDepth object) {
  const thin_lens::Lens<double> plain{lens.focal_length.value, lens.f_number.value, lens.extension.value};
  return {thin_lens::SignedBlur(plain, object.place())};
}

Metres Blur(const ThinLens& lens, ObjectDepth object) {
  return {std::abs(SignedBlur(lens, object).value)};
}

double PupilDivisor(Metres focal_length, ObjectDepth object, double pupil_factor) {
  return std::fma(focal_length.value * object.vergence().value, (1.0 - pupil_factor) / pupil_factor, 1.0);
}

}  // namespace lensd::optics
