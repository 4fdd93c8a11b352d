#include "rig/rig.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "impl.h"
#include "optics/conjugates.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

std::string LimitsText(const AxisSetup& setup) {
  std::ostringstream text;
  text << setup.minimum.value << ".." << setup.maximum.value << " " << NativeUnitName(setup.can.unit);
  return text.str();
}

/// On the axis' grid and inside its soft limits; what is off by rounding alone is brought back.
Result<Native> Land(const AxisSetup& setup, Native wanted, const std::string& as_asked) {
  const double resolution = setup.can.resolution;
  const double steps = std::round((wanted - setup.can.minimum).value / resolution);
  const Native on_grid = setup.can.minimum + Native{steps * resolution};
  if (!std::isfinite(wanted.value) || on_grid.value < setup.minimum.value - 0.5 * resolution ||
      on_grid.value > setup.maximum.value + 0.5 * resolution) {
    return Fail(Code::OutOfRange, as_asked + " is outside what " + std::string(AxisName(setup.axis)) + " may reach (" +
                                      LimitsText(setup) + ")");
  }
  return std::clamp(on_grid, setup.minimum, setup.maximum);
}

std::string Asked(const Target& target) {
  static constexpr const char* kUnits[] = {"", " relative",         " toward near", " D", " m", " m of extension",
                                           "", " m of focal length"};
  std::ostringstream text;
  text << (target.kind == Target::Kind::FNumber ? "f/" : "") << target.value
       << kUnits[static_cast<std::size_t>(target.kind)];
  return text.str();
}

}  // namespace

// ---- targets ------------------------------------------------------------------------------------------------------

Result<Native> Rig::Impl::Resolve(Axis axis, const Target& target) const {
  if (!setups_[axis]) return Fail(Code::Unsupported, "this lens has no motorised " + std::string(AxisName(axis)));
  if (std::isnan(target.value)) return Fail(Code::InvalidArgument, "a target must be a number");
  auto aimed = Aim(axis, target);
  if (!aimed) return aimed;
  return Land(*setups_[axis], *aimed, Asked(target));
}

Result<Native> Rig::Impl::Aim(Axis axis, const Target& target) const {
  using Kind = Target::Kind;
  const AxisSetup& setup = *setups_[axis];
  switch (target.kind) {
    case Kind::Native:
      return Native{target.value};
    case Kind::NativeRelative:
    case Kind::TowardNear: {
      if (target.kind == Kind::TowardNear && axis != Axis::Focus) {
        return Fail(Code::InvalidArgument, "only focus has a near and a far side");
      }
      if (!targets_[axis] && (!state_ || !state_->axes[axis])) {
        return Fail(Code::Disconnected, "the lens has not told where it stands");
      }
      const Native from = targets_[axis] ? *targets_[axis] : state_->axes[axis]->position;
      const bool backward = target.kind == Kind::TowardNear && !setup.config.near_positive;
      return from + Native{backward ? -target.value : target.value};
    }
    case Kind::Vergence:
    case Kind::Distance:
    case Kind::Extension: {
      if (axis != Axis::Focus) return Fail(Code::InvalidArgument, "only focus can be set to a distance");
      if (!optics || !optics->has_focus()) {
        return Fail(Code::Unsupported,
                    "this lens is not calibrated: only native positions are possible, such as @1200");
      }
      const auto extension = ExtensionOf(target);
      if (!extension) return std::unexpected(extension.error());
      return optics->NativeFromExtension(*extension);
    }
    case Kind::FNumber:
      if (axis != Axis::Iris) return Fail(Code::InvalidArgument, "only the iris has an f-number");
      if (!(target.value > 0)) return Fail(Code::InvalidArgument, "an f-number must be above 0");
      if (!optics || !optics->has_iris()) return Fail(Code::Unsupported, "this lens' f-numbers are not known");
      return optics->NativeFromFNumber(FNumber{target.value});
    case Kind::FocalLength:
      if (axis != Axis::Zoom) return Fail(Code::InvalidArgument, "only the zoom can be set to a focal length");
      if (!(target.value > 0)) return Fail(Code::InvalidArgument, "a focal length must be above 0");
      if (!optics || !optics->has_zoom()) return Fail(Code::Unsupported, "this lens' focal lengths are not known");
      return optics->NativeFromFocalLength(Metres{target.value});
  }
  return Fail(Code::Internal, "unknown kind of target");
}

