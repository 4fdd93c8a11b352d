// Where something is along the axis, as a distance or as a vergence, whichever it was given as.
#pragma once

#include <optional>

#include "base/units.h"

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
  /// W = 1 - f U = (Z_o - f)/Z_o: 1 at infinity, 0 in the front focal-point plane, negative inside it.
  double FocusGap(Metres focal_length) const;

  /// U_a - U_b without first rounding either vergence.
  friend Dioptres VergenceDifference(ObjectDepth a, ObjectDepth b);

 private:
  double value_;
  bool is_distance_;
};

Dioptres VergenceDifference(ObjectDepth a, ObjectDepth b);

}  // namespace lensd::optics
