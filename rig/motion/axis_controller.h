// One axis: the motion it is on, what its readings say, and what is remembered of it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "rig/motion/axis_motion.h"
#include "rig/motion/axis_setup.h"
#include "rig/motion/axis_track.h"
#include "rig/motion/remembered_positions.h"
#include "rig/rig.h"

namespace lensd::rig {

/// A motion that is over.
struct EndedMotion {
  MoveCallback done;
  int commands = 0;  ///< that the device took
};

/// What readings of an axis that seems to rest are judged by: any of them may be wrong.
struct RestDoubt {
  /// Whatever it says, so many such readings in a row are no false ones.
  static constexpr int kShown = 3;
  /// Readings of another place than where it rests, one after the other.
  struct Departed {
    Native place;  ///< the last of them
    Instant since{};
    int readings = 0;
  };
  Instant doubted_until{};                    ///< after a motion that was cut short registers may lag until then
  Instant commanded_at{Duration::min() / 2};  ///< the last time
  bool at_target = false;                     ///< it has been seen there since
  bool follows = false;                       ///< where it rests is not known yet: it is where its readings say
  std::optional<Native> before;               ///< the reading before the newest, in the device's own count
  std::optional<Departed> departed;           ///< from where it rests
};

/// An axis as it was when the lens ceased to answer, or a reading came that looks as if it had been without power.
struct GoneAxis {
  AxisMemory memory;
  std::optional<Native> target = {};
  bool homed = false;                        ///< as the device had it
  std::optional<Instant> fallen_since = {};  ///< when the first count came that no motion explains
  Native fallen_to = {};                     ///< which was that then
  bool strays = false;                       ///< and not zero
  bool in_doubt = false;                     ///< a command from rest may have been obeyed, or not
};
/// A reading that no motion leads to, which was believed because no question had failed.
struct Leap {
  AxisMemory before;
  Instant at{};
};

/// Every command to the motor passes here, and none goes out before it is remembered. Its owner tells the callers.
class AxisController final : private Motor {
 public:
  /// `lens`, `remembered` and `clock` must outlive it.
  AxisController(drivers::Axis axis, const drivers::AxisCapabilities& can, const AxisConfig& config,
                 drivers::Lens& lens, RememberedPositions& remembered, const Clock& clock);

  const AxisSetup& setup() const { return setup_; }
  const AxisTrack& track() const { return track_; }
  /// The newest reading; nothing before the first.
  const std::optional<drivers::AxisState>& state() const { return state_; }
  /// Nothing while none is under way.
  const AxisMotion* motion() const { return motion_.get(); }
  /// Where it was last told to go; nothing if it never was, or went elsewhere since.
  std::optional<Native> target() const { return target_; }
  bool moving() const { return motion_ || (state_ && state_->moving); }
  /// While it stands.
  Instant steady_since() const { return steady_since_; }
  /// Its position means something: it has its reference, where it has one at all, and was not lost in mid-move.
  bool known() const { return track_.known() && (!state_ || state_->homed || !setup_.can.can_home); }
  /// Motions asked of the device, all in all.
  int commands() const { return commands_ + (motion_ ? motion_->commands() : 0); }
  /// `problem`: the lens does not answer.
  AxisStatus Describe(bool problem) const;

  /// Native units from where it was told to go, or stands.
  Result<Native> Ahead(double by) const;
  /// On the axis' grid and inside its soft limits; what is off by rounding alone is brought back. OutOfRange.
  Result<Native> Land(Native wanted) const;
  /// Where a search for focus goes unless it is told: its soft limits, but of an axis that has lost count no more than
  /// one travel, by the device's count.
  std::pair<Native, Native> SearchEnds() const;
  /// Why it may not be sent to a position: that means nothing, and a search of the reference would tell.
  std::optional<Error> WhyUnknown() const;
  /// It stands at `position`: somebody says so. It has to have been read. Unsupported: something tells that better.
  /// Busy: it moves. OutOfRange: not on its travel. Timeout: a reading is in doubt. NotKept, Cancelled: nothing has
  /// changed, because that could not be remembered.
  Result<void> Say(Native position);

