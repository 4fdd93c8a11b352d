// Drives one autofocus session on a rig: turns its advice into moves and frames, counts them, keeps the deadline, and
// brings the lens back where it was whenever the answer is not a checked focus.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "autofocus/frame_gate.h"
#include "autofocus/region_search.h"
#include "autofocus/tracker.h"
#include "rig/autofocus/focus_actuator.h"
#include "rig/rig.h"

namespace lensd::rig {

class AutofocusRun {
 public:
  /// The session's positions: extensions in metres where the optics are known, else native units.
  struct Scale {
    double Position(Native native) const {
      return optics != nullptr ? optics->ExtensionFromNative(native).value : native.value;
    }
    Native NativeAt(double position) const {
      return optics != nullptr ? optics->NativeFromExtension(Metres{position}) : Native{position};
    }
    double resolution = 1.0;  ///< native units
    double stride = 0.0;      ///< positions from frame to frame at full speed; 0: not known
    double slack = 0.0;  ///< native units, signed: from readings to the mechanism against the approach; 0: not known
    const OpticsTable* optics = nullptr;
  };

  /// One search, before it begins.
  struct Plan {
    std::unique_ptr<autofocus::RegionSearch> regions;
    autofocus::Setup setup{};
    Duration limit{};                                    ///< until its answer
    Duration usual{};                                    ///< what a search of the whole range may take
    std::optional<std::pair<Native, Native>> range{};    ///< frames are taken from here to there; nothing: anywhere
    SlopeConditions under{};                             ///< at its beginning
    std::optional<autofocus::KnownSlope> known_slope{};  ///< that `setup` goes by
  };

  /// What a run needs that goes on after its answer.
  struct Tracking {
    autofocus::Tracker tracker{};
    bool holding = false;  ///< between two searches
  };

  /// What a request has the run look for. InvalidArgument; Unsupported: not with this lens.
  static Result<std::unique_ptr<autofocus::RegionSearch>> SearchOf(const AutofocusRequest& request,
                                                                   const autofocus::Setup& setup, const Scale& scale,
                                                                   std::vector<drivers::Region> regions);
  /// `lens` must outlive it. `plan_anew`: as long as it runs.
  AutofocusRun(Plan plan, FocusActuator& lens, Scale scale, std::function<Result<Plan>()> plan_anew);
  /// Asks for the first frame, where the lens stands or, from outside of the range, at its nearer end.
  void Begin(Native stands);
  /// Before Begin(): tracks from the first answer on.
  void Track();
  /// To be called at every step: ends the search at its deadline.
  void CheckDeadline();
  /// What a search may take turns out otherwise: so long from its beginning.
  void Allow(Duration limit);
  Duration elapsed() const { return lens_.Now() - search_.began_at; }
  Activity activity() const;
  /// Of the newest search: as later ones are to take it; nothing: not known.
  std::optional<int> lag_frames() const { return search_.gate.lag(); }
  /// Of the newest search, for the next run; nothing: no picture was used.
  std::optional<autofocus::LastFrame> last_frame() const { return search_.gate.last_frame(); }
  /// It tracks, and waits for the scene to change.
  bool holding() const { return tracking_ && tracking_->holding; }
  const std::vector<drivers::Region>& regions() const { return search_.plan.regions->regions(); }
  /// Taken so far, those that were not used included.
  int frames() const { return search_.taken; }
  int frames_expected() const {
    return search_.plan.regions->frames_expected() + search_.taken - search_.plan.regions->frames();
  }
  std::vector<AutofocusSample> Samples() const;

 private:
  struct Search {
    Plan plan;
    autofocus::FrameGate gate;
    std::vector<AutofocusSample> frames{};  ///< those that the regions were shown, in order, without their scores
    std::vector<LeftOutFrame> left_out{};   ///< all others that were taken, in order
    std::string newest_is_bad{};            ///< why the newest of `frames` may be; empty: it is not
    std::optional<autofocus::Verdict> ends_with{};  ///< once more frames at its place have confirmed it
    int taken = 0;                                  ///< frames
    Instant began_at;
    Instant deadline;
    int motions_before = 0;
    Duration cpu{};
  };
  enum class Sweep { None, UnderWay, Arrived };  ///< with frames taken on the way

  enum class Admission { Used, Again, Ended };  ///< of a frame: to the search; one more is to be taken; neither

  Search SearchFor(Plan plan) const;
  bool EntersRange();
  AutofocusSample SampleOf(const Observation& seen) const;
  void RequestFrame(LensMotion lens = LensMotion::Standing);
  autofocus::Place PlaceOf(const LensedFrame::AxisDuring& focus) const;
  void OnFrame(Result<Observation> seen);
  Result<Admission> Admit(const Observation& seen, const autofocus::Place& place);
  Result<void> BeginAnew();
  void LeaveOut(int frame, Native position, const std::string& reason);
  std::string WithLeftOut(std::string reason) const;
  void OnMoved(Result<MoveOutcome> moved);
  void AllowForLag(Duration move);
  void OnSwept(Result<MoveOutcome> moved);
  void Follow(const autofocus::Advice& advice);
  void EndWith(const autofocus::Verdict& verdict);
  void GoTo(const autofocus::GoAndLook& advice);
  void GoOn(const autofocus::GoAndLook& advice);
  Native WithSlack(Native reading) const { return reading + Native{backlash_open_ ? scale_.slack : 0.0}; }
  void GoBack(Result<AutofocusOutcome> answer);
  void End(Result<AutofocusOutcome> answer);
  Result<bool> Watch(const Observation& seen);
  AutofocusOutcome Outcome(const autofocus::Verdict& verdict) const;
  AutofocusSubject SubjectOf(const autofocus::Verdict& verdict) const;
  std::optional<SlopeRun> ShownSlope(const autofocus::Verdict& verdict) const;
  AutofocusOutcome Missed(const MoveOutcome& moved) const;
  AutofocusOutcome Refusal(autofocus::Cause cause, std::string reason) const;

  FocusActuator& lens_;
  Scale scale_;
  std::function<Result<Plan>()> plan_anew_;
  Search search_;
  std::optional<Native> start_;  ///< where the first frame was taken
  Native stands_;                ///< or was, in the middle of the last frame
  bool backlash_open_ = false;   ///< it came there against the approach direction; `stands_` counts the slack
  Sweep sweep_ = Sweep::None;
  std::optional<Tracking> tracking_;
  std::optional<Result<AutofocusOutcome>> going_back_with_;
};

}  // namespace lensd::rig
