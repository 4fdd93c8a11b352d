// The public face of a rig. What displaces another is counted, for those who give many commands in a row.
#include "rig/rig.h"

#include <algorithm>
#include <utility>

#include "rig/impl.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

}  // namespace

// ---- the public face ----------------------------------------------------------------------------------------------

std::optional<Error> WhyLost(Axis axis, const std::optional<AxisStatus>& status) {
  if (!status || !status->lost) return std::nullopt;
  const std::string name(AxisName(axis));
  return Fail(Code::NotHomed,
              "where " + name + " stands is not known: it counts its steps, may have lost count of them, and has no " +
                  "reference to search. Say where it stands (lensctl here " + name + " @N, SetPosition); until then " +
                  "only moves in its own steps are possible",
              {.axis = name})
      .error();
}

Result<std::unique_ptr<Rig>> Rig::Create(RigConfig config, drivers::Device device, const Clock& clock,
                                         std::shared_ptr<const Calibration> calibration,
                                         std::unique_ptr<PositionMemory> memory) {
  if (!device.lens) return Fail(Code::InvalidArgument, "a rig needs a lens");
  for (const Axis axis : drivers::kAxes) {
    const auto& can = device.lens->capabilities().axes[axis];
    const auto& limits = config.axes[axis].limits;
    if (can && limits && (limits->first > can->maximum || limits->second < can->minimum)) {
      return Fail(Code::InvalidArgument,
                  "the limits of " + std::string(AxisName(axis)) + " leave nothing of its range");
    }
  }
  auto table = OpticalState::TableFor(config, device, calibration);
  if (!table) return PassOn(table);
  return std::unique_ptr<Rig>(new Rig(std::make_unique<Impl>(config, std::move(device), *std::move(table), clock,
                                                             std::move(calibration), std::move(memory))));
}

