// The inside of a Rig; see rig/rig.h.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "autofocus_run.h"
#include "axis_motion.h"
#include "axis_setup.h"
#include "axis_track.h"
#include "history.h"
#include "looks.h"
#include "outside.h"
#include "rig/rig.h"

namespace lensd::rig {

/// The optics of a device under this configuration; nothing where they are not known. Errors as Rig::Create().
Result<std::optional<OpticsTable>> TableFor(const RigConfig& config, const drivers::Device& device,
                                            std::shared_ptr<const Calibration> calibration);

class Rig::Impl {
 public:
  Impl(RigConfig config, drivers::Device device, std::optional<OpticsTable> optics, const Clock& clock,
       std::shared_ptr<const Calibration> calibration, std::unique_ptr<PositionMemory> memory);
  ~Impl();

  Result<Native> Resolve(drivers::Axis axis, const Target& target) const;
  void Command(std::move_only_function<void()> command) { commands_.push_back(std::move(command)); }
  Instant Step(Instant now);
  std::pair<Native, Native> SoftLimits(drivers::Axis axis) const;
  bool ApproachesUp(drivers::Axis axis) const { return setups_[axis] && setups_[axis]->approach_up; }
  Backlash BacklashOf(drivers::Axis axis) const;
  const std::shared_ptr<const Calibration>& calibration() const { return calibration_; }
  Status GetStatus() const;

  // The commands, as carried out inside Step().
  void Move(drivers::Axis axis, const Target& target, MoveCallback done);
  void Home(drivers::Axis axis, MoveCallback done);
  void Stop(const std::vector<drivers::Axis>& axes, StopCallback done);
  void ResetFaults(const std::vector<drivers::Axis>& axes, StopCallback done);
  void Autofocus(AutofocusRequest request, ProgressCallback progress, AutofocusCallback done);
  void Give(Given given);
  void Snapshot(Instant since, SnapshotCallback done);
  void SetCalibration(std::shared_ptr<const Calibration> calibration, StopCallback done);

  std::uint64_t commands_given = 0;
  drivers::Device device;
  std::optional<OpticsTable> optics;
  const Clock& clock;

 private:
  template <class Callback, class Answer>
  void Reply(Callback done, Answer answer) {
    replies_.push_back([done = std::move(done), answer = std::move(answer)]() mutable {
      if (done) done(std::move(answer));
    });
  }
  class AxisMotor;
  void StartMotion(drivers::Axis axis, std::optional<Native> target, double overshoot, TakeUp take_up,
                   MoveCallback done, std::optional<std::vector<Impulse>> pace = {});
  void EndMotion(drivers::Axis axis, Result<MoveOutcome> end);
  void Coasts(drivers::Axis axis);
  void DropMotion(drivers::Axis axis);
  void EndAutofocus(Result<AutofocusOutcome> end);
  void Disturb(drivers::Axis axis);
  void FailAll(const Error& error);
  void ReadLens();
  void NoteReading(drivers::LensState state);
  void NoteAxis(drivers::Axis axis, const drivers::AxisState& state, Instant sampled_at);
  void Recall(const drivers::LensState& state);
  Result<void> RememberMotion(drivers::Axis axis, Native lowest, Native highest);
  void RememberRest(drivers::Axis axis);
  void AdvanceMotions();
  void ServeLooks();
  void ServeOutside();
  void EndOutside();
  void HandOut(const drivers::Frame& frame, bool settled);
  LensedFrame WithLens(const drivers::Frame& frame) const;
  // What positions mean: impl_optics.cpp.
  void AdoptBacklash();
  void NoteConditions(const drivers::LensState& state);
  void FollowTemperature();
  void AddOptics(MoveOutcome& outcome) const;
  void AddOptics(Status& status) const;
  Metres ExtensionBound(Native position, Native bound) const;
  FNumber FNumberBound(Native position, Native bound) const;
  std::optional<Error> PositionUnknown(drivers::Axis axis) const;
  bool Known(drivers::Axis axis) const { return tracks_[axis] && tracks_[axis]->known(); }
  void RunReplies();
  Result<Native> Aim(drivers::Axis axis, const Target& target) const;
  Result<Metres> ExtensionOf(const Target& target) const;
  std::optional<FNumber> CurrentFNumber() const;
  autofocus::Setup AutofocusSetup(const AutofocusRequest& request);
  Activity CurrentActivity() const;
  void Pass(Native target, double part_of_speed, MoveCallback done);
  std::string WhyNotInMotion() const;
  AutofocusRun::Hands HandsOfRun();
  AutofocusRun::Scale ScaleOfRun();
  bool Moving() const;
  std::optional<Instant> SteadySince() const;
  Instant NextStep(Instant now) const;

  RigConfig config_;
  const RigConfig as_configured_;  ///< before the calibration filled in what it leaves open
  std::shared_ptr<const Calibration> calibration_;
  std::optional<Metres> held_;  ///< the extension focus was last brought to, to be held as the temperature changes
  bool following_ = false;      ///< the motion of focus under way follows the temperature
  std::shared_ptr<const OpticsTable> shared_optics_;  ///< the same as `optics`, for those on other threads
  std::unique_ptr<PositionMemory> memory_;
  drivers::PerAxis<std::optional<AxisSetup>> setups_;
  drivers::PerAxis<std::unique_ptr<AxisTrack>> tracks_;
  drivers::PerAxis<double> tolerances_;
  Duration latency_{};
  drivers::PerAxis<std::unique_ptr<AxisMotion>> motions_;
  drivers::PerAxis<std::optional<Native>> targets_;
  drivers::PerAxis<std::optional<Instant>> coasting_;  ///< its motion ended then, and it has not been seen to stand
  PositionMemory::Axes remembered_;                    ///< as saved
  bool recalled_ = false;
  drivers::PerAxis<Instant> steady_since_;
  std::optional<drivers::LensState> state_;
  std::optional<Error> problem_;
  int read_failures_ = 0;
  Instant next_read_{};
  History history_;
  Looks looks_;
  Native handed_out_bound_{};  ///< of focus, with the frame before
  std::unique_ptr<AutofocusRun> run_;
  std::optional<Outside> outside_;  ///< of the run, where its frames come from outside
  AutofocusCallback autofocus_done_;
  std::uint64_t run_number_ = 0;
  int run_motions_ = 0;
  bool run_ended_ = false;
  std::deque<std::move_only_function<void()>> commands_;
  std::deque<std::move_only_function<void()>> replies_;
};

}  // namespace lensd::rig
