// Where focus lies over coordinates that are not the lens's own, such as those of a stage: the samples that are kept
// with the calibration, and what they say of a place under the conditions of this moment.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autofocus/coordinate_surface.h"
#include "base/result.h"
#include "base/settings.h"
#include "base/units.h"

namespace lensd::rig {

class Rig;
struct Status;

/// What the samples of one surface have in common, or are corrected for.
struct FocusAtConditions {
  std::optional<Native> zoom;
  std::optional<Native> filter;
  std::optional<Celsius> temperature;
  std::optional<FNumber> f_number;   ///< told, and not judged
  std::optional<Metres> wavelength;  ///< of the light, as configured
  bool approach_up = true;           ///< the side that focus is approached from
};

/// Focus found at one place.
struct FocusAtSample {
  std::vector<double> at;  ///< one value for each coordinate
  Native position;
  Native sigma;  ///< of that, above zero
  FocusAtConditions under;
  std::string made;  ///< when, for people
};

struct FocusAtCoordinate {
  std::string name;
  std::string unit;  ///< empty: none
  bool operator==(const FocusAtCoordinate&) const = default;
};

struct FocusAtSamples {
  static constexpr std::size_t kMost = 30, kMostCoordinates = 3;
  static constexpr double kLeastSigma = 1e-6, kMostSigma = 1e9;  ///< native units
  std::vector<FocusAtCoordinate> coordinates;
  std::vector<FocusAtSample> samples;
};

/// The samples as positions of this moment, and the surface through them.
struct FocusAtFit {
  std::vector<FocusAtCoordinate> coordinates{};
  std::vector<autofocus::SurfaceSample> samples{};
  std::optional<autofocus::CoordinateSurface> surface{};
  std::string why_none{};                   ///< without a surface
  Native correction{};                      ///< mean of what the temperature has added to the samples
  Native correction_sigma{};                ///< of that: one error for all of them
  std::optional<std::vector<double>> next;  ///< where another sample would tell most
  std::string remark{};                     ///< what the samples do not tell, and which to forget; empty: nothing
  /// OutOfRange: outside the samples, or no surface.
  Result<autofocus::SurfaceFocus> At(const std::vector<double>& at) const;
};

/// All but the approach, which is the rig's own.
FocusAtConditions FocusAtConditionsOf(const Status& status, std::optional<Metres> wavelength);
/// Standard deviation of a focus position, in native units, from that of its vergence; never below what the motor's
/// steps leave open. Nothing: the optics are not known.
std::optional<Native> NativeSigma(const Rig& rig, Native position, Dioptres sigma);

/// InvalidArgument: other coordinates than the samples have. Unsupported: other conditions. OutOfRange: too many, or no
/// place of focus. NotHomed: positions of this lens mean nothing yet.
Result<void> AddFocusAt(FocusAtSamples& known, const std::vector<FocusAtCoordinate>& coordinates, FocusAtSample sample,
                        const Rig& rig);
/// Unsupported: the samples are of other conditions than `now`, and cannot be corrected for that.
Result<FocusAtFit> FitFocusAt(const FocusAtSamples& known, const Rig& rig, FocusAtConditions now);

/// "x=12.5mm y=3mm".
std::string PlaceText(const std::vector<FocusAtCoordinate>& coordinates, const std::vector<double>& at);
/// What is wrong with coordinates that are not those of the surface.
std::string OtherCoordinates(const std::vector<FocusAtCoordinate>& known, const std::vector<FocusAtCoordinate>& asked);

/// Name and unit are words of at most 32 plain characters; a unit may be empty.
bool IsFocusAtCoordinate(const FocusAtCoordinate& coordinate);

/// [focus_at] of a calibration file.
Result<FocusAtSamples> ReadFocusAt(const Settings& table);
std::string FocusAtText(const FocusAtSamples& known);

}  // namespace lensd::rig
