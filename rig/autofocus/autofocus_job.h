// The autofocus of a rig: at most one run, with the lens it moves and the camera it looks through.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "rig/autofocus/autofocus_run.h"
#include "rig/autofocus/external_camera.h"
#include "rig/autofocus/focus_actuator.h"
#include "rig/calibration/optical_state.h"
#include "rig/common/replies.h"
#include "rig/frames/frame_requests.h"
#include "rig/frames/lens_reader.h"
#include "rig/motion/axis_controller.h"

namespace lensd::rig {

/// What the job works with; all of it outlives the job.
struct AutofocusMeans {
  drivers::Camera* camera;  ///< nullptr: none
  const AxisControllers& axes;
  const LensReader& lens;
  const OpticalState& optics;
  FrameRequests& frames;
  Replies& replies;
  const Clock& clock;
  const Instant& held_until;  ///< tracking begins no search before
};

class AutofocusJob final : private FocusActuator {
 public:
  explicit AutofocusJob(const AutofocusMeans& means) : means_(means) {}

  /// The search that a request asks for, its range being native positions. Errors as Rig::Autofocus().
  Result<AutofocusRun::Plan> SearchFor(const AutofocusRequest& request) const;
  /// Begins it. None is running, and focus is free.
  void Begin(AutofocusRequest request, AutofocusRun::Plan search, ProgressCallback progress, AutofocusCallback done);
  /// Ends it from outside. Its motion of the focus axis ends unanswered.
  void Cancel(const Error& why);
  /// A frame for an autofocus whose camera is not the lens' own.
  void Submit(SubmittedFrame frame);

  bool running() const { return run_ && !ended_; }
  /// It may move the lens any time: it does not track a subject that is in focus.
  bool searches() const { return running() && !run_->holding(); }
  Activity activity() const { return run_->activity(); }
  /// Frames of the lens' own camera will be wanted again.
  bool uses_camera() const { return run_ && !external_; }
  /// A submitted frame is to be judged by a reading of the lens.
  bool judges() const { return external_ && external_->submitted(); }
  /// The next steps may have something to say to the other camera.
  bool watches_external() const { return external_ && (external_->unannounced() || external_->submitted()); }
  /// At every step, after a reading.
  void Serve();
  /// Between two replies: clears away a run that has ended.
  void Tidy();

 private:
  void MoveTo(Native target, Approach approach, MoveCallback done) override;
  void SweepTo(Native target, double part_of_speed, MoveCallback done) override;
  void RequestFrame(LensMotion lens, ObservationCallback done) override;
  Instant Now() const override { return means_.clock.Now(); }
  std::optional<int> lag_frames() const override;
  std::optional<autofocus::LastFrame> last_frame() const override {
    return external_ ? last_frame_ : std::nullopt;
  }
  autofocus::FrameGate::Source source() const override {
    return external_ ? autofocus::FrameGate::Source::Outside : autofocus::FrameGate::Source::Inside;
  }
  bool Held() const override { return Now() < means_.held_until; }
  int motions() const override { return focus().commands(); }
  void Report(const AutofocusProgress& progress, std::move_only_function<void()> then) override;
  void Tell(const AutofocusOutcome& answer) override;
  void End(Result<AutofocusOutcome> outcome) override;

  AxisController& focus() const { return *means_.axes[drivers::Axis::Focus]; }
  AutofocusRun::Scale Scale() const;
  autofocus::Setup SetupFor(const AutofocusRequest& request) const;
  SlopeConditions Under(const std::optional<OutsideCamera>& outside) const;
  LearnedLag::Camera LagCamera() const;
  void NoteLag(const AutofocusOutcome& outcome);
  bool HeldThroughout(const AutofocusOutcome& outcome) const;
  Result<double> StepFor(const SearchStep& step, const autofocus::Setup& setup) const;
  Result<std::vector<drivers::Region>> RegionsFor(const AutofocusRequest& request) const;
  Result<void> AllowTime(const AutofocusRequest& request, AutofocusRun::Plan& plan) const;
  Duration Needs(const autofocus::Setup& setup, Duration each_frame) const;
  void FollowFrameRate();
  std::string WhyNotInMotion() const;
  Result<void> Check(const SubmittedFrame& frame) const;
  void ServeExternal();
  void EndExternal();
  void GiveUpMotion();
  template <class T>
  auto OfThisRun(std::move_only_function<void(Result<T>)> callback);

  const AutofocusMeans means_;
  std::unique_ptr<AutofocusRun> run_;
  bool ended_ = false;                      ///< the run is; it is cleared away once nothing of it is on the stack
  std::optional<ExternalCamera> external_;  ///< of the run, where its frames come from outside
  std::optional<autofocus::Setup> timed_;   ///< of the run, where its time follows the frames from outside
  AutofocusCallback done_;
  std::shared_ptr<ProgressCallback> progress_;
  std::shared_ptr<LearnedLag> lags_ = std::make_shared<LearnedLag>();
  std::optional<autofocus::LastFrame> last_frame_;  ///< of the newest run with frames from outside
  std::function<void(const AutofocusOutcome&)> tell_;
  std::uint64_t number_ = 0;  ///< of the run: answers of an earlier one never reach a later one
};

}  // namespace lensd::rig
