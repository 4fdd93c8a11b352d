#include "impl.h"

#include <algorithm>
#include <utility>

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr Duration kMotionPeriod = std::chrono::milliseconds(2);  ///< between readings while something happens
constexpr Duration kIdlePeriod = std::chrono::milliseconds(500);
constexpr int kReadAttempts = 3;

AxisSetup MakeSetup(Axis axis, const drivers::AxisCapabilities& can, const AxisConfig& config) {
  AxisSetup setup;
  setup.axis = axis;
  setup.can = can;
  setup.config = config;
  setup.minimum = can.minimum;
  setup.maximum = can.maximum;
  if (config.limits) {
    setup.minimum = std::max(can.minimum, config.limits->first);
    setup.maximum = std::min(can.maximum, config.limits->second);
  }
  setup.settle = config.settle.value_or(can.settle);
  setup.speed = config.speed;
  if (!setup.speed && can.speed > 0) setup.speed = can.speed;
  // A neighbouring filter is another filter.
  setup.tolerance = config.tolerance.value_or(axis == Axis::Filter ? 0.5 * can.resolution : can.resolution);
  setup.approach_up = axis == Axis::Focus ? config.approach_near == config.near_positive : true;
  return setup;
}

}  // namespace

Rig::Impl::Impl(RigConfig config, drivers::Device opened, std::optional<OpticsTable> table, const Clock& the_clock,
                std::shared_ptr<const Calibration> calibration)
    : device(std::move(opened)),
      optics(std::move(table)),
      clock(the_clock),
      config_(std::move(config)),
      as_configured_(config_),
      calibration_(std::move(calibration)),
      looks_(device.camera.get()) {
  for (const Axis axis : drivers::kAxes) {
    const auto& can = device.lens->capabilities().axes[axis];
    if (!can) continue;
    setups_[axis] = MakeSetup(axis, *can, config_.axes[axis]);
    tolerances_[axis] = setups_[axis]->tolerance;
  }
  AdoptBacklash();
  ReadLens();
}

/// Nobody is left waiting for an answer that will never come.
Rig::Impl::~Impl() {
  do {
    for (auto& command : std::exchange(commands_, {})) command();
    FailAll(Error{Code::Cancelled, "the lens was closed"});
    RunReplies();
  } while (!commands_.empty());
}

void Rig::Impl::RunReplies() {
  while (!replies_.empty()) {
    auto reply = std::move(replies_.front());
    replies_.pop_front();
    reply();
  }
  if (!std::exchange(run_ended_, false)) return;
  run_.reset();
  EndOutside();
}

Instant Rig::Impl::Step(Instant now) {
  for (auto& command : std::exchange(commands_, {})) command();
  if (auto polled = looks_.Poll(now, SteadySince(), run_ != nullptr && !outside_); !polled) {
    for (auto& done : looks_.TakeAll()) Reply(std::move(done), Result<LensedFrame>(std::unexpected(polled.error())));
  }
  const bool frame_to_judge = outside_ && outside_->given();
  // A lens that does not answer is asked again now and then, or because somebody wants something of it.
  const bool asked = looks_.anyone() || frame_to_judge ||
                     std::ranges::any_of(drivers::kAxes, [&](Axis axis) { return motions_[axis] != nullptr; });
  if (asked || (Moving() && !problem_) || now >= next_read_) ReadLens();
  AdvanceMotions();
  ServeLooks();
  ServeOutside();
  if (run_) run_->CheckDeadline();
  FollowTemperature();
  RunReplies();
  return NextStep(now);
}

Instant Rig::Impl::NextStep(Instant now) const {
  if (!commands_.empty()) return now;
  if (problem_ && !looks_.anyone() && !(outside_ && outside_->given())) return next_read_;
  const auto steady = SteadySince();
  const bool outside_waits = outside_ && (outside_->unannounced() || outside_->given());
  if (!steady || looks_.frame() || outside_waits) return now + kMotionPeriod;
  if (looks_.anyone()) return looks_.NextPoll(now, *steady);
  return next_read_;
}

// ---- what the lens says -------------------------------------------------------------------------------------------

