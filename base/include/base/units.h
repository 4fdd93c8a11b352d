// Units as one-field types, so that a dioptre is never handed over as a metre.
#pragma once

#include <compare>

namespace lensd {

/// A number with a unit. `value` is in the unit the alias below names. Sums and scalings keep the unit; a quotient of
/// two quantities of one unit is a plain ratio.
template <class Unit>
struct Quantity {
  double value = 0.0;

  friend constexpr auto operator<=>(Quantity, Quantity) = default;
  friend constexpr Quantity operator+(Quantity a, Quantity b) { return {a.value + b.value}; }
  friend constexpr Quantity operator-(Quantity a, Quantity b) { return {a.value - b.value}; }
  friend constexpr Quantity operator-(Quantity a) { return {-a.value}; }
  friend constexpr Quantity operator*(Quantity a, double factor) { return {a.value * factor}; }
  friend constexpr Quantity operator*(double factor, Quantity a) { return {a.value * factor}; }
  friend constexpr Quantity operator/(Quantity a, double divisor) { return {a.value / divisor}; }
  friend constexpr double operator/(Quantity a, Quantity b) { return a.value / b.value; }
};

/// Lengths in metres: depths, focal lengths, extensions, blur diameters, wavelengths.
using Metres = Quantity<struct MetresUnit>;
/// Vergence in 1/m. Infinity is 0, never a large number; negative is past infinity.
using Dioptres = Quantity<struct DioptresUnit>;
/// Ratio of focal length to aperture diameter, > 0.
using FNumber = Quantity<struct FNumberUnit>;
/// A device's own position unit (steps, dioptres, f-number): meaningful only below the calibration curve.
using Native = Quantity<struct NativeUnitTag>;
/// Degrees Celsius.
using Celsius = Quantity<struct CelsiusUnit>;

}  // namespace lensd
