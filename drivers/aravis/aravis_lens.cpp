#include "aravis_lens.h"

#include <arv.h>

#include <cmath>
#include <utility>

namespace lensd::drivers::aravis {
namespace {

constexpr Duration kTemperatureEvery = std::chrono::seconds(2);
constexpr Duration kShowsBusy = std::chrono::milliseconds(250);  ///< by then a lens that is to move says Busy, if ever

Capabilities CapabilitiesOf(const LensFacts& facts, const std::string& serial) {
  Capabilities can;
  can.driver = "aravis";
  can.model = facts.model;
  can.serial = serial;
  for (const Axis axis : kAxes) {
    if (facts.axes[axis]) can.axes[axis] = facts.axes[axis]->can;
  }
  return can;
}

Result<void> Write(ArvCamera* camera, const AxisFeature& axis, Native target) {
  CallError error;
  if (axis.is_integer) {
    arv_camera_set_integer(camera, axis.feature.c_str(), std::llround(target.value), error.out());
  } else {
    arv_camera_set_float(camera, axis.feature.c_str(), target.value, error.out());
  }
  return error.Check("setting " + axis.feature);
}

Result<Native> ReadPosition(ArvCamera* camera, const AxisFeature& axis) {
  CallError error;
  const double value = axis.is_integer
                           ? static_cast<double>(arv_camera_get_integer(camera, axis.feature.c_str(), error.out()))
                           : arv_camera_get_float(camera, axis.feature.c_str(), error.out());
  if (error) return error.Why("reading " + axis.feature);
  if (!std::isfinite(value)) return Fail(Code::Protocol, axis.feature + " reads as no number");
  if (axis.is_integer) return Native{value};
  // Real numbers come back with digits that the axis does not have: on its grid they mean what was asked for.
  const double least = axis.can.minimum.value, step = axis.can.resolution;
  return Native{least + std::round((value - least) / step) * step};
}

Result<void> Execute(ArvCamera* camera, const std::string& command) {
  CallError error;
  arv_camera_execute_command(camera, command.c_str(), error.out());
  return error.Check("executing " + command);
}

}  // namespace

AravisLens::AravisLens(std::shared_ptr<Link> link, LensFacts facts, const std::string& serial, const Clock& clock)
    : Lens(CapabilitiesOf(facts, serial)), link_(std::move(link)), facts_(std::move(facts)), clock_(clock) {}

AravisLens::~AravisLens() {
  if (facts_.abort.empty()) return;
  (void)link_->Call<void>([abort = facts_.abort](ArvCamera* camera) { return Execute(camera, abort); });
}

/// Nothing where there is no such feature. An entry the camera's own description does not name reads as no text at all.
Result<std::optional<Condition>> AravisLens::ReadCondition(ArvCamera* camera, const std::string& feature) const {
  if (feature.empty()) return std::optional<Condition>();
  CallError error;
  const char* entry = arv_camera_get_string(camera, feature.c_str(), error.out());
  if (error) return error.Why("reading " + feature);
  const Condition condition = entry == nullptr ? Condition::Unknown : ConditionOf(entry);
  if (condition != Condition::Unknown) return std::optional(condition);
  const std::string what = entry == nullptr ? "has a value that has no name" : std::string("says \"") + entry + "\"";
  return Fail(Code::Protocol, feature + " " + what +
                                  ", which means nothing to this driver; set status_feature = \"none\" to do without");
}

Result<AxisState> AravisLens::ReadAxis(ArvCamera* camera, Axis axis, std::optional<Condition> controller) {
  const AxisFeature& feature = *facts_.axes[axis];
  auto own = ReadCondition(camera, feature.status);
  if (!own) return PassOn(std::move(own));
  auto position = ReadPosition(camera, feature);
  if (!position) return PassOn(std::move(position));
  AxisState state;
  state.position = *position;
  if (!feature.can.feedback && targets_[axis]) state.position = *targets_[axis];
  const auto says = [&](Condition condition) { return *own == condition || controller == condition; };
  // The axis' own word counts where it has one; the controller's is about all of them.
  state.moving = (*own ? **own : controller.value_or(Condition::Ready)) == Condition::Busy;
  state.moving = state.moving || Waits(axis, state, clock_.Now());
  state.homed = !says(Condition::NotInitialized);
  for (const Condition bad : {Condition::NotConnected, Condition::NotSupported, Condition::Error}) {
    if (says(bad)) state.fault = FaultOf(bad);
  }
  return state;
}

/// Busy comes a little after the command, or never: a lens that has not arrived is taken to be about to start.
bool AravisLens::Waits(Axis axis, const AxisState& state, Instant now) {
  auto& pending = pending_[axis];
  if (!pending) return false;
  const double resolution = facts_.axes[axis]->can.resolution;
  const bool arrived = pending->target && std::abs((state.position - *pending->target).value) <= resolution;
  if (!state.moving && !arrived && now < pending->since + kShowsBusy) return true;
  pending.reset();
  return false;
}

Result<LensState> AravisLens::ReadAll(ArvCamera* camera) {
  LensState state;
  state.sampled_at = clock_.Now();
  auto controller = ReadCondition(camera, facts_.status);
  if (!controller) return PassOn(std::move(controller));
  for (const Axis axis : kAxes) {
    if (!facts_.axes[axis]) continue;
    auto read = ReadAxis(camera, axis, *controller);
    if (!read) return PassOn(std::move(read));
    state.axes[axis] = *std::move(read);
  }
  if (!facts_.temperature.empty() && (!temperature_ || state.sampled_at > temperature_read_ + kTemperatureEvery)) {
    CallError error;
    const double celsius = arv_camera_get_float(camera, facts_.temperature.c_str(), error.out());
    temperature_.reset();
    if (!error && std::isfinite(celsius)) temperature_ = Celsius{celsius};
    temperature_read_ = state.sampled_at;
  }
  state.temperature = temperature_;
  return state;
}

Result<LensState> AravisLens::DoRead() {
  return link_->Call<LensState>([this](ArvCamera* camera) { return ReadAll(camera); });
}

Result<void> AravisLens::DoStartHome(Axis axis) {
  return link_->Call<void>([this, axis](ArvCamera* camera) {
    targets_[axis].reset();
    auto begun = Execute(camera, facts_.axes[axis]->initialize);
    if (begun) pending_[axis] = Pending{clock_.Now(), std::nullopt};
    return begun;
  });
}

Result<void> AravisLens::DoStartMove(Axis axis, Native target) {
  return link_->Call<void>([this, axis, target](ArvCamera* camera) -> Result<void> {
    const AxisFeature& feature = *facts_.axes[axis];
    for (const std::string* status : {&feature.status, &facts_.status}) {
      const auto condition = ReadCondition(camera, *status);
      if (!condition) return std::unexpected(condition.error());
      if (*condition == Condition::NotInitialized) {
        return Fail(Code::Unsupported, std::string(AxisName(axis)) + " is not initialized: home it first");
      }
    }
    auto written = Write(camera, feature, target);
    if (!written) return written;
    targets_[axis] = target;
    pending_[axis] = Pending{clock_.Now(), target};
    return {};
  });
}

/// The standard's abort stops every axis: the others are sent on.
Result<void> AravisLens::DoStop(Axis axis) {
  return link_->Call<void>([this, axis](ArvCamera* camera) -> Result<void> {
    const auto before = ReadAll(camera);
    if (auto aborted = Execute(camera, facts_.abort); !aborted) return aborted;
    targets_[axis].reset();
    pending_[axis].reset();
    for (const Axis other : kAxes) {
      if (other == axis || !facts_.axes[other] || !targets_[other]) continue;
      const bool may_move = !before || (before->axes[other] && before->axes[other]->moving);
      if (!may_move) continue;
      if (auto sent = Write(camera, *facts_.axes[other], *targets_[other]); !sent) return sent;
    }
    return {};
  });
}

}  // namespace lensd::drivers::aravis
