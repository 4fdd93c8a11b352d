// Numbers and lengths for people: few digits, no exponents, no noise.
#pragma once

#include <string>

#include "base/units.h"

namespace lensd {

/// `value` to so many significant digits (at most 6) and six decimals, without an exponent and without zeros at the end:
/// "2.8", "0.0125", "12346", "0" for 2.4e-13.
std::string Short(double value, int digits = 4);

/// A length in the unit that suits its size: "8.03 um", "51.3 mm", "2.31 m", from 100 km on "250 km".
std::string LengthText(Metres length, int digits = 5);

}  // namespace lensd
