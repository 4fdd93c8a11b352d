// From a motor's own units to optics and back: the one place where native units meet metres and f-numbers.
#pragma once

#include <optional>

#include "base/result.h"
#include "base/units.h"
#include "drivers/api/device.h"
#include "drivers/api/lens.h"

namespace lensd::rig {

/// The nominal calibration of one lens: focus position even in extension, iris position even in log(f-number), each
/// across the whole range of its axis; an axis whose native unit is optical already (dioptres, f-number) means what it
/// says. Pure; every conversion is the inverse of its twin to rounding.
class OpticsTable {
 public:
  /// InvalidArgument: a focal length or f-number that is not above 0, or an empty range.
  static Result<OpticsTable> Create(const drivers::NominalOptics& optics, const drivers::Capabilities& lens);

  Metres focal_length() const { return Metres{optics_.focal_length_m}; }
  const drivers::NominalOptics& nominal() const { return optics_; }
  bool has_focus() const { return focus_.has_value(); }
  bool has_iris() const { return iris_.has_value(); }

  /// Focus axis; has_focus() must hold.
  Metres ExtensionFromNative(Native focus) const;
  Native NativeFromExtension(Metres extension) const;
  /// Iris axis; has_iris() must hold.
  FNumber FNumberFromNative(Native iris) const;
  Native NativeFromFNumber(FNumber f_number) const;

  /// Vergence of the plane in focus at this extension, and back: U = e/(f(f+e)). Negative past infinity.
  Dioptres VergenceFromExtension(Metres extension) const;
  /// OutOfRange: at or inside the focal length, where nothing can be focused.
  Result<Metres> ExtensionFromVergence(Dioptres vergence) const;
  /// From the lens centre, by Newton's form e = f²/(Z-f). OutOfRange as above.
  Result<Metres> ExtensionFromDistance(Metres distance) const;

 private:
  OpticsTable() = default;

  drivers::NominalOptics optics_;
  std::optional<drivers::AxisCapabilities> focus_;
  std::optional<drivers::AxisCapabilities> iris_;
};

}  // namespace lensd::rig