void Rig::Impl::ReadLens() {
  auto read = device.lens->Read();
  next_read_ = clock.Now() + kIdlePeriod;
  if (read) {
    if (problem_) state_.reset();  // what happened meanwhile nobody knows: it has to stand still anew
    problem_.reset();
    read_failures_ = 0;
    NoteReading(*read);
    return;
  }
  ++read_failures_;
  const Code code = read.error().code;
  if (code == Code::Cancelled) return;
  const bool transient = code == Code::Timeout || code == Code::Protocol || code == Code::Busy;
  if (transient && read_failures_ < kReadAttempts) {
    next_read_ = clock.Now() + kMotionPeriod;
    return;
  }
  problem_ = read.error();
  targets_ = {};
  history_.Clear();
  FailAll(*problem_);
}

void Rig::Impl::NoteReading(const drivers::LensState& state) {
  history_.Add(state);
  for (const Axis axis : drivers::kAxes) {
    if (!setups_[axis] || !state.axes[axis]) continue;
    const auto* before = state_ && state_->axes[axis] ? &*state_->axes[axis] : nullptr;
    const auto& after = *state.axes[axis];
    const bool stood = before != nullptr && !before->moving && !after.moving &&
                       std::abs((after.position - before->position).value) <= tolerances_[axis];
    // It came to rest at this reading at the latest.
    if (!stood) steady_since_[axis] = state.sampled_at + setups_[axis]->settle;
  }
  state_ = state;
  NoteConditions(state);
}

bool Rig::Impl::Moving() const {
  return std::ranges::any_of(drivers::kAxes, [&](Axis axis) {
    return motions_[axis] != nullptr || (state_ && state_->axes[axis] && state_->axes[axis]->moving);
  });
}

/// Since when no axis has moved; nothing while one does or the lens does not answer.
std::optional<Instant> Rig::Impl::SteadySince() const {
  if (Moving() || problem_ || !state_) return std::nullopt;
  Instant since{};
  for (const Axis axis : drivers::kAxes) since = std::max(since, steady_since_[axis]);
  return since;
}

// ---- motions ------------------------------------------------------------------------------------------------------

void Rig::Impl::AdvanceMotions() {
  for (const Axis axis : drivers::kAxes) {
    if (!motions_[axis] || problem_ || !state_ || !state_->axes[axis]) continue;
    auto end = motions_[axis]->Step(*device.lens, *state_->axes[axis], state_->sampled_at, clock.Now());
    if (end) EndMotion(axis, *std::move(end));
  }
}

void Rig::Impl::StartMotion(Axis axis, std::optional<Native> target, double take_up, MoveCallback done) {
  motions_[axis] = std::make_unique<AxisMotion>(*setups_[axis], target, take_up, std::move(done), clock.Now());
  targets_[axis] = target;
}

void Rig::Impl::EndMotion(Axis axis, Result<MoveOutcome> end) {
  if (!motions_[axis]) return;
  const auto motion = std::exchange(motions_[axis], nullptr);
  if (run_ && axis == Axis::Focus) run_motions_ += motion->commands();
  if (end) AddOptics(*end);
  const bool followed = axis == Axis::Focus && std::exchange(following_, false);
  if (axis == Axis::Focus && end && end->reached && !followed) held_ = end->extension;
  if (!end || !end->reached) targets_[axis].reset();
  Reply(motion->TakeCallback(), std::move(end));
}

/// A new command for `axis` displaces its motion and any autofocus.
void Rig::Impl::Disturb(Axis axis) {
  const Error superseded{Code::Superseded, "a newer command for this lens took over"};
  if (run_) {
    const bool focus_under_way = axis != Axis::Focus && motions_[Axis::Focus] != nullptr;
    EndAutofocus(std::unexpected(superseded));
    if (focus_under_way && setups_[Axis::Focus]->can.can_stop) (void)device.lens->Stop(Axis::Focus);
  }
  EndMotion(axis, std::unexpected(superseded));
}

void Rig::Impl::FailAll(const Error& error) {
  EndAutofocus(std::unexpected(error));
  for (const Axis axis : drivers::kAxes) EndMotion(axis, std::unexpected(error));
  for (auto& done : looks_.TakeAll()) Reply(std::move(done), Result<LensedFrame>(std::unexpected(error)));
}

