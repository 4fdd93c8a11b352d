// Where every axis was, lately: so that a frame can be told what the lens did while it was exposed.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/clock.h"
#include "drivers/api/lens.h"
#include "rig/rig.h"

namespace lensd::rig {

/// The readings of the last seconds. A reading says where an axis was at one instant; between two of them it is taken
/// to have been between both. Some thousand are kept while an axis moves, in one block that is used again and again.
class History {
 public:
  /// `tolerance`: positions that differ by no more are one place.
  explicit History(const drivers::PerAxis<double>& tolerance) : tolerance_(tolerance) {}
  /// Readings in order of time; one that is not newer than the last is ignored.
  void Add(const drivers::LensState& state);
  /// Forgets everything: after a gap in which anything may have happened.
  void Clear();
  /// What each axis did from `begin` to `end`: hull of the readings in the interval and its neighbours on either side.
  /// Moving where a reading in that hull says so, the positions differ by more than the tolerance, or no reading covers
  /// the end yet or the start any more. `mid` and its bound, as far as readings tell, are those of half-time.
  drivers::PerAxis<std::optional<LensedFrame::AxisDuring>> During(Instant begin, Instant end) const;

 private:
  struct Place {
    Native position{};
    bool known = false;
    bool moving = false;
    bool operator==(const Place&) const = default;
  };
  struct Reading {
    Instant sampled_at;
    drivers::PerAxis<Place> axes;
  };

  static Reading ReadingOf(const drivers::LensState& state);
  static bool SameAxes(const Reading& a, const Reading& b);
  std::span<const Reading> kept() const { return std::span(readings_).subspan(past_); }
  LensedFrame::AxisDuring AtMid(LensedFrame::AxisDuring hull, drivers::Axis axis, Instant mid) const;

  drivers::PerAxis<double> tolerance_;
  std::vector<Reading> readings_;
  std::size_t past_ = 0;  ///< of these, from the first, that are not kept any more
};

}  // namespace lensd::rig
