// From a motor's own units to optics and back: the one place where native units meet metres and f-numbers.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "drivers/api/device.h"
#include "drivers/api/lens.h"
#include "optics/object_depth.h"
#include "rig/calibration.h"
#include "rig/config.h"

namespace lensd::rig {

/// A thermometer's noise is no change of temperature: conditions state it in steps of this, and half a step counts in
/// every bound.
constexpr Celsius kTemperatureStep{0.1};

/// What the meaning of a focus position depends on besides the position.
struct Conditions {
  std::optional<Native> zoom;
  std::optional<Native> filter;
  std::optional<Celsius> temperature;  ///< to kTemperatureStep
  bool operator==(const Conditions&) const = default;
};

/// One lens under one set of conditions: its nominal figures and, where there is one, its calibration. Nominally focus
/// is even in extension and the iris even in log(f-number), each across the whole range of its axis (focus the other
/// way round where larger positions focus farther); an axis whose native unit is optical already (dioptres, f-number,
/// millimetres) means what it says. Immutable and cheap to copy. Every conversion is the inverse of its twin to
/// rounding and strictly monotone. What lies outside the range is extrapolated: limits are for the caller to judge.
class OpticsTable {
 public:
  /// InvalidArgument: a focal length or f-number that is not above 0, an empty range, a focus inside -f; a calibration
  /// that does not rise or fall throughout, or contradicts the configured direction. Of `config` count direction,
  /// approach, temperature, tolerance and wavelength.
  static Result<OpticsTable> Create(const drivers::NominalOptics& optics, const drivers::Capabilities& lens,
                                    const RigConfig& config, std::shared_ptr<const Calibration> calibration);
  /// The same lens under other conditions.
  OpticsTable In(const Conditions& conditions) const;
  const Conditions& conditions() const { return conditions_; }

  const drivers::NominalOptics& nominal() const;
  /// At extension 0 under these conditions.
  Metres focal_length() const { return focal_length_; }
  /// How far the lens centre stands nearer to the scene than at the shortest focal length.
  Metres centre_shift() const;
  /// Of the lens focused at `extension`: breathing changes it.
  Metres FocalLengthAt(Metres extension) const;
  /// A lens without a motorised iris has one f-number only where the range is a single one.
  std::optional<FNumber> fixed_f_number() const;
  /// Whether the direction in which focus counts must be known. Where it is not, conversions go as if it were
  /// near-positive: right for what does not depend on where the motor stands, such as the extensions that there are,
  /// and for nothing else.
  enum class Direction { Needed, NotNeeded };
  /// Positions of focus can be told in optics.
  bool has_focus(Direction direction = Direction::Needed) const;
  bool has_iris() const;
  bool has_zoom() const;

  /// Focus axis; has_focus(Direction::NotNeeded) must hold.
  Metres ExtensionFromNative(Native focus) const;
  Native NativeFromExtension(Metres extension) const;
  /// What the position would mean without a calibration.
  Metres NominalExtension(Native focus) const;
  /// The plane in focus at an extension > -f, breathing counted, and back. The way back: as optics::FocusExtension().
  Dioptres VergenceFromExtension(Metres extension) const;
  Result<Metres> ExtensionInFocus(optics::ObjectDepth depth) const;
  /// Iris axis; has_iris() must hold.
  FNumber FNumberFromNative(Native iris) const;
  Native NativeFromFNumber(FNumber f_number) const;
  /// Zoom axis; has_zoom() must hold.
  Metres FocalLengthFromNative(Native zoom) const;
  Native NativeFromFocalLength(Metres focal_length) const;

  /// How far the true figure may be from what a conversion says because of the calibration, the temperature and the
  /// focal length's tolerance: not counting where the motor really stands. 0 where nothing is known of it: see grade().
  Metres ExtensionError(Native focus) const;
  Dioptres VergenceError(Native focus) const;
  double FNumberError() const;      ///< relative
  double FocalLengthError() const;  ///< relative

  /// Of focus, under these conditions and at this position or over its whole range.
  Grade GradeAt(Native focus) const;
  Grade grade() const;
  /// Greatest ExtensionError() between the ends of what was measured; nothing where uncalibrated.
  std::optional<Metres> error() const;

 private:
  struct Lens;
  struct Part {
    std::size_t curve = 0;
    double weight = 1.0;
  };
  OpticsTable() = default;
  void ChooseCurves();
  bool Narrow(const std::function<std::optional<double>(const FocusCurve&)>& key, std::optional<double> wanted);
  void SetTemperature();
  double Curves(double native) const;
  double CurveError(double native) const;
  Metres TemperatureError() const;

  std::shared_ptr<const Lens> lens_;
  Conditions conditions_;
  Metres focal_length_;
  std::vector<Part> parts_;  ///< of the focus curves; none: nominal
  double offset_m_ = 0.0;    ///< of the temperature
  bool outside_ = false;     ///< the conditions lie outside what was measured
  double range_c_ = 0.0;     ///< how far the temperature may be from that of the curves
};

}  // namespace lensd::rig
