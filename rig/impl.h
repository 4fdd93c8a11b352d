// The inside of a Rig; see rig/rig.h.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "rig/autofocus/autofocus_job.h"
#include "rig/calibration/optical_state.h"
#include "rig/common/replies.h"
#include "rig/frames/frame_requests.h"
#include "rig/frames/lens_reader.h"
#include "rig/motion/axis_controller.h"
#include "rig/motion/remembered_positions.h"
#include "rig/rig.h"

namespace lensd::rig {

/// What callers have commanded.
struct CallersCommands {
  CommandCount all;                     ///< that displace others; any stop ends a search
  drivers::PerAxis<CommandCount> of{};  ///< those for an axis: moves, homings, and stops that name it
  std::uint64_t searches = 0;           ///< autofocus, which moves the focus by itself
  std::uint64_t refused = 0;  ///< of those for the focus: answered with an error at once, before anything moved
  bool since_step = false;
};

class Rig::Impl {
 public:
  Impl(const RigConfig& config, drivers::Device device, std::optional<OpticsTable> table, const Clock& clock,
       std::shared_ptr<const Calibration> calibration, std::unique_ptr<PositionMemory> memory);
  ~Impl();

  Instant Step(Instant now);
  Result<Native> Resolve(drivers::Axis axis, const Target& target) const;
  Status GetStatus() const;

  void Move(drivers::Axis axis, const Target& target, MoveCallback done);
  void Home(drivers::Axis axis, MoveCallback done);
  void SetPosition(drivers::Axis axis, Native position, StopCallback done);
  void Stop(const std::vector<drivers::Axis>& axes, StopCallback done);
  void ResetFaults(const std::vector<drivers::Axis>& axes, StopCallback done);
  void Autofocus(AutofocusRequest request, ProgressCallback progress, AutofocusCallback done);
  void SetCalibration(std::shared_ptr<const Calibration> calibration, StopCallback done);
  void SetSeenDirection(std::optional<drivers::Direction> seen, StopCallback done);

  std::optional<Error> WhyNotFocused() const;
  std::optional<Error> WhyNotAtRest() const;

  std::weak_ptr<const Activity> procedure;  ///< of many commands; gone when it is over
  CallersCommands commands;
  Instant held_until{};  ///< nothing by itself before
  drivers::Device device;
  const Clock& clock;
  RememberedPositions remembered;
  AxisControllers axes;
  LensReader reader;
  OpticalState optics;
  Replies replies;
  FrameRequests frames;
  AutofocusJob autofocus;

 private:
  static AxisControllers Controllers(const RigConfig& config, drivers::Lens& lens, RememberedPositions& remembered,
                                     const Clock& clock);
  Result<Native> InReach(drivers::Axis axis, const Target& target) const;
  std::optional<Error> WhyMeaningless(drivers::Axis axis, const Target& target) const;
  Result<void> Say(drivers::Axis axis, Native position);
  Result<void> PinRange(AutofocusRequest& request) const;
  Result<void> CheckPolicy(const AutofocusRequest& request) const;
  bool WantsReading(Instant now) const;
  void ReadLens();
  void AdvanceMotions();
  void SayWhetherKept(drivers::Axis axis, MoveOutcome& outcome) const;
  void EndMotion(drivers::Axis axis, Result<MoveOutcome> end);
  void Disturb(drivers::Axis axis);
  enum class Lens { Closed, Lost };
  /// Of a lens that is lost, what turns is told to stop, at once or as soon as it answers.
  void FailAll(const Error& error, Lens lens);
  void FollowTemperature();
  void RunReplies();
  Instant NextStep(Instant now) const;
  Activity CurrentActivity() const;
  std::optional<drivers::Axis> InMotion() const;
};

}  // namespace lensd::rig