  /// At the first reading: what the memory makes of it.
  void Recall(const drivers::AxisState& reading);
  /// Takes note of a reading by the device's own count, and gives it by the rig's.
  std::optional<drivers::AxisState> Note(std::optional<drivers::AxisState> reading, Instant sampled_at);
  /// Link: the lens does not answer, or did not at a command. Keeps what its positions are judged by when it is back.
  /// Answer: one question or command was not answered as it should be. In both cases the motor may be without power.
  enum class Loss { Answer, Link };
  void Lose(Loss loss);
  void SetBacklash(std::optional<double> backlash);
  /// Where the side of approach becomes another, no backlash counts as taken up.
  void SetDirection(FocusDirection direction);

  /// To `target`, which the soft limits allow, and as a client wants it: with the configured checks of the reference.
  void Move(Native target, std::optional<double> take_up, MoveCallback done);
  /// The same with everything said.
  void Start(MotionRequest request);
  /// The end of its motion, once the newest reading shows one; it is still to be ended by End().
  std::optional<Result<MoveOutcome>> Advance(Instant sampled_at);
  enum class Outcome { Reached, CutShort, TakenAway };  ///< TakenAway: by another program
  /// The motion is over; nothing where there was none.
  std::optional<EndedMotion> End(Outcome outcome);
  /// Stops it, ours or another client's motion. Unsupported: it cannot, and its motion runs out.
  Result<void> Stop();
  bool runs_out() const { return !setup_.can.can_stop && motion_ && motion_->commands() > 0; }
  /// That it cannot be stopped changes nothing.
  Result<void> Halt() override;
  /// The motor has not taken the command to stop yet.
  bool halt_is_due() const { return cut_.halt_is_due; }
  /// Its newest reading is of another place than where it rests, and is not believed yet: it should be read again soon.
  bool in_doubt() const {
    return cut_.rest.follows || (cut_.rest.departed && cut_.rest.departed->readings < RestDoubt::kShown);
  }
  /// The lens does not answer any more: `why` for the caller of the motion under way, with what became of the motor.
  Error GivenUp(Error why);

 private:
  Result<Instant> Go(Native target, bool begins) override;
  Result<Instant> Home() override;
  Native AtReference(Native position) override;

  /// After a motion that did not end at its target, and what else puts its readings in doubt.
  struct CutShort {
    std::optional<Instant> coasting;  ///< it ended then, and the axis has not been seen to stand
    bool halt_is_due = false;         ///< the motor has not taken the command to stop
    RestDoubt rest;
  };
  std::optional<Error> WhyNotSaid() const;
  void HoldPosition(drivers::AxisState& reading, Instant sampled_at);
  bool ShowsDeparture(Native place, bool moving, Instant sampled_at);
  void AdoptLimits(Native device);
  bool StopsAt(Native device, Instant sampled_at) const;
  bool Distrusts(const drivers::AxisState& reading, Instant sampled_at);
  std::optional<GoneAxis> Fallen(Native device, Instant sampled_at);
  bool StillFallen(Native device, Instant sampled_at);
  void Return(const drivers::AxisState& reading);
  AxisMemory AsLastKnown() const;
  Result<void> RememberMotion(Native lowest, Native highest);
  void RememberRest(RememberedPositions::Try when = RememberedPositions::Try::WhenDue);
  void Coast();
  void LoseSightOf(const AxisMotion& motion);

  drivers::Lens& lens_;
  RememberedPositions& remembered_;
  const Clock& clock_;
  AxisSetup setup_;
  AxisTrack track_;
  std::optional<drivers::AxisState> state_;
  Instant steady_since_{};
  std::unique_ptr<AxisMotion> motion_;
  std::optional<Native> target_;
  CutShort cut_;
  std::optional<GoneAxis> gone_;  ///< while the lens does not answer, or is not believed
  std::optional<Leap> leap_;
  std::optional<Instant> failed_at_;  ///< the last question that was not answered
  int commands_ = 0;
};

using AxisControllers = drivers::PerAxis<std::unique_ptr<AxisController>>;

}  // namespace lensd::rig
