// Focus, iris and zoom of one GenICam camera through its own features. What the camera calls its position and its
// status decides what can be claimed (docs/drivers/aravis.md).
#include "aravis_lens.h"

#include <arv.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/api/thread_barrier.h"

namespace lensd::drivers::aravis {
namespace {

constexpr Duration kTemperatureEvery = std::chrono::seconds(2);
/// Of a lens that shows nothing at all: no "busy" can be late, and no position wrong.
constexpr Duration kSilent = std::chrono::milliseconds(250);

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

LensControl::LensControl(LensFacts facts, const Clock& clock) : facts_(std::move(facts)), clock_(clock) {
  for (const Axis axis : kAxes) {
    const auto& feature = facts_.axes[axis];
    if (!feature) continue;
    // A position that is none, or the target by the standard, tells nothing of the way: Busy alone does.
    const bool follows = feature->can.follows(), silent = feature->status.empty() && facts_.status.empty();
    ways_[axis].emplace(ArrivalWatch(feature->can.resolution,
                                     follows ? ArrivalWatch::Shows::Position : ArrivalWatch::Shows::Busy,
                                     silent && !follows ? kSilent : kRegisterLag));
  }
}

/// Nothing where there is no such feature. An entry the camera's own description does not name reads as no text at all.
Result<std::optional<Condition>> LensControl::ReadCondition(ArvCamera* camera, const std::string& feature) const {
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

Result<AxisState> LensControl::ReadAxis(ArvCamera* camera, Axis axis, std::optional<Condition> controller) {
  const AxisFeature& feature = *facts_.axes[axis];
  auto own = ReadCondition(camera, feature.status);
  if (!own) return PassOn(own);
  auto position = ReadPosition(camera, feature);
  if (!position) return PassOn(position);
  const Way& way = *ways_[axis];
  AxisState state;
  state.position = *position;
  if (feature.can.feedback == Feedback::None && way.target) state.position = *way.target;
  // The axis' own word counts where it has one; the controller's is about all of them.
  const Condition word = *own ? **own : controller.value_or(Condition::Ready);
  state.moving = Moves(axis, state.position, word == Condition::Busy, clock_.Now());
  ForgetCut(axis);
  state.assumed = way.assumed;
  state.homed = word != Condition::NotInitialized && controller != Condition::NotInitialized;
  state.fault = FaultOf(controller == Condition::NotConnected ? Condition::NotConnected : word);
  return state;
}

/// A position that is neither where it set out nor where it was sent is no echo, and not told at the end alone.
void LensControl::ForgetCut(Axis axis) {
  Way& way = *ways_[axis];
  if (!way.cut || !way.from || !way.believed) return;
  const double resolution = facts_.axes[axis]->can.resolution;
  const auto near = [&](Native place) { return std::abs((*way.believed - place).value) <= resolution; };
  if (near(*way.cut) || near(*way.from)) return;
  way.cut.reset();
  way.assumed = false;
}

void LensControl::Told(Axis axis, std::optional<Native> target) {
  Way& way = *ways_[axis];
  way.from = way.under_way ? std::nullopt : way.believed;
  way.target = target;
  way.cut.reset();
  way.under_way = true;
  way.assumed = way.there_at_once = false;
  target ? way.watch.Sent(*target, clock_.Now()) : way.watch.Homing(clock_.Now());
}

/// Takes an echo out of `position`. Arrival is believed where Busy has been seen, or the position on its way; else it
/// is taken for granted once registers say what is, and nothing has shown.
bool LensControl::Moves(Axis axis, Native& position, bool busy, Instant now) {
  Way& way = *ways_[axis];
  const AxisFeature& feature = *facts_.axes[axis];
  const bool arrived = way.target && std::abs((position - *way.target).value) <= feature.can.resolution;
  const auto verdict = way.watch.Judge(position, busy, now);
  way.there_at_once = way.there_at_once || (way.under_way && arrived && !way.watch.seen());
  if (busy && way.there_at_once && way.watch.busy_seen()) way.live = false;  // it was only setting out
  way.live = way.live || way.watch.live();
  if (verdict.echo) position = verdict.instead.value_or(way.believed.value_or(position));
  way.believed = position;
  if (verdict.moving || !way.under_way) return verdict.moving;
  way.under_way = false;
  // A position that is not the target is no echo of it: there the camera's word that it rests is enough.
  const bool says_it_rests = !arrived && !(feature.status.empty() && facts_.status.empty());
  const bool stopped = !way.target && way.cut;
  if (!stopped) way.assumed = !way.watch.seen() && !way.live && !says_it_rests;
  return false;
}

/// It may have been without power.
void LensControl::ForgetMotions() {
  for (const Axis axis : kAxes) {
    if (!ways_[axis]) continue;
    Way& way = *ways_[axis];
    way.watch.Forget();
    way.cut.reset();
    way.under_way = way.live = way.there_at_once = way.assumed = false;
  }
}

Result<LensState> LensControl::Read(ArvCamera* camera, int times_opened) {
  if (std::exchange(times_opened_, times_opened) != times_opened) ForgetMotions();
  return ReadAll(camera);
}

Result<LensState> LensControl::ReadAll(ArvCamera* camera) {
  LensState state;
  state.sampled_at = clock_.Now();
  auto controller = ReadCondition(camera, facts_.status);
  if (!controller) return PassOn(controller);
  for (const Axis axis : kAxes) {
    if (!facts_.axes[axis]) continue;
    auto read = ReadAxis(camera, axis, *controller);
    if (!read) return PassOn(read);
    state.axes[axis] = *std::move(read);
  }
  if (!facts_.temperature.empty() && state.sampled_at > temperature_read_ + kTemperatureEvery) {
    CallError error;
    const double celsius = arv_camera_get_float(camera, facts_.temperature.c_str(), error.out());
    if (!error && std::isfinite(celsius)) state.temperature = Celsius{celsius};
    temperature_read_ = state.sampled_at;
  }
  return state;
}

Result<void> LensControl::StartHome(ArvCamera* camera, Axis axis) {
  auto begun = Execute(camera, facts_.axes[axis]->initialize);
  Told(axis, std::nullopt);
  return begun;
}

Result<void> LensControl::StartMove(ArvCamera* camera, Axis axis, Native target) {
  const AxisFeature& feature = *facts_.axes[axis];
  for (const std::string* status : {&feature.status, &facts_.status}) {
    const auto condition = ReadCondition(camera, *status);
    if (!condition) return PassOn(condition);
    if (*condition == Condition::NotInitialized) {
      return Fail(Code::NotHomed, std::string(AxisName(axis)) + " is not initialized: home it first");
    }
  }
  auto written = Write(camera, feature, target);
  if (!written) return written;
  Told(axis, target);
  return {};
}

/// The standard's abort stops every axis: the others are sent on.
Result<void> LensControl::Stop(ArvCamera* camera, Axis axis) {
  const auto before = ReadAll(camera);
  if (auto aborted = Execute(camera, facts_.abort); !aborted) return aborted;
  Way& way = *ways_[axis];
  const bool under_way = !before || (before->axes[axis] && before->axes[axis]->moving);
  if (under_way && way.target && !way.live) {
    way.cut = way.target;
    way.assumed = true;
  }
  way.target.reset();
  way.watch.Stopped(clock_.Now());
  for (const Axis other : kAxes) {
    if (other == axis || !facts_.axes[other] || !ways_[other]->target) continue;
    const bool may_move = !before || (before->axes[other] && before->axes[other]->moving);
    if (!may_move) continue;
    if (auto sent = Write(camera, *facts_.axes[other], *ways_[other]->target); !sent) return sent;
    ways_[other]->watch.Sent(*ways_[other]->target, clock_.Now());
  }
  return {};
}

// ---- any thread ---------------------------------------------------------------------------------------------------

AravisLens::AravisLens(std::shared_ptr<AravisLink> link, LensFacts facts, const std::string& serial, const Clock& clock)
    : Lens(CapabilitiesOf(facts, serial)),
      link_(std::move(link)),
      control_(std::make_shared<LensControl>(std::move(facts), clock)) {}

AravisLens::~AravisLens() {
  if (control_->facts().abort.empty()) return;
  Contain([this] {
    (void)link_->Call<void>(
        [control = control_](ArvCamera* camera) { return Execute(camera, control->facts().abort); });
  });
}

Result<LensState> AravisLens::DoRead() {
  return link_->Call<LensState>([control = control_, link = link_.get()](ArvCamera* camera) {
    return control->Read(camera, link->times_opened());
  });
}

Result<void> AravisLens::DoStartHome(Axis axis) {
  return link_->Call<void>([control = control_, axis](ArvCamera* camera) { return control->StartHome(camera, axis); });
}

Result<void> AravisLens::DoStartMove(Axis axis, Native target) {
  return link_->Call<void>(
      [control = control_, axis, target](ArvCamera* camera) { return control->StartMove(camera, axis, target); });
}

Result<void> AravisLens::DoStop(Axis axis) {
  return link_->Call<void>([control = control_, axis](ArvCamera* camera) { return control->Stop(camera, axis); });
}

}  // namespace lensd::drivers::aravis
