// One motion of one axis, from the command to the truth about how it ended.
//
// A motion is followed through readings only: it is done when the device is not busy *and* stands at the target, which
// does not depend on ever having seen it busy. Readings taken before the command was given prove nothing and are
// ignored. What does not get on is reported after kStallTime, what gets on too slowly at the deadline; what comes to
// rest elsewhere is sent again a few times and then reported as missed; what goes away from where it was sent is
// another program's motion. Arrival is always from one side, with the backlash taken up: where it would not be, the
// motion first overshoots. The rules are those of the EPICS motor record where it has them.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/api/lens.h"
#include "rig/motion.h"
#include "rig/motion/axis_setup.h"
#include "rig/motion/axis_track.h"
#include "rig/motion/leg.h"

namespace lensd::rig {

/// The motor of one axis, as a motion commands it.
class Motor {
 public:
  virtual ~Motor() = default;
  /// `begins`: a leg of its own, not a later part of a shaped step. The answer is when it was told: the disk comes
  /// first.
  virtual Result<Instant> Go(Native target, bool begins) = 0;
  virtual Result<Instant> Home() = 0;
  /// Where that fails it is done again at the next reading. Unsupported: it cannot stop midway.
  virtual Result<void> Halt() = 0;
  /// The reference has been found. What a reading taken before this call means now.
  virtual Native AtReference(Native position) = 0;
};

/// When an arrival must be preceded by an overshoot.
enum class TakeUp {
  Always,     ///< unless travelling to the target takes up all backlash anyway
  FromBeyond  ///< only when coming from beyond the target: enough while nothing else has moved the axis
};

struct MotionRequest {
  std::optional<Native> target;                    ///< nothing: the reference
  double overshoot = 0.0;                          ///< native units
  TakeUp take_up = TakeUp::Always;                 ///< when
  std::optional<std::vector<Impulse>> parts = {};  ///< how each leg is divided, instead of the configured way
  bool home_first = false;                         ///< the reference is searched before it goes to its target
  bool known = true;                               ///< it was known where it stands when this was asked for
  MoveCallback done;
};

/// "; the motor was told to stop", or why it was not: the end of a message on a motion that was given up.
std::string HaltText(const Result<void>& halted);

class AxisMotion {
 public:
  AxisMotion(const AxisSetup& setup, const AxisTrack& track, MotionRequest request, Instant now)
      : setup_(setup),
        track_(track),
        request_(std::move(request)),
        began_at_(now),
        last_step_at_(now),
        leg_(Leg::Stay(setup, {}, now)) {}

  /// Commands the motor where that is due and judges the newest reading. The end, once there is one: an outcome, or
  /// an error where the device would not take the command.
  std::optional<Result<MoveOutcome>> Step(Motor& motor, const drivers::AxisState& state, Instant sampled_at,
                                          Instant now);

  /// It was told to stop and cannot: it takes no further command, and ends with Cancelled once it rests.
  void LetRunOut();
  /// It ended without having been seen to its end: the axis is within this of its reading; by 0: it was seen.
  const AxisTrack::Adrift& adrift() const { return adrift_; }
  bool live() const { return leg_.live(); }
  /// How far from its readings it may be where it is cut short now, native units; 0: it is where they say.
  double UnseenReach(const drivers::AxisState& state) const;
  /// The motor took a command of it, or may have taken one.
  bool may_turn() const { return attempts_.commands > 0 || attempts_.in_doubt; }
  bool homing() const { return !request_.target || request_.home_first; }
  /// The lens has said where the axis stands since the motion was asked for. Nothing begins before that.
  void NoteReading() { attempts_.read = true; }
  bool may_begin() const { return attempts_.read; }
  /// It goes to its reference before its target. Before its first command.
  void HomeFirst() { request_.home_first = true; }
  /// Where the leg that is under way ends; nothing before its first command, and while the reference is searched.
  std::optional<AxisTrack::Heading> heading() const;
  /// Registers may not yet say what is, after its last command.
  bool MayLag(Instant sampled_at) const { return attempts_.commands > 0 && leg_.MayLag(sampled_at); }
  /// Motions the device was asked for so far; the parts of a shaped step are one.
  int commands() const { return attempts_.commands; }
  /// When the next part of a shaped step is due.
  std::optional<Instant> next_part() const;
  MoveCallback TakeCallback() { return std::move(request_.done); }

 private:
  enum class Phase { Requested, TakingUp, Going, Settling, Homing };
  using End = std::optional<Result<MoveOutcome>>;
  /// Where it stands, since when, and with which complaint.
  struct Rest {
    Instant stood_since{};
    Native stood_at;
    std::optional<Instant> since;  ///< on the leg's end or elsewhere
    Native elsewhere;              ///< there
    std::optional<Instant> faulty_since;
  };
  struct Attempts {
    bool read = false;                       ///< a reading has come since it was asked for
    int commands = 0;                        ///< that the motor took
    int refusals = 0;                        ///< since
    Instant refused_at{};                    ///< the first of them
    bool in_doubt = false;                   ///< a command may have been obeyed though it failed
    std::optional<Instant> busy_since = {};  ///< nothing but "busy" has been answered to a command
    Instant again_at{};                      ///< not before
    int tries = 0;                           ///< after it came to rest elsewhere
  };

  End Advance(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now);
  bool StandsThere(const drivers::AxisState& state) const;
  Native FirstLeg(const drivers::AxisState& state) const;
  End Launch(Motor& motor, const drivers::AxisState& state, Instant now);
  End LaunchHoming(Motor& motor, const drivers::AxisState& state, Instant now);
  End Begin(Motor& motor, Leg leg, Phase phase, Instant now);
  End GoOnToTarget(Motor& motor, Native from, Instant now);
  End SendParts(Motor& motor, Instant now);
  End Refused(Motor& motor, Error error, Instant now);
  void Taken();
  End Follow(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now);
  End FollowHoming(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now);
  End Arrived(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now);
  End Elsewhere(Motor& motor, const drivers::AxisState& state, Instant sampled_at, Instant now);
  bool Settled(const drivers::AxisState& state, Instant sampled_at);
  bool Faulty(const drivers::AxisState& state, Instant sampled_at);
  bool Measured(const drivers::AxisState& state) const;
  bool LostCount() const;
  MoveOutcome TakenAway(const drivers::AxisState& state, Instant now) const;
  MoveOutcome Failed(const drivers::AxisState& state, Trouble trouble, Instant now) const;
  AxisTrack::Adrift AdriftAfter(const Trouble& trouble, const drivers::AxisState& state) const;
  Error RanOut(const drivers::AxisState& state, const MoveOutcome& end) const;
  MoveOutcome Outcome(const drivers::AxisState& state, Instant now) const;
  Trouble Remark(const drivers::AxisState& state) const;

  const AxisSetup& setup_;
  const AxisTrack& track_;
  MotionRequest request_;
  Instant began_at_;
  Instant last_step_at_;
  Phase phase_ = Phase::Requested;
  Leg leg_;
  bool runs_out_ = false;
  AxisTrack::Adrift adrift_;
  Rest rest_;
  Attempts attempts_;
};

}  // namespace lensd::rig
