// Where every axis was, lately: so that a frame can be told what the lens did while it was exposed.
#pragma once

#include <deque>

#include "base/clock.h"
#include "drivers/api/lens.h"
#include "rig/rig.h"

namespace lensd::rig {

/// The readings of the last seconds. A reading says where an axis was at one instant; between two of them it is taken
/// to have been between both.
class History {
 public:
  /// `tolerance`: positions that differ by no more are one place.
  explicit History(const drivers::PerAxis<double>& tolerance) : tolerance_(tolerance) {}
  /// Readings in order of time; one that is not newer than the last is ignored.
  void Add(const drivers::LensState& state);
  /// Forgets everything: after a gap in which anything may have happened.
  void Clear() { readings_.clear(); }
  /// What each axis did from `begin` to `end`: hull of the readings in the interval and its neighbours on either side.
  /// Moving where a reading in that hull says so, the positions differ by more than the tolerance, or no reading covers
  /// the end yet or the start any more. `mid` and its bound, as far as readings tell, are those of half-time.
  drivers::PerAxis<std::optional<LensedFrame::AxisDuring>> During(Instant begin, Instant end) const;

 private:
  LensedFrame::AxisDuring AtMid(LensedFrame::AxisDuring hull, drivers::Axis axis, Instant mid) const;

  drivers::PerAxis<double> tolerance_;
  std::deque<drivers::LensState> readings_;
};

}  // namespace lensd::rig
