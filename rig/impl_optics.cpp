// The part of a rig that says what positions mean, and with which bound.
#include <algorithm>
#include <cmath>
#include <utility>

#include "impl.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

/// A thermometer's noise is no change of temperature.
constexpr double kTemperatureGrid_c = 0.1;

Result<void> CheckSerial(const Calibration& calibration, const drivers::Capabilities& lens) {
  if (lens.serial.empty() || lens.serial == calibration.serial) return {};
  const std::string whose = calibration.serial.empty() ? "names no serial number" : "is of " + calibration.serial;
  return Fail(Code::InvalidArgument, "the calibration " + whose + ", and this lens is " + lens.serial);
}

/// The largest distance of a function's values at either end of an interval from that at its middle.
template <class Quantity>
Quantity Reach(Quantity middle, Quantity one_end, Quantity other_end) {
  return Quantity{std::max(std::abs((one_end - middle).value), std::abs((other_end - middle).value))};
}

}  // namespace

Result<std::optional<OpticsTable>> TableFor(const RigConfig& config, const drivers::Device& device,
                                            std::shared_ptr<const Calibration> calibration) {
  if (calibration) {
    if (auto same = CheckSerial(*calibration, device.lens->capabilities()); !same) return PassOn(std::move(same));
  }
  const auto& known = config.optics ? config.optics : device.optics;
  if (!known && calibration && !calibration->focus.empty()) {
    return Fail(Code::InvalidArgument, "a calibration of focus needs a [lens.optics] section beside it");
  }
  if (!known) return std::nullopt;
  auto made = OpticsTable::Create(*known, device.lens->capabilities(), config, std::move(calibration));
  if (!made) return PassOn(std::move(made));
  return *std::move(made);
}

/// What the configuration leaves to be found out. The take-up is the most it can be.
void Rig::Impl::AdoptBacklash() {
  for (const Axis axis : drivers::kAxes) {
    if (!setups_[axis] || as_configured_.axes[axis].backlash) continue;
    std::optional<double> backlash;
    if (calibration_ && calibration_->backlash[axis]) backlash = std::ceil(calibration_->backlash[axis]->high);
    config_.axes[axis].backlash = backlash;
    SetBacklash(*setups_[axis], backlash);
    tracks_[axis]->BacklashChanged();
  }
}

void Rig::Impl::SetCalibration(std::shared_ptr<const Calibration> calibration, StopCallback done) {
  auto table = TableFor(as_configured_, device, calibration);
  if (!table) return Reply(std::move(done), Result<void>(std::unexpected(table.error())));
  EndAutofocus(Fail(Code::Superseded, "the lens got another calibration"));
  optics = *std::move(table);
  shared_optics_ = nullptr;
  held_.reset();
  calibration_ = std::move(calibration);
  AdoptBacklash();
  if (state_) NoteConditions(*state_);
  Reply(std::move(done), Result<void>());
}

void Rig::Impl::NoteConditions(const drivers::LensState& state) {
  if (!optics) return;
  Conditions now;
  if (state.axes[Axis::Zoom]) now.zoom = state.axes[Axis::Zoom]->position;
  if (state.axes[Axis::Filter]) now.filter = state.axes[Axis::Filter]->position;
  if (state.temperature) {
    now.temperature = Celsius{kTemperatureGrid_c * std::round(state.temperature->value / kTemperatureGrid_c)};
  }
  if (shared_optics_ && now == optics->conditions()) return;
  optics = optics->In(now);
  shared_optics_ = std::make_shared<const OpticsTable>(*optics);
}

Backlash Rig::Impl::BacklashOf(Axis axis) const {
  if (const auto& said = as_configured_.axes[axis].backlash) return {*said, *said, *said, false};
  if (calibration_ && calibration_->backlash[axis]) return *calibration_->backlash[axis];
  return {};
}

/// While nothing else goes on, focus goes after the temperature, once that is worth a move.
void Rig::Impl::FollowTemperature() {
  if (!config_.temperature.compensate || !held_ || !optics || !optics->has_focus() || problem_) return;
  if (run_ || looks_.anyone() || Moving() || !targets_[Axis::Focus] || !setups_[Axis::Focus]) return;
  const AxisSetup& focus = *setups_[Axis::Focus];
  const Native wanted = std::clamp(optics->NativeFromExtension(*held_), focus.minimum, focus.maximum);
  if (std::abs((wanted - *targets_[Axis::Focus]).value) < config_.temperature.minimum_move) return;
  Move(Axis::Focus, {.kind = Target::Kind::Native, .value = wanted.value, .from = {}, .take_up = {}}, nullptr);
  following_ = true;
}

Metres Rig::Impl::ExtensionBound(Native here, Native bound) const {
  return Reach(optics->ExtensionFromNative(here), optics->ExtensionFromNative(here - bound),
               optics->ExtensionFromNative(here + bound)) +
         optics->ExtensionError(here);
}

FNumber Rig::Impl::FNumberBound(Native here, Native bound) const {
  const FNumber middle = optics->FNumberFromNative(here);
  return Reach(middle, optics->FNumberFromNative(here - bound), optics->FNumberFromNative(here + bound)) +
         middle * optics->FNumberError();
}

void Rig::Impl::AddOptics(MoveOutcome& outcome) const {
  if (!optics) return;
  const Native here = outcome.position, low = here - outcome.bound, high = here + outcome.bound;
  if (outcome.axis == Axis::Focus && optics->has_focus()) {
    const Metres at_low = optics->ExtensionFromNative(low), at_high = optics->ExtensionFromNative(high);
    outcome.extension = optics->ExtensionFromNative(here);
    outcome.extension_bound = ExtensionBound(here, outcome.bound);
    outcome.vergence = optics->VergenceFromExtension(*outcome.extension);
    outcome.vergence_bound =
        Reach(*outcome.vergence, optics->VergenceFromExtension(at_low), optics->VergenceFromExtension(at_high)) +
        optics->VergenceError(here);
  }
  if (outcome.axis == Axis::Iris && optics->has_iris()) {
    outcome.f_number = optics->FNumberFromNative(here);
    outcome.f_number_bound = FNumberBound(here, outcome.bound);
  }
  if (outcome.axis == Axis::Zoom && optics->has_zoom()) {
    outcome.focal_length = optics->FocalLengthFromNative(here);
    outcome.focal_length_bound =
        Reach(*outcome.focal_length, optics->FocalLengthFromNative(low), optics->FocalLengthFromNative(high)) +
        *outcome.focal_length * optics->FocalLengthError();
  }
}

void Rig::Impl::AddOptics(Status& status) const {
  if (!optics) return;
  status.optics = shared_optics_;
  status.focal_length = optics->focal_length();
  if (optics->has_focus() && status.axes[Axis::Focus] && Known(Axis::Focus)) {
    const Native focus = status.axes[Axis::Focus]->position;
    status.extension = optics->ExtensionFromNative(focus);
    status.vergence = optics->VergenceFromExtension(*status.extension);
    status.focal_length = optics->FocalLengthAt(*status.extension);
    status.grade = optics->GradeAt(focus);
    if (status.grade != Grade::Uncalibrated) status.extension_error = optics->ExtensionError(focus);
  }
  if (optics->has_iris() && status.axes[Axis::Iris]) {
    if (Known(Axis::Iris)) status.f_number = optics->FNumberFromNative(status.axes[Axis::Iris]->position);
  } else {
    status.f_number = optics->fixed_f_number();
  }
}

}  // namespace lensd::rig
