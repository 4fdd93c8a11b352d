// The formulas of diffraction.h on quantities with units.
#include "optics/diffraction.h"

#include <cmath>

namespace lensd::optics {

double DiffractionFactor(DiffractionConvention convention) {
  return convention == DiffractionConvention::Airy ? 2.44 : 1.75;
}

Metres DiffractionBlur(DiffractionConvention convention, Metres wavelength, FNumber working_f_number) {
  return DiffractionFactor(convention) * wavelength * working_f_number.value;
}

Metres TotalBlur(Metres geometric, Metres diffraction) {
  return {std::hypot(geometric.value, diffraction.value)};
}

}  // namespace lensd::optics
