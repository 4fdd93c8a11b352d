// The inside of an optics table: one lens, under any conditions.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "optics/conjugates.h"
#include "rig/calibration/curve.h"
#include "rig/direction.h"
#include "rig/optics_table.h"

namespace lensd::rig {

/// Length of an axis' native range.
inline double Span(const drivers::AxisCapabilities& axis) {
  return (axis.maximum - axis.minimum).value;
}

/// What does not depend on the conditions.
struct OpticsTable::Lens {
  drivers::NominalOptics nominal;
  std::shared_ptr<const Calibration> calibration;  ///< may be null
  FocusDirection direction;                        ///< in which the native range of focus counts
  double tolerance = 0.0;                          ///< of the focal length
  std::optional<Metres> wavelength;
  bool compensate = false;
  std::optional<TemperatureModel> temperature;
  double extension_at_minimum_m = 0.0;  ///< of the focus axis' native range, nominally
  double extension_at_maximum_m = 0.0;
  std::optional<drivers::AxisCapabilities> focus, iris, zoom;
  double nominal_shift = 0.0;   ///< native units: the nominal figures hold moving toward near
  double nominal_unsure = 0.0;  ///< of that

  struct Focus {
    const FocusCurve* measured = nullptr;
    std::optional<Curve> extension;  ///< metres over native, as if approached from the lens' own side
    bool from_vergence = false;      ///< what was measured is where it focuses, not how far the sensor is
    double error_m = 0.0;            ///< the curve's own, and that of the backlash it was shifted by
  };
  std::vector<Focus> curves;
  std::optional<Curve> iris_curve;  ///< log(f-number) over native
  std::optional<Curve> zoom_curve;  ///< metres over native
  std::optional<Curve> breathing;   ///< ratio over metres of extension
  std::vector<std::pair<double, double>>
      centre_shift;  ///< metres over metres of focal length, rising; straight between

  /// A liquid lens' power is even across its axis.
  double LiquidExtensionAt(double part) const {
    const double low = 1.0 / (nominal.focal_length_m - extension_at_minimum_m);
    const double high = 1.0 / (nominal.focal_length_m - extension_at_maximum_m);
    return nominal.focal_length_m - 1.0 / std::lerp(low, high, part);
  }
  double NominalExtension(double native, Metres focal_length) const {
    native -= nominal_shift;
    if (nominal.liquid) return LiquidExtensionAt((native - focus->minimum.value) / Span(*focus));
    if (focus->unit == drivers::NativeUnit::Dioptres) return optics::Extension(focal_length, Dioptres{native}).value;
    if (focus->unit == drivers::NativeUnit::Millimetres) return native * 1e-3;
    return std::lerp(extension_at_minimum_m, extension_at_maximum_m, (native - focus->minimum.value) / Span(*focus));
  }
  double NominalNative(double extension, Metres focal_length) const {
    if (nominal.liquid) {
      const double low = 1.0 / (nominal.focal_length_m - extension_at_minimum_m);
      const double high = 1.0 / (nominal.focal_length_m - extension_at_maximum_m);
      const double part = (1.0 / (nominal.focal_length_m - extension) - low) / (high - low);
      return std::lerp(focus->minimum.value, focus->maximum.value, part) + nominal_shift;
    }
    if (focus->unit == drivers::NativeUnit::Dioptres) return optics::FocalPlane(focal_length, Metres{extension}).value;
    if (focus->unit == drivers::NativeUnit::Millimetres) return extension * 1e3;
    const double part = (extension - extension_at_minimum_m) / (extension_at_maximum_m - extension_at_minimum_m);
    return std::lerp(focus->minimum.value, focus->maximum.value, part) + nominal_shift;
  }
  /// Focal length over that at extension 0.
  double Ratio(double extension) const {
    if (nominal.liquid) return 1.0 - extension / nominal.focal_length_m;
    if (!breathing) return 1.0;
    return breathing->At(std::clamp(extension, breathing->low(), breathing->high()));
  }
  /// `warmth`: what temperature adds to the extension. It moves no lens group: breathing does not follow it.
  Dioptres Vergence(double focal_length, double extension, double warmth) const {
    return optics::FocalPlane(Metres{focal_length * Ratio(extension - warmth)}, Metres{extension});
  }
  Result<double> Extension(double focal_length, optics::ObjectDepth depth, std::optional<Metres> longest,
                           double warmth) const;
  /// A position reached moving toward far means what one farther along by the backlash means moving toward near.
  struct ApproachShift {
    double native = 0.0;  ///< to add to positions reached moving toward the other side than this lens'
    double unsure = 0.0;
  };
  /// Nothing: the backlash of focus is neither configured, measured nor known to the driver.
  std::optional<ApproachShift> ShiftToOwnApproach(const AxisConfig& axis) const;
  void PlaceNominal(const AxisConfig& axis);
  Result<void> AddFocus(const FocusCurve& measured, const RigConfig& config);
  Result<void> AddCalibration(const RigConfig& config);
};

}  // namespace lensd::rig
