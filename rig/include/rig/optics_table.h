// From a motor's own units to optics and back: the one place where native units meet metres and f-numbers.
#pragma once

#include <optional>

#include "base/result.h"
#include "base/units.h"
#include "drivers/api/device.h"
#include "drivers/api/lens.h"

namespace lensd::rig {

/// The nominal calibration of one lens: focus position even in extension, iris position even in log(f-number), each
/// across the whole range of its axis (focus the other way round where larger positions focus farther); an axis whose
/// native unit is optical already (dioptres, f-number) means what it says. Pure; every conversion is the inverse of its
/// twin to rounding. Lengths and f-numbers outside the range are extrapolated: limits are for the caller to judge.
class OpticsTable {
 public:
  /// InvalidArgument: a focal length or f-number that is not above 0, an empty range, a focus inside -f.
  static Result<OpticsTable> Create(const drivers::NominalOptics& optics, const drivers::Capabilities& lens,
                                    bool near_positive = true);

  const drivers::NominalOptics& nominal() const { return optics_; }
  Metres focal_length() const { return Metres{optics_.focal_length_m}; }
  /// A lens without a motorised iris has one f-number only where the range is a single one.
  std::optional<FNumber> fixed_f_number() const;
  bool has_focus() const { return focus_.has_value(); }
  bool has_iris() const { return iris_.has_value(); }

  /// Focus axis; has_focus() must hold.
  Metres ExtensionFromNative(Native focus) const;
  Native NativeFromExtension(Metres extension) const;
  /// Iris axis; has_iris() must hold.
  FNumber FNumberFromNative(Native iris) const;
  Native NativeFromFNumber(FNumber f_number) const;

 private:
  OpticsTable() = default;

  drivers::NominalOptics optics_;
  double extension_at_minimum_m_ = 0.0;  ///< of the focus axis' native range
  double extension_at_maximum_m_ = 0.0;
  std::optional<drivers::AxisCapabilities> focus_;
  std::optional<drivers::AxisCapabilities> iris_;
};

}  // namespace lensd::rig
