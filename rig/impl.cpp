#include "impl.h"

#include <algorithm>
#include <utility>

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr Duration kMotionPeriod = std::chrono::milliseconds(2);  ///< between readings while something happens
constexpr Duration kIdlePeriod = std::chrono::milliseconds(500);
constexpr int kReadAttempts = 3;

}  // namespace

Rig::Impl::Impl(RigConfig config, drivers::Device opened, std::optional<OpticsTable> table, const Clock& the_clock,
                std::shared_ptr<const Calibration> calibration, std::unique_ptr<PositionMemory> memory)
    : device(std::move(opened)),
      optics(std::move(table)),
      clock(the_clock),
      config_(std::move(config)),
      as_configured_(config_),
      calibration_(std::move(calibration)),
      memory_(std::move(memory)),
      looks_(device.camera.get()) {
  for (const Axis axis : drivers::kAxes) {
    const auto& can = device.lens->capabilities().axes[axis];
    if (!can) continue;
    setups_[axis] = MakeSetup(axis, *can, config_.axes[axis]);
    tracks_[axis] = std::make_unique<AxisTrack>(*setups_[axis]);
    tolerances_[axis] = setups_[axis]->tolerance;
    latency_ = std::max(latency_, config_.axes[axis].latency);
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
  if (!steady || looks_.frame() || outside_waits) {
    Instant next = now + kMotionPeriod;
    for (const Axis axis : drivers::kAxes) {
      const auto part = motions_[axis] ? motions_[axis]->next_part() : std::nullopt;
      if (part) next = std::min(next, *part);
    }
    return next;
  }
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

void Rig::Impl::NoteReading(drivers::LensState state) {
  state.sampled_at -= latency_;
  if (!std::exchange(recalled_, true)) Recall(state);
  for (const Axis axis : drivers::kAxes) {
    if (tracks_[axis] && state.axes[axis]) state.axes[axis]->position.value += tracks_[axis]->offset().value;
  }
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
  state_ = std::move(state);
  NoteConditions(*state_);
  for (const Axis axis : drivers::kAxes) {
    if (!tracks_[axis] || !state_->axes[axis]) continue;
    NoteAxis(axis, *state_->axes[axis], state_->sampled_at);
    // A reading from before the stop says nothing of it.
    if (coasting_[axis]) state_->axes[axis]->moving = true;
  }
}

/// Who moves it, and when it has come to rest.
void Rig::Impl::NoteAxis(Axis axis, const drivers::AxisState& state, Instant sampled_at) {
  AxisTrack& track = *tracks_[axis];
  const bool was_moved = track.moved_by_another();
  track.Note(state, sampled_at, motions_[axis] != nullptr || coasting_[axis]);
  if (track.moved_by_another() && !was_moved) targets_[axis].reset();
  if (coasting_[axis] && !state.moving && sampled_at > *coasting_[axis]) coasting_[axis].reset();
  if (!motions_[axis] && !coasting_[axis] && !state.moving) RememberRest(axis);
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

/// The motor of one axis: every command passes here, and none goes out before it is remembered.
class Rig::Impl::AxisMotor final : public Motor {
 public:
  AxisMotor(Impl& rig, Axis axis) : rig_(rig), axis_(axis), track_(*rig.tracks_[axis]), setup_(*rig.setups_[axis]) {}

  Result<void> Go(Native target, bool begins) override {
    const drivers::AxisState& state = *rig_.state_->axes[axis_];
    const Native room{track_.slack().whole()};
    auto remembered =
        rig_.RememberMotion(axis_, std::min(state.position, target) - room, std::max(state.position, target) + room);
    if (!remembered) return remembered;
    if (begins) {
      const double ahead = (target - state.position).value * (setup_.approach_up ? 1.0 : -1.0);
      track_.Commanded(state.moving || ahead < 0.0, rig_.clock.Now());
    }
    return rig_.device.lens->StartMove(axis_, target - track_.offset());
  }
  Result<void> Home() override {
    if (auto remembered = rig_.RememberMotion(axis_, setup_.minimum, setup_.maximum); !remembered) return remembered;
    track_.Commanded(true, rig_.clock.Now());
    return rig_.device.lens->StartHome(axis_);
  }
  /// That it cannot be stopped changes nothing about the answer.
  void Halt() override {
    if (setup_.can.can_stop) (void)rig_.device.lens->Stop(axis_);
  }
  Native AtReference(Native position) override {
    const Native stands = position - track_.offset();
    track_.Homed(rig_.clock.Now());
    SetLimits(*rig_.setups_[axis_], {});
    rig_.state_->axes[axis_]->position = stands;
    return stands;
  }

 private:
  Impl& rig_;
  Axis axis_;
  AxisTrack& track_;
  const AxisSetup& setup_;
};

void Rig::Impl::AdvanceMotions() {
  for (const Axis axis : drivers::kAxes) {
    if (!motions_[axis] || problem_ || !state_ || !state_->axes[axis]) continue;
    AxisMotor motor(*this, axis);
    auto end = motions_[axis]->Step(motor, *state_->axes[axis], state_->sampled_at, clock.Now());
    if (end) EndMotion(axis, *std::move(end));
  }
}

void Rig::Impl::StartMotion(Axis axis, std::optional<Native> target, double overshoot, TakeUp take_up,
                            MoveCallback done, std::optional<std::vector<Impulse>> pace) {
  auto parts = pace ? *std::move(pace) : setups_[axis]->impulses;
  motions_[axis] = std::make_unique<AxisMotion>(*setups_[axis], *tracks_[axis], target, overshoot, take_up,
                                                std::move(done), clock.Now(), std::move(parts));
  targets_[axis] = target;
}

/// A motion of `axis` ended before it stood.
void Rig::Impl::Coasts(Axis axis) {
  coasting_[axis] = clock.Now();
  tracks_[axis]->Disturbed(clock.Now());
}

/// Ends it unanswered.
void Rig::Impl::DropMotion(Axis axis) {
  const auto motion = std::exchange(motions_[axis], nullptr);
  targets_[axis].reset();
  if (motion && motion->commands() > 0) Coasts(axis);
}

void Rig::Impl::EndMotion(Axis axis, Result<MoveOutcome> end) {
  if (!motions_[axis]) return;
  const auto motion = std::exchange(motions_[axis], nullptr);
  if (run_ && axis == Axis::Focus) run_motions_ += motion->commands();
  const bool reached = end && end->reached;
  if (end) AddOptics(*end);
  const bool followed = axis == Axis::Focus && std::exchange(following_, false);
  if (axis == Axis::Focus && reached && !followed) held_ = end->extension;
  if (!reached) targets_[axis].reset();
  if (reached) {
    coasting_[axis].reset();
    RememberRest(axis);
  } else if (motion->commands() > 0) {
    Coasts(axis);
  }
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
  if (auto unknown = PositionUnknown(axis)) {
    return Reply(std::move(done), Result<MoveOutcome>(std::unexpected(*unknown)));
  }
  Disturb(axis);
  if (target.take_up) return StartMotion(axis, *native, *target.take_up, TakeUp::FromBeyond, std::move(done));
  const double overshoot = setups_[axis]->TakesUp() ? tracks_[axis]->slack().whole() : 0.0;
  StartMotion(axis, *native, overshoot, TakeUp::Always, std::move(done));
}

void Rig::Impl::Home(Axis axis, MoveCallback done) {
  if (!setups_[axis] || !setups_[axis]->can.can_home) {
    const std::string name(AxisName(axis));
    return Reply(std::move(done), Result<MoveOutcome>(Fail(
                                      Code::Unsupported, "this lens has no " + name + " that can search a reference")));
  }
  Disturb(axis);
  StartMotion(axis, std::nullopt, 0.0, TakeUp::Always, std::move(done));
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
    if (moving) Coasts(axis);
    EndMotion(axis, std::unexpected(cancelled));
    targets_[axis].reset();
  }
  if (named(Axis::Focus)) EndAutofocus(std::unexpected(cancelled));
  Reply(std::move(done), std::move(answer));
}

void Rig::Impl::ResetFaults(const std::vector<Axis>& axes, StopCallback done) {
  Result<void> answer;
  for (const Axis axis : drivers::kAxes) {
    const bool named = std::ranges::find(axes, axis) != axes.end();
    if (!setups_[axis] || (!named && !axes.empty())) continue;
    const auto reset = device.lens->ResetFault(axis);
    const bool no_matter = !reset && reset.error().code == Code::Unsupported && !named;
    if (!reset && !no_matter && answer) answer = reset;
  }
  next_read_ = clock.Now();
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
  const bool settled = steady && frame.exposure_start >= *steady;
  if (settled || looks_.anyone_in_motion()) HandOut(frame, settled);
}

void Rig::Impl::HandOut(const drivers::Frame& frame, bool settled) {
  LensedFrame lensed = WithLens(frame);
  if (auto& focus = lensed.axes[Axis::Focus]) {
    // Backlash that was taken up since may still have been there during the exposure.
    const Native bound{tracks_[Axis::Focus]->Bound()};
    const Native before = std::exchange(handed_out_bound_, bound);
    if (before > bound) focus->mid_bound = focus->mid_bound + (before - bound);
  }
  bool moved = !settled;
  for (const Axis axis : drivers::kAxes) {
    if (!lensed.axes[axis]) continue;
    lensed.axes[axis]->moving |= !settled;
    moved |= lensed.axes[axis]->moving;
  }
  for (auto& done : looks_.TakeSatisfied(frame.exposure_start, moved))
    Reply(std::move(done), Result<LensedFrame>(lensed));
}

LensedFrame Rig::Impl::WithLens(const drivers::Frame& frame) const {
  LensedFrame lensed;
  lensed.frame = frame;
  lensed.axes = history_.During(frame.exposure_start, frame.exposure_end, tolerances_);
  for (const Axis axis : drivers::kAxes) {
    auto& during = lensed.axes[axis];
    if (!during) continue;
    during->bound = 0.5 * (during->highest - during->lowest) + Native{tracks_[axis]->Bound()};
    during->mid_bound = during->mid_bound + Native{tracks_[axis]->Bound()};
  }
  const auto middle = [&](Axis axis) { return 0.5 * (lensed.axes[axis]->lowest + lensed.axes[axis]->highest); };
  if (optics && optics->has_focus() && lensed.axes[Axis::Focus] && Known(Axis::Focus)) {
    lensed.extension = optics->ExtensionFromNative(middle(Axis::Focus));
    lensed.extension_bound = ExtensionBound(middle(Axis::Focus), lensed.axes[Axis::Focus]->bound);
  }
  if (optics && optics->has_iris()) {
    if (!lensed.axes[Axis::Iris] || !Known(Axis::Iris)) return lensed;
    lensed.f_number = optics->FNumberFromNative(middle(Axis::Iris));
    lensed.f_number_bound = FNumberBound(middle(Axis::Iris), lensed.axes[Axis::Iris]->bound);
  } else if (optics && optics->fixed_f_number()) {
    lensed.f_number = optics->fixed_f_number();
    lensed.f_number_bound = FNumber{};
  }
  return lensed;
}

}  // namespace lensd::rig
