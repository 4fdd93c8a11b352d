// One motorised axis: what the controller counts, and where the mechanism really is.
//
// A command becomes a trapezoid of speed: stretches of constant acceleration, worked out when the command arrives and
// evaluated at any instant afterwards, so nothing has to tick. Three things stand between the count and the mechanism,
// each again in closed form, stretch by stretch:
//  - stops and lost steps: the shaft follows the count, or only part of it, and halts at the ends of its travel;
//  - backlash: the mechanism is pushed by the shaft from either side of a gap, place = clamp(place, shaft, shaft +
//  gap),
//    so that after a reversal the first `backlash` counts move nothing, and moving outward place equals shaft;
//  - compliance: the mechanism hangs on a damped spring (it rings) or creeps after the shaft with a time constant.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/clock.h"

namespace lensd::sim {

/// A time of constant acceleration. Positions in the axis' native units, times in seconds.
struct Stretch {
  double seconds = 0.0;
  double position = 0.0;  ///< at its start
  double speed = 0.0;     ///< at its start, signed
  double acceleration = 0.0;

  double TravelAfter(double t) const { return (speed + 0.5 * acceleration * t) * t; }
  double SpeedAfter(double t) const { return speed + acceleration * t; }
};
using Path = std::vector<Stretch>;

/// Where something is, and how fast it goes.
struct Motion {
  double position = 0.0;
  double speed = 0.0;
};

/// The fastest path from a place and speed to rest at `target` within a speed and an acceleration, both > 0. Where
/// there is no room to stop, it stops beyond and comes back.
Path PlanPath(double position, double speed, double target, double top_speed, double acceleration);

/// What follows `shaft` across a gap, starting at `place` in [shaft, shaft + gap].
Path ThroughBacklash(const Path& shaft, double place, double gap);

/// What follows `part` of `count`'s travel from `shaft` and halts at the ends of [low, high].
Path ThroughStops(const Path& count, double shaft, double part, double low, double high);

struct MotorSettings {
  double low = 0.0;   ///< least count
  double high = 0.0;  ///< greatest count
  double top_speed = 1.0;
  double acceleration = 1.0;
  double backlash = 0.0;
  double creep_s = 0.0;  ///< time constant; ignored where it rings
  double ring_hz = 0.0;
  double ring_damping = 0.02;
};

/// Times count from the making of the world. Commands come in order of time; the past can be asked for as far back as
/// the last few hundred commands. Not thread-safe, nor are two calls that only ask.
class Motor {
 public:
  Motor(const MotorSettings& settings, double start);

  void MoveTo(Duration at, double target);
  /// Seeks the inner stop, takes up the backlash outward and counts from `low` again.
  void Home(Duration at);
  /// Comes to rest as fast as its acceleration allows, a whole number of `grid` from `low`.
  void Halt(Duration at, double grid);

  /// Faults. Stalled: it stops dead and takes commands without moving.
  void SetStalled(Duration at, bool stalled);
  /// The part of each move that is counted but not made, 0..1.
  void SetLoss(Duration at, double part);
  /// Displaces shaft and mechanism; the count does not notice.
  void Knock(Duration at, double by);
  /// Its controller has been without power: it stops dead, counts from `low` wherever it stands, and has no reference.
  void LosePower(Duration at);

  /// How far back can be asked.
  Duration earliest() const { return LegOf(first()).start; }
  double CountAt(Duration at) const;
  bool MovingAt(Duration at) const;
  bool HomedAt(Duration at) const;
  /// A stall has cut a move off or kept one from starting.
  bool ComplainsAt(Duration at) const;
  /// Where the mechanism is, as the count that means this place when moving outward.
  double PlaceAt(Duration at) const;
  /// As PlaceAt(), once it has stopped swaying.
  double RestPlaceAt(Duration at) const;

 private:
  /// The mechanism's distance from where a rigid one would be.
  struct Sway {
    double offset = 0.0;
    double speed = 0.0;
  };
  /// Where the count is driven to: to `target`, then on by `back`.
  struct Goal {
    double target = 0.0;
    double back = 0.0;
  };
  /// What happened at `start`, and all that its paths follow from: of some hundred bytes, and none elsewhere, so that
  /// what is remembered takes the memory that it took at first.
  struct Leg {
    Duration start{};
    std::optional<Goal> goal;   ///< none: it is not driven
    double count_before = 0.0;  ///< at `start`
    double count_speed_before = 0.0;
    double shaft_before = 0.0;
    double place_before = 0.0;
    double place_speed_before = 0.0;
    double count_after = 0.0;  ///< once the path is done
    double loss = 0.0;
    Sway sway;  ///< at `start`
    bool homed_before = true;
    bool homed_after = true;
    bool complains = false;
  };
  struct Paths {
    Path count;
    Path shaft;
    Path place;
  };
  /// Legs count from 0, the motor's making.
  using Number = std::size_t;
  static constexpr Number kNone = static_cast<Number>(-1);

  Number first() const { return begun_ > legs_.size() ? begun_ - legs_.size() : 0; }
  const Leg& LegOf(Number number) const { return legs_[number % legs_.size()]; }
  Leg& newest() { return legs_[(begun_ - 1) % legs_.size()]; }
  Number NumberAt(Duration at) const;
  const Leg& LegAt(Duration at) const { return LegOf(NumberAt(at)); }
  Path CountOf(const Leg& leg) const;
  Paths PathsFrom(const Leg& leg) const;
  /// Of a leg that is remembered. Valid until the next call, or the next leg.
  const Paths& PathsOf(Number number) const;
  struct State {
    Motion count, shaft, place;
    double seconds = 0.0;  ///< since the newest leg began
  };
  /// At the beginning of the newest leg or later.
  State Now(Duration at) const;
  /// Begins a leg that continues from the state at `at`.
  Leg& Begin(Duration at, std::optional<Goal> goal);
  Sway SwayAt(Number number, double seconds) const;
  void Spring(Sway& sway, double acceleration, double seconds) const;
  void Creep(Sway& sway, const Stretch& stretch, double seconds) const;

  MotorSettings settings_;
  std::vector<Leg> legs_;  ///< a ring of all that may ever be remembered
  Number begun_ = 1;       ///< legs
  Paths newest_paths_;
  mutable Number asked_ = kNone;  ///< the older leg that was asked for last
  mutable Paths asked_paths_;
  bool stalled_ = false;
  double loss_ = 0.0;
};

}  // namespace lensd::sim
