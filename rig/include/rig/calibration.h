// What has been measured of one lens, and the file it is kept in.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/settings.h"
#include "base/units.h"
#include "drivers/api/lens.h"
#include "rig/focus_at.h"
#include "rig/focus_shift.h"

namespace lensd::rig {

/// How far positions can be trusted.
enum class Grade {
  Uncalibrated,  ///< nominal figures, error unknown
  Approximate,   ///< from a data sheet, or used outside what was measured; the error is an estimate
  Calibrated,    ///< measured, with its error
};
/// "uncalibrated", "approximate", "calibrated".
std::string_view GradeName(Grade grade);

/// One focus position and where it focuses: exactly one of extension and vergence.
struct FocusPoint {
  Native position;
  std::optional<Metres> extension;
  std::optional<Dioptres> vergence;
};

/// Focus under one set of conditions. A condition that is left out does not matter.
struct FocusCurve {
  bool approach_near = true;           ///< positions were reached moving toward near
  std::optional<Metres> focal_length;  ///< the zoom stood there
  std::optional<double> filter;        ///< native position of the filter axis
  std::optional<Metres> wavelength;    ///< of the light
  std::optional<Celsius> temperature;  ///< of the lens
  Metres error;                        ///< the true extension is within this of the curve, between its ends
  std::vector<FocusPoint> points;      ///< at least two, positions rising, extensions all rising or all falling
  bool SameConditions(const FocusCurve& other) const;
};

/// Positions of an axis and what they mean: f-numbers (iris) or metres of focal length (zoom).
struct AxisCurve {
  struct Point {
    Native position;
    double value = 0.0;
    std::optional<Metres> centre_shift = std::nullopt;  ///< zoom: how far the lens centre has moved toward the scene
  };
  double error = 0.0;         ///< relative
  std::vector<Point> points;  ///< at least two, positions rising, values all rising or all falling; all shift or none
};

/// Focus breathing: the focal length at an extension, relative to that at extension 0.
struct BreathingPoint {
  Metres extension;
  double ratio = 1.0;
};

struct TemperatureModel {
  Metres per_degree;        ///< extension gained per degree at one focus position
  Metres per_degree_error;  ///< of that
  Celsius reference{20.0};  ///< of curves that state no temperature
  Celsius coldest{0.0};     ///< where the lens may be used: counts in bounds where there is no thermometer
  Celsius hottest{40.0};
};

/// Native units lost at a reversal.
struct Backlash {
  double steps = 0.0;
  double low = 0.0;  ///< 95 % confidence interval; both equal to `steps` where a person said so
  double high = 0.0;
  bool measured = false;
};

/// Everything known about one lens. Empty parts leave the nominal figures in force.
struct Calibration {
  std::string serial;  ///< of the lens; empty where it has none
  std::string made;    ///< one line for people: when and how
  Grade grade = Grade::Calibrated;
  std::vector<FocusCurve> focus;
  std::optional<AxisCurve> iris;
  std::optional<AxisCurve> zoom;
  std::vector<BreathingPoint> breathing;  ///< empty, or at least two, extensions rising
  std::optional<TemperatureModel> temperature;
  drivers::PerAxis<std::optional<Backlash>> backlash;
  std::vector<FocusShift> focus_shifts;    ///< each of another pair
  std::optional<FocusAtSamples> focus_at;  ///< not of the lens alone: of where it is mounted

  /// Replaces the curve of the same conditions, or the shift of the same pair, or adds one.
  void Put(FocusCurve curve);
  void Put(FocusShift shift);
};

/// A focus curve through measured points, in any order, several of which may be of the same depth: those become their
/// mean. The error, unless given, is estimated: how far each depth lies from a curve through all the others, and how
/// far positions of one depth scatter; that takes at least four depths. `resolution` is that of the axis, native units.
/// The curve's conditions are left to the caller but for `focal_length`. InvalidArgument: fewer than two depths, depths
/// that are out of order, no error given with fewer than four depths.
Result<FocusCurve> FitFocusCurve(std::vector<FocusPoint> points, Metres focal_length, std::optional<Metres> error,
                                 double resolution);

/// Reads a calibration file: version = 1, unknown keys are errors. BadData: "file:line: what is wrong".
Result<Calibration> ReadCalibration(const Settings& file);

/// The same as a file a person can read; ReadCalibration() of it gives the same calibration to rounding.
std::string CalibrationText(const Calibration& calibration);

}  // namespace lensd::rig
