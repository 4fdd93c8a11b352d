// What is known of one axis beyond its last reading: the backlash not taken up, the travel since its reference, who
// moved it last, and so how far its mechanism may be from where the readings say it is.
#pragma once

#include <optional>

#include "rig/motion.h"
#include "rig/motion/axis_setup.h"
#include "rig/position_memory.h"

namespace lensd::rig {

/// Backlash not taken up. Only travel in the approach direction takes it up; whatever may have gone the other way puts
/// all of it back. Never too small, whatever the readings miss between them; sometimes too large.
class BacklashState {
 public:
  /// `upward`: of the approach; `noise`: readings scatter by up to this either way.
  BacklashState(double backlash, double noise, bool upward);
  /// All of it, and nothing is taken up before the axis is seen standing after `since`.
  void Reset(Instant since);
  void Note(Native position, bool moving, Instant sampled_at);
  /// What remains, native units, the scatter of the readings counted; 0: taken up.
  double left() const;
  /// What remains of the mechanism's own backlash.
  double residue() const;
  /// The travel that takes all of it up for certain.
  double whole() const { return whole_; }
  /// As it was remembered.
  void Restore(double left, Native position);

 private:
  double backlash_;
  double whole_;
  double reversal_;
  double sign_;
  std::optional<Instant> since_;  ///< waits for a standing reading from after this
  bool begun_ = false;
  double anchor_ = 0.0;  ///< lowest place since it was whole, upward in the approach direction
  double peak_ = 0.0;    ///< highest place after that
};

class AxisTrack {
 public:
  explicit AxisTrack(const AxisSetup& setup);

  /// Takes note of a reading, unless that is of no place of the axis. `ours`: a motion of this rig is under way, or has
  /// not been seen to come to rest.
  void Note(const drivers::AxisState& state, Instant sampled_at, bool ours);
  enum class Way { Onward, MayTurn };
  /// A command goes out now. MayTurn: away from the approach direction, or from an axis that moves.
  void Commanded(Way way, Instant now);
  /// The motion ended early: where it turns is not known.
  void Disturbed(Instant now) { slack_.Reset(now); }
  /// The setup's backlash has changed.
  void BacklashChanged();
  /// The motion ended at its target.
  void Arrived();
  /// The motion ended because another program moved the axis; false: what looked so has another cause.
  void TakenAway(bool by_another) { moved_by_ = {.us = moved_by_.us && !by_another, .another = by_another}; }
  enum class Until { SeenAtRest, SeenToChange, Arrival };
  struct Adrift {
    double by = 0.0;
    Until until = Until::Arrival;
  };
  /// The motion ended unseen: the mechanism may be this far from the readings, native units, until a motion arrives, or
  /// already until the device says where it stands without taking it for granted, or until its readings, which had
  /// ceased to change, show that they still can.
  void LoseSight(Adrift within) { adrift_ = within; }
  /// Stands at the reference.
  void Homed(Instant now);

  const BacklashState& slack() const { return slack_; }
  /// The mechanism stands within this of the readback, native units, where its last motion was seen to end.
  double Bound() const;
  /// What is to be added where it was not; 0: it was.
  double adrift() const { return adrift_.by; }
  /// The last motion asked of the axis ended at its target; true if none was.
  bool arrived() const { return arrived_; }
  /// The same of the end of a motion from `position`.
  Arrival NextArrival(Native position) const;
  /// The position means something: nothing has put it in doubt since the reference.
  bool known() const { return place_.known; }
  /// Its count has come to mean nothing, and it cannot search a reference: somebody has to say where it stands.
  bool lost() const { return setup_.OnlyCounts() && !place_.known; }
  /// Somebody has said where it stands, and it has not lost count since.
  bool said() const { return place_.said; }
  /// Native units since the reference was last passed; 0: it stands there.
  double travel() const { return travel_; }
  bool moved_by_us() const { return moved_by_.us; }
  bool moved_by_another() const { return moved_by_.another; }
  /// To be added to the device's positions.
  Native offset() const { return place_.offset; }

  /// What to remember of it while it stands.
  AxisMemory Remember(Native position) const;
  /// At the start: what to make of `memory` under the axis' policy, the device saying `state`. Sets offset and known.
  void Recall(const AxisMemory& memory, const drivers::AxisState& state);
  /// It answers again, after it did not, the device saying `state`: what its position is worth. `before`: as it was
  /// last known, on its way to `target`, if to anywhere.
  void Return(const AxisMemory& before, std::optional<Native> target, const drivers::AxisState& state);
  /// Nothing is known any more, and where it stands next is nobody's motion.
  void Forget();
  /// Of an axis that counts: whether a reading, in the device's own count, is that of a device which has begun to
  /// count from zero anew, since no motion explains it. `ours`: the leg of this rig that is under way.
  struct Heading {
    Native target;
    bool live = false;  ///< readings have shown it on its way
  };
  bool FellToZero(Native device, Instant sampled_at, const std::optional<Heading>& ours) const;
  /// Of an axis that only counts: whether it cannot have come to a reading, in the device's own count, since the one
  /// before. `ours`: the leg of this rig that is under way; `swept`: where the motions since it last rested may lead.
  bool Strays(Native device, Instant sampled_at, const std::optional<Heading>& ours,
              const std::optional<AxisMemory>& swept) const;
  /// The device's own count is zero, or as near to it as a motor that has just got power.
  bool AtZero(Native device) const;
  /// Two readings, in the device's own count, show an axis that stands at zero.
  bool StandsAtZero(Native device, Native before) const;
  /// It has lost count. Positions of an axis without a reference are the device's own from now on.
  void LoseCount();
  /// It stands at `position`, which the device calls `device`: somebody has said so.
  void Say(Native position, Native device);

 private:
  /// What its positions mean.
  struct Place {
    bool known = true;
    bool said = false;
    Native offset{};
  };
  struct Reading {
    Native position;
    Instant changed{};  ///< the first reading that said so, or the last command, whichever is later
    bool moving = false;
  };
  struct MovedBy {
    bool us = false;
    bool another = false;
  };
  double Scatter() const;
  double PowerUpScatter() const;
  bool TooFast(Native here, Instant sampled_at) const;
  bool Near(Native a, Native b) const;
  bool Stands(const AxisMemory& memory, Native device) const;
  void Trust(const AxisMemory& memory, Native position);
  void TakeUp(const AxisMemory& memory, Native device);

  const AxisSetup& setup_;
  BacklashState slack_;
  std::optional<Reading> last_;
  std::optional<Native> rest_;  ///< where it should stand
  double travel_ = 0.0;
  double doubt_ = 0.0;  ///< native units: a remembered position that could not be told better
  Adrift adrift_;
  bool arrived_ = true;
  Place place_;
  MovedBy moved_by_;
};

}  // namespace lensd::rig
