// Where something is along the axis, as a distance or as a vergence, whichever it was given as.
#pragma once

#include <limits>
#include <optional>

#include "base/units.h"
#include "optics/thin_lens.h"

namespace lensd::optics {

/// Axial place of an object measured from the lens centre. Each form keeps its own digits: a distance close to the
/// focal length and a vergence close to zero would both lose theirs if turned into the other, so every formula has one
/// branch for each. Distances are > 0, infinity allowed; vergences are finite, 0 is infinity, negative is past infinity
/// (light that converges towards the lens). Both unit types convert implicitly.
class ObjectDepth {
 public:
  constexpr ObjectDepth(Metres distance) : value_(distance.value), is_distance_(true) {}     // NOLINT(*-explicit-*)
  constexpr ObjectDepth(Dioptres vergence) : value_(vergence.value), is_distance_(false) {}  // NOLINT(*-explicit-*)

  constexpr bool is_distance() const { return is_distance_; }
  /// U = 1/Z_o.
  Dioptres vergence() const;
  /// Z_o; nothing at infinity and past it, where there is no such distance.
  std::optional<Metres> distance() const;
  /// The place as a pair (z, w) of exactly what was given, for the formulas of thin_lens.h.
  constexpr thin_lens::AxialPlace<double> place() const {
    if (!is_distance_) return {1.0, value_};
    if (value_ == std::numeric_limits<double>::infinity()) return {1.0, 0.0};
    return {value_, 1.0};
  }
  /// W = 1 - f U = (Z_o - f)/Z_o: 1 at infinity, 0 in the front focal-point plane, negative inside it.
  double FocusGap(Metres focal_length) const;

 private:
  double value_;
  bool is_distance_;
};

}  // namespace lensd::optics