void Rig::Impl::Move(Axis axis, const Target& target, MoveCallback done) {
  const auto native = Resolve(axis, target);
  if (!native) return Reply(std::move(done), Result<MoveOutcome>(std::unexpected(native.error())));
  Disturb(axis);
  StartMotion(axis, *native, target.take_up.value_or(config_.axes[axis].backlash.value_or(0.0)), std::move(done));
}

void Rig::Impl::Home(Axis axis, MoveCallback done) {
  if (!setups_[axis] || !setups_[axis]->can.can_home) {
    const std::string name(AxisName(axis));
    return Reply(std::move(done), Result<MoveOutcome>(Fail(
                                      Code::Unsupported, "this lens has no " + name + " that can search a reference")));
  }
  Disturb(axis);
  StartMotion(axis, std::nullopt, 0.0, std::move(done));
}

void Rig::Impl::Stop(const std::vector<Axis>& axes, StopCallback done) {
  const Error cancelled{Code::Cancelled, "stopped"};
  Result<void> answer;
  const auto named = [&](Axis axis) { return axes.empty() || std::ranges::find(axes, axis) != axes.end(); };
  for (const Axis axis : drivers::kAxes) {
    if (!setups_[axis] || !named(axis)) continue;
    const bool can_stop = setups_[axis]->can.can_stop;
    const bool moving = motions_[axis] || (state_ && state_->axes[axis] && state_->axes[axis]->moving);
    Result<void> stopped;
    if (can_stop || moving) {
      for (int attempt = 0; attempt < kReadAttempts; ++attempt) {
        stopped = device.lens->Stop(axis);
        if (stopped || stopped.error().code != Code::Timeout) break;
      }
    }
    if (!stopped && answer) answer = stopped;
    EndMotion(axis, std::unexpected(cancelled));
    targets_[axis].reset();
  }
  if (named(Axis::Focus)) EndAutofocus(std::unexpected(cancelled));
  Reply(std::move(done), std::move(answer));
}

// ---- frames -------------------------------------------------------------------------------------------------------

void Rig::Impl::Snapshot(Instant since, SnapshotCallback done) {
  if (!device.camera) {
    return Reply(std::move(done), Result<LensedFrame>(Fail(Code::Unsupported, "this lens has no camera")));
  }
  looks_.Add({.since = since, .for_autofocus = false, .done = std::move(done)});
}

void Rig::Impl::ServeLooks() {
  for (auto& done : looks_.TakeExpired(clock.Now(), SteadySince())) {
    Reply(std::move(done), Result<LensedFrame>(Fail(Code::Timeout, "the camera gave no usable frame in time")));
  }
  // A frame is judged only once a reading from after its exposure is there.
  if (!looks_.frame() || !state_ || state_->sampled_at < looks_.frame()->exposure_end) return;
  const drivers::Frame frame = *looks_.frame();
  looks_.DropFrame();
  const auto steady = SteadySince();
  if (steady && frame.exposure_start >= *steady) HandOut(frame);
}

void Rig::Impl::HandOut(const drivers::Frame& frame) {
  const LensedFrame lensed = WithLens(frame);
  const bool moved =
      std::ranges::any_of(drivers::kAxes, [&](Axis axis) { return lensed.axes[axis] && lensed.axes[axis]->moving; });
  if (moved) return;
  for (auto& done : looks_.TakeSatisfied(frame.exposure_start)) Reply(std::move(done), Result<LensedFrame>(lensed));
}

LensedFrame Rig::Impl::WithLens(const drivers::Frame& frame) const {
  LensedFrame lensed;
  lensed.frame = frame;
  lensed.axes = history_.During(frame.exposure_start, frame.exposure_end, tolerances_);
  const auto middle = [&](Axis axis) { return 0.5 * (lensed.axes[axis]->lowest + lensed.axes[axis]->highest); };
  if (optics && optics->has_focus() && lensed.axes[Axis::Focus]) {
    lensed.extension = optics->ExtensionFromNative(middle(Axis::Focus));
  }
  if (optics && optics->has_iris() && lensed.axes[Axis::Iris]) {
    lensed.f_number = optics->FNumberFromNative(middle(Axis::Iris));
  } else if (optics) {
    lensed.f_number = optics->fixed_f_number();
  }
  return lensed;
}

}  // namespace lensd::rig