Result<Metres> Rig::Impl::ExtensionOf(const Target& target) const {
  if (target.kind == Target::Kind::Extension) return Metres{target.value};
  if (target.kind == Target::Kind::Vergence) return optics->ExtensionInFocus(Dioptres{target.value});
  optics::FocusScale scale = config_.scale;
  if (target.from) scale.from = *target.from;
  // A liquid lens' sensor stands where it stands, whatever is in focus.
  const auto depth = optics->nominal().liquid
                         ? optics::DepthAt(scale, optics->focal_length(), Metres{0.0}, Metres{target.value})
                         : optics::DepthInFocus(scale, optics->focal_length(), Metres{target.value});
  if (!depth) return std::unexpected(depth.error());
  return optics->ExtensionInFocus(*depth);
}

// ---- status -------------------------------------------------------------------------------------------------------

Status Rig::Impl::GetStatus() const {
  Status status;
  status.connected = state_ && !problem_;
  if (problem_) status.problem = problem_->message;
  status.has_camera = device.camera != nullptr;
  status.streaming = looks_.streaming();
  status.activity = CurrentActivity();
  if (!state_) return status;
  status.sampled_at = state_->sampled_at;
  status.temperature = state_->temperature;
  for (const Axis axis : drivers::kAxes) {
    if (!setups_[axis] || !state_->axes[axis]) continue;
    const AxisSetup& setup = *setups_[axis];
    const drivers::AxisState& state = *state_->axes[axis];
    status.axes[axis] = AxisStatus{.unit = setup.can.unit,
                                   .position = state.position,
                                   .target = targets_[axis].value_or(state.position),
                                   .minimum = setup.minimum,
                                   .maximum = setup.maximum,
                                   .moving = state.moving || motions_[axis] != nullptr,
                                   .homed = state.homed && Known(axis),
                                   .bound = Native{tracks_[axis]->Bound()},
                                   .moved_by_us = tracks_[axis]->moved_by_us(),
                                   .moved_by_another = tracks_[axis]->moved_by_another(),
                                   .fault = state.fault};
  }
  AddOptics(status);
  return status;
}

std::pair<Native, Native> Rig::Impl::SoftLimits(Axis axis) const {
  return {setups_[axis]->minimum, setups_[axis]->maximum};
}

Activity Rig::Impl::CurrentActivity() const {
  if (run_) return run_->activity();
  for (const Axis axis : drivers::kAxes) {
    if (motions_[axis]) return {motions_[axis]->homing() ? Activity::Kind::Homing : Activity::Kind::Moving, 0, 0};
  }
  if (looks_.anyone()) return {Activity::Kind::Snapshot, 0, 0};
  return {};
}

// ---- the public face ----------------------------------------------------------------------------------------------

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
  auto table = TableFor(config, device, calibration);
  if (!table) return PassOn(std::move(table));
  return std::unique_ptr<Rig>(new Rig(std::make_unique<Impl>(std::move(config), std::move(device), *std::move(table),
                                                             clock, std::move(calibration), std::move(memory))));
}

