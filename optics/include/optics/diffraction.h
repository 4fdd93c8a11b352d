// The blur that light itself makes, and how it adds to geometric blur.
#pragma once

#include "base/units.h"

namespace lensd::optics {

/// What "the diameter of the diffraction disk" means: a convention, not physics.
enum class DiffractionConvention {
  Airy,   ///< to the first zero of the Airy disk, 2.44 λ Z_s/A: overstates through-focus MTF50 blur by up to 40 %
  Mtf50,  ///< 1.75 λ Z_s/A: within 0 to 13 % of through-focus MTF50 blur
};

/// 2.44 or 1.75.
double DiffractionFactor(DiffractionConvention convention);

/// Disk diameter for a working f-number Z_s/A; holds for a pinhole and a bare aperture too.
Metres DiffractionBlur(DiffractionConvention convention, Metres wavelength, FNumber working_f_number);

/// sqrt(b² + b_d²), without overflow.
Metres TotalBlur(Metres geometric, Metres diffraction);

}  // namespace lensd::optics