Rig::Rig(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Rig::~Rig() = default;

const drivers::Capabilities& Rig::lens() const {
  return impl_->device.lens->capabilities();
}

const drivers::CameraCapabilities* Rig::camera() const {
  return impl_->device.camera ? &impl_->device.camera->capabilities() : nullptr;
}

const drivers::Findings& Rig::findings() const {
  return impl_->device.findings;
}

const OpticsTable* Rig::optics() const {
  return impl_->optics.table();
}

Result<Native> Rig::Resolve(Axis axis, const Target& target) const {
  return impl_->Resolve(axis, target);
}

void Rig::Move(Axis axis, const Target& target, MoveCallback done) {
  Displacing({axis}).Move(axis, target, std::move(done));
}

void Rig::Home(Axis axis, MoveCallback done) {
  Displacing({axis}).Home(axis, std::move(done));
}

void Rig::SetPosition(Axis axis, Native position, StopCallback done) {
  Displacing({axis}).SetPosition(axis, position, std::move(done));
}

void Rig::Stop(const std::vector<Axis>& axes, StopCallback done) {
  impl_->procedure.reset();  // at once, and not when it comes to its next command
  const auto named = axes.empty() ? std::vector(drivers::kAxes.begin(), drivers::kAxes.end()) : axes;
  ++impl_->commands.all.stops;
  for (const Axis axis : named) ++impl_->commands.of[axis].stops;
  Displacing(named).Stop(axes, std::move(done));
}

void Rig::Autofocus(AutofocusRequest request, ProgressCallback progress, AutofocusCallback done) {
  ++impl_->commands.searches;
  Displacing({}).Autofocus(std::move(request), std::move(progress), std::move(done));
}

void Rig::ResetFaults(const std::vector<Axis>& axes, StopCallback done) {
  Commanded().ResetFaults(axes, std::move(done));
}

void Rig::GiveFrame(drivers::Frame frame, StopCallback taken) {
  Commanded().autofocus.Submit({std::move(frame), std::nullopt, std::move(taken)});
}

void Rig::GiveScore(OutsideScore score, StopCallback taken) {
  drivers::Frame times;
  times.exposure_start = score.exposure_start;
  times.exposure_end = score.exposure_end;
  Commanded().autofocus.Submit(
      {std::move(times), autofocus::Sharpness{score.sharpness, score.sigma}, std::move(taken)});
}

void Rig::Snapshot(SnapshotCallback done, LensMotion lens) {
  Commanded().frames.Add({.since = clock().Now(), .for_autofocus = false, .lens = lens, .done = std::move(done)});
}

Result<void> Rig::View(FrameViewer viewer) {
  return Commanded().frames.View(std::move(viewer));
}

void Rig::SetCalibration(std::shared_ptr<const Calibration> calibration, StopCallback done) {
  Commanded().SetCalibration(std::move(calibration), std::move(done));
}

void Rig::SetSeenDirection(std::optional<drivers::Direction> seen, StopCallback done) {
  Commanded().SetSeenDirection(seen, std::move(done));
}

Rig::Impl& Rig::Commanded() {
  impl_->commands.since_step = true;
  return *impl_;
}

Rig::Impl& Rig::Displacing(const std::vector<Axis>& axes) {
  ++impl_->commands.all.given;
  for (const Axis axis : axes) ++impl_->commands.of[axis].given;
  return Commanded();
}

const Clock& Rig::clock() const {
  return impl_->clock;
}

std::shared_ptr<const Calibration> Rig::calibration() const {
  return impl_->optics.calibration();
}

bool Rig::approaches_up(Axis axis) const {
  return impl_->axes[axis] && impl_->axes[axis]->setup().approach_up;
}

Backlash Rig::backlash(Axis axis) const {
  return impl_->optics.BacklashOf(axis);
}

std::optional<Error> Rig::WhyNotFocused() const {
  return impl_->WhyNotFocused();
}

std::optional<Error> Rig::WhyNotAtRest() const {
  return impl_->WhyNotAtRest();
}

std::shared_ptr<Activity> Rig::Occupy(Activity activity) {
  auto occupied = std::make_shared<Activity>(activity);
  impl_->procedure = occupied;
  return occupied;
}

CommandCount Rig::commands_given(const std::vector<Axis>& axes) const {
  if (axes.empty()) return impl_->commands.all;
  CommandCount count;
  for (const Axis axis : axes) {
    count.given += impl_->commands.of[axis].given + (axis == Axis::Focus ? impl_->commands.searches : 0);
    count.stops += impl_->commands.of[axis].stops;
  }
  return count;
}

bool Rig::Hold(Instant until) {
  Commanded().held_until = until;
  const bool searches = impl_->autofocus.searches() || !impl_->procedure.expired();
  return !searches && std::ranges::none_of(drivers::kAxes,
                                           [&](Axis axis) { return impl_->axes[axis] && impl_->axes[axis]->moving(); });
}

Result<drivers::ExposureState> Rig::SetExposure(const drivers::ExposureState& wanted) {
  drivers::Camera* const camera = impl_->device.camera.get();
  if (camera == nullptr) return Fail(Code::Unsupported, "this lens has no camera");
  const auto occupied = impl_->procedure.lock();
  const bool searches = occupied && occupied->kind == Activity::Kind::Autofocus;
  if ((wanted.exposure || wanted.gain) && (searches || impl_->autofocus.uses_camera())) {
    return Fail(Code::Busy, "autofocus compares pictures of this camera: wait for its end, or stop it",
                *impl_->WhyNotFocused()->facts);
  }
  // Both or neither: a gain that is refused leaves the exposure alone too.
  if (auto possible = camera->Check(wanted); !possible) return PassOn(possible);
  if (wanted.exposure) {
    if (auto set = camera->SetExposure(*wanted.exposure); !set) return PassOn(set);
  }
  if (wanted.gain) {
    if (auto set = camera->SetGain(*wanted.gain); !set) return PassOn(set);
  }
  return camera->ReadExposure();
}

Instant Rig::Step(Instant now) {
  return impl_->Step(now);
}

std::pair<Native, Native> Rig::SoftLimits(Axis axis) const {
  const AxisSetup& setup = impl_->axes[axis]->setup();
  return {setup.minimum, setup.maximum};
}

Status Rig::GetStatus() const {
  Status status = impl_->GetStatus();
  status.may_regain = impl_->device.findings.may_pass();
  return status;
}

void Rig::CutReadingShort() {
  impl_->device.lens->CutReadShort();
}

void Rig::Interrupt() {
  impl_->device.lens->Interrupt();
  if (impl_->device.camera) impl_->device.camera->Interrupt();
}

}  // namespace lensd::rig
