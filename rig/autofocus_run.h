// Drives one autofocus session on a rig: turns its advice into moves and looks, counts them, keeps the deadline, and
// brings the lens back where it was whenever the answer is not a checked focus.
#pragma once

#include <functional>
#include <optional>

#include "autofocus/regions.h"
#include "autofocus/tracker.h"
#include "outside.h"
#include "rig/rig.h"

namespace lensd::rig {

class AutofocusRun {
 public:
  /// How a move ends.
  enum class Arrival {
    TakenUp,  ///< from the approach side; after a move that ended so as well
    Anyhow,   ///< the shortest way: only the readings' distance to the mechanism is known
    Anew      ///< from the approach side, after a move that ended anyhow
  };
  /// What the run may ask of its rig. Each callback comes from a later Step().
  struct Hands {
    std::function<void(Native, Arrival, MoveCallback)> move;
    /// To there at a part of the full speed, without taking up backlash.
    std::function<void(Native, double part_of_speed, MoveCallback)> pass;
    /// A frame of the lens standing still, or of any lens.
    std::function<void(bool in_motion_too, SeenCallback)> look;
    std::function<Instant()> now;
    std::function<int()> motions;                       ///< device motions of the focus axis since the run began
    std::function<void(Result<AutofocusOutcome>)> end;  ///< called once, last
  };
  /// How the focus axis' native units become the session's positions, and back.
  struct Scale {
    std::function<double(Native)> position;
    std::function<Native(double)> native;
    double resolution = 1.0;  ///< native units
    double stride = 0.0;      ///< positions from frame to frame at full speed; 0: not known
    double slack = 0.0;  ///< native units, signed: from readings to the mechanism against the approach; 0: not known
    const OpticsTable* optics = nullptr;  ///< positions are extensions in metres; nullptr: native units
  };

  /// What a run needs that goes on after its answer.
  struct Tracking {
    std::function<void(const AutofocusOutcome&)> tell;
    std::function<Result<autofocus::Regions>()> search_anew;
    Duration limit{};  ///< of each search
  };

  AutofocusRun(autofocus::Regions search, Instant deadline, Hands hands, Scale scale, ProgressCallback progress);
  /// Asks for the first frame.
  void Begin();
  /// Before Begin(): tracks from the first answer on.
  void Track(Tracking tracking) { tracking_ = std::move(tracking); }
  /// To be called at every step: ends the search at its deadline.
  void CheckDeadline();
  Activity activity() const;
  const std::vector<drivers::Region>& regions() const { return search_.regions(); }
  int frames() const { return search_.frames(); }
  int frames_expected() const { return search_.frames_expected(); }

 private:
  void Look(bool in_motion_too = false);
  autofocus::Place PlaceOf(const LensedFrame::AxisDuring& focus) const;
  void OnFrame(Result<Seen> seen);
  Result<autofocus::Advice> Show(const Seen& seen);
  void OnMoved(Result<MoveOutcome> moved);
  void Pass(const autofocus::GoAndLook& advice);
  void Follow(const autofocus::Advice& advice);
  void GoTo(const autofocus::GoAndLook& advice);
  Native WithSlack(Native reading) const { return reading + Native{loose_ ? scale_.slack : 0.0}; }
  void GoBack(Result<AutofocusOutcome> answer);
  void End(Result<AutofocusOutcome> answer);
  Result<bool> Watch(const Seen& seen);
  void Report();
  AutofocusOutcome Outcome(const autofocus::Verdict& verdict) const;
  AutofocusOutcome Refusal(std::string reason) const;

  autofocus::Regions search_;
  Instant began_at_;
  Instant deadline_;
  Hands hands_;
  Scale scale_;
  ProgressCallback progress_;
  std::optional<Native> start_;  ///< where the first frame was taken
  Native stands_;                ///< or was, in the middle of the last frame
  autofocus::Place place_{0.0};
  bool loose_ = false;  ///< it came there against the approach direction; `stands_` counts the slack
  std::optional<Result<AutofocusOutcome>> going_back_with_;
  Duration cpu_{};
  std::optional<Tracking> tracking_;
  autofocus::Tracker tracker_;
  bool passing_ = false;  ///< frames on the way are wanted
  bool arrived_ = false;  ///< and the way has ended
  bool holding_ = false;  ///< tracking, between two searches
  int motions_before_ = 0;
};

}  // namespace lensd::rig