Rig::Rig(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Rig::~Rig() = default;

const drivers::Capabilities& Rig::lens() const {
  return impl_->device.lens->capabilities();
}

const drivers::CameraCapabilities* Rig::camera() const {
  return impl_->device.camera ? &impl_->device.camera->capabilities() : nullptr;
}

const OpticsTable* Rig::optics() const {
  return impl_->optics ? &*impl_->optics : nullptr;
}

Result<Native> Rig::Resolve(Axis axis, const Target& target) const {
  return impl_->Resolve(axis, target);
}

void Rig::Move(Axis axis, const Target& target, MoveCallback done) {
  ++impl_->commands_given;
  impl_->Command([impl = impl_.get(), axis, target, done = std::move(done)]() mutable {
    impl->Move(axis, target, std::move(done));
  });
}

void Rig::Home(Axis axis, MoveCallback done) {
  ++impl_->commands_given;
  impl_->Command([impl = impl_.get(), axis, done = std::move(done)]() mutable { impl->Home(axis, std::move(done)); });
}

void Rig::Stop(std::vector<Axis> axes, StopCallback done) {
  ++impl_->commands_given;
  impl_->Command([impl = impl_.get(), axes = std::move(axes), done = std::move(done)]() mutable {
    impl->Stop(axes, std::move(done));
  });
}

void Rig::ResetFaults(std::vector<Axis> axes, StopCallback done) {
  impl_->Command([impl = impl_.get(), axes = std::move(axes), done = std::move(done)]() mutable {
    impl->ResetFaults(axes, std::move(done));
  });
}

void Rig::Autofocus(AutofocusRequest request, ProgressCallback progress, AutofocusCallback done) {
  ++impl_->commands_given;
  impl_->Command([impl = impl_.get(), request = std::move(request), progress = std::move(progress),
                  done = std::move(done)]() mutable {
    impl->Autofocus(std::move(request), std::move(progress), std::move(done));
  });
}

void Rig::GiveFrame(drivers::Frame frame, StopCallback taken) {
  impl_->Command([impl = impl_.get(), frame = std::move(frame), taken = std::move(taken)]() mutable {
    impl->Give({std::move(frame), std::nullopt, std::move(taken)});
  });
}

void Rig::GiveScore(OutsideScore score, StopCallback taken) {
  impl_->Command([impl = impl_.get(), score, taken = std::move(taken)]() mutable {
    drivers::Frame times;
    times.exposure_start = score.exposure_start;
    times.exposure_end = score.exposure_end;
    impl->Give({std::move(times), autofocus::Sharpness{score.sharpness, score.sigma}, std::move(taken)});
  });
}

void Rig::Snapshot(SnapshotCallback done) {
  impl_->Command([impl = impl_.get(), since = impl_->clock.Now(), done = std::move(done)]() mutable {
    impl->Snapshot(since, std::move(done));
  });
}

void Rig::SetCalibration(std::shared_ptr<const Calibration> calibration, StopCallback done) {
  impl_->Command([impl = impl_.get(), calibration = std::move(calibration), done = std::move(done)]() mutable {
    impl->SetCalibration(std::move(calibration), std::move(done));
  });
}

std::shared_ptr<const Calibration> Rig::calibration() const {
  return impl_->calibration();
}

bool Rig::approaches_up(Axis axis) const {
  return impl_->ApproachesUp(axis);
}

Backlash Rig::backlash(Axis axis) const {
  return impl_->BacklashOf(axis);
}

std::uint64_t Rig::commands_given() const {
  return impl_->commands_given;
}

Result<void> Rig::SetExposure(Duration exposure) {
  if (!impl_->device.camera) return Fail(Code::Unsupported, "this lens has no camera");
  return impl_->device.camera->SetExposure(exposure);
}

Instant Rig::Step(Instant now) {
  return impl_->Step(now);
}

std::pair<Native, Native> Rig::SoftLimits(Axis axis) const {
  return impl_->SoftLimits(axis);
}

Status Rig::GetStatus() const {
  return impl_->GetStatus();
}

void Rig::Interrupt() {
  impl_->device.lens->Interrupt();
  if (impl_->device.camera) impl_->device.camera->Interrupt();
}

}  // namespace lensd::rig
