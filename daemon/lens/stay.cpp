// One run moves an axis after the other. It ends as soon as anybody else has commanded the lens, and begins no further
// move once the lens is leased.
#include "daemon/lens/stay.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/quantity_text.h"
#include "daemon/events/log.h"
#include "daemon/lens/move_group.h"
#include "daemon/lens/served_lens.h"
#include "daemon/state/lens_state_files.h"
#include "daemon/state/state_file.h"
#include "drivers/api/own_autofocus.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;

constexpr Axis kGoingOrder[] = {Axis::Zoom, Axis::Filter, Axis::Iris, Axis::Focus};

/// The parts of a preset that are about one axis.
void CopyAxis(Axis axis, const rig::Preset& from, rig::Preset& to) {
  to.native[axis] = from.native[axis];
  if (axis == Axis::Iris) to.f_number = from.f_number;
  if (axis == Axis::Zoom) to.focal_length = from.focal_length;
  if (axis != Axis::Focus) return;
  to.approach_up = from.approach_up;
  to.vergence = from.vergence;
  to.vergence_bound = from.vergence_bound;
  to.extension = from.extension;
  to.temperature = from.temperature;
  to.grade = from.grade;
}

/// The lens as `status` has it.
rig::Preset PlaceIn(const rig::Status& status) {
  rig::Preset here;
  here.label = "last";
  here.temperature = status.temperature;
  for (const Axis axis : drivers::kAxes) {
    if (status.axes[axis]) here.native[axis] = status.axes[axis]->position;
  }
  if (const auto& focus = status.axes[Axis::Focus]) here.approach_up = focus->arrival.upward;
  here.vergence = status.vergence;
  here.vergence_bound = status.vergence_bound;
  here.extension = status.extension;
  here.f_number = status.f_number;
  here.grade = status.grade;
  if (status.optics) here.focal_length = status.optics->focal_length();
  return here;
}

/// Of all commands for the focus those that are no stops: one of these says where focus is to stand.
std::uint64_t Sendings(const rig::CommandCount& commands) {
  return commands.given - commands.stops;
}

rig::Preset OnlyAxis(Axis axis, const rig::Preset& preset) {
  rig::Preset one;
  one.label = preset.label;
  CopyAxis(axis, preset, one);
  return one;
}

/// What a run does.
struct RunOrder {
  rig::Preset to;
  bool homes = false;                ///< axes without their reference are homed first; else they do not move
  rig::CommandCount focus_commands;  ///< that had come when the run was decided on: one that came since goes first
};

Error NoReference(Axis axis) {
  return {Code::NotHomed, std::string(drivers::AxisName(axis)) + " has no reference: home it first (lensctl home)"};
}

/// On the worker's thread: to a preset.
class StayRun : public std::enable_shared_from_this<StayRun> {
 public:
  using Done = std::move_only_function<void(Result<rig::RecallOutcome>)>;
  StayRun(rig::Rig& rig, RunOrder order, std::shared_ptr<const std::atomic<bool>> over, Done done)
      : rig_(rig),
        order_(std::move(order)),
        over_(std::move(over)),
        mine_(rig.commands_given({})),
        done_(std::move(done)) {}

  /// Where one axis stands that is not known, none moves.
  void Begin() {
    const rig::Status status = rig_.GetStatus();
    if (status.focus_commands != order_.focus_commands) return done_(PassOn(TookOver()));
    if (status.held_until) return done_(Fail(Code::Busy, "corrections wait for the end of a hold"));
    if (auto busy = rig_.WhyNotAtRest()) return done_(PassOn(*std::move(busy)));
    for (const Axis axis : kGoingOrder) {
      if (!Moves(axis)) continue;
      if (auto lost = rig::WhyLost(axis, status.axes[axis])) return done_(PassOn(*std::move(lost)));
      if (!order_.homes && Unhomed(axis)) return done_(PassOn(NoReference(axis)));
    }
    Next();
  }

 private:
  static Error TookOver() { return {Code::Superseded, "another command for this lens took over"}; }
  bool Moves(Axis axis) const { return order_.to.native[axis] && rig_.lens().axes[axis]; }
  bool Unhomed(Axis axis) const {
    const auto now = rig_.GetStatus().axes[axis];
    return now && !now->homed && rig_.lens().axes[axis]->can_home;
  }

  std::optional<Error> WhyOver() const {
    const rig::CommandCount now = rig_.commands_given({});
    if (now.stops != mine_.stops) return Error{Code::Cancelled, "stopped"};
    if (now != mine_) return TookOver();
    if (*over_) return Error{Code::Leased, "the lens was leased meanwhile"};
    return std::nullopt;
  }

  void Next() {
    while (step_ < std::size(kGoingOrder) && !Moves(kGoingOrder[step_])) ++step_;
    if (step_ == std::size(kGoingOrder)) return done_(std::move(outcome_));
    if (auto over = WhyOver()) return done_(PassOn(*std::move(over)));
    const Axis axis = kGoingOrder[step_++];
    if (!Unhomed(axis)) return Recall(axis);
    rig_.Home(axis, [self = shared_from_this(), axis](const Result<rig::MoveOutcome>& homed) {
      if (!homed) return self->done_(PassOn(homed));
      if (!homed->reached) return self->done_(Fail(Code::NotHomed, "not homed: " + homed->reason));
      if (auto over = self->WhyOver()) return self->done_(PassOn(*std::move(over)));
      self->Recall(axis);
    });
    mine_ = rig_.commands_given({});
  }

  void Recall(Axis axis) {
    const auto end = [self = shared_from_this()](Result<rig::RecallOutcome> went) {
      if (!went) return self->done_(PassOn(went));
      self->outcome_.moves.insert(self->outcome_.moves.end(), went->moves.begin(), went->moves.end());
      self->outcome_.reached = self->outcome_.reached && went->reached;
      self->Next();
    };
    rig::RecallPreset(rig_, OnlyAxis(axis, order_.to), end);
    mine_ = rig_.commands_given({});
  }

  rig::Rig& rig_;
  const RunOrder order_;
  const std::shared_ptr<const std::atomic<bool>> over_;
  rig::CommandCount mine_;
  Done done_;
  std::size_t step_ = 0;
  rig::RecallOutcome outcome_{.moves = {}, .reached = true, .vergence_bound = {}, .native_bound = {}, .remark = {}};
};

/// Somebody else has decided where the lens goes: nothing is wrong with that.
bool GaveWay(const Error& error) {
  return error.code == Code::Superseded || error.code == Code::Cancelled || error.code == Code::Leased ||
         error.code == Code::Busy || error.code == Code::Disconnected;
}

/// The first move that missed; empty: none.
std::string WhyMissed(const rig::RecallOutcome& outcome) {
  const auto missed = std::ranges::find(outcome.moves, false, &rig::MoveOutcome::reached);
  if (missed == outcome.moves.end()) return "";
  return std::string(drivers::AxisName(missed->axis)) + ": " + missed->reason;
}

}  // namespace

/// What a run is for, and where it goes.
struct LensStay::Order {
  enum class By { Start, Keep } by = By::Start;
  rig::Preset to{};
  std::string where{};     ///< for people
  std::string external{};  ///< what another program has done, for people; empty: nothing
};

std::optional<rig::Preset> LastPlace(std::optional<rig::Preset> kept,
                                     const drivers::PerAxis<std::optional<Native>>& left, const rig::Rig& rig) {
  rig::Preset there;
  there.label = "last";
  there.native = left;
  there.approach_up = rig.approaches_up(Axis::Focus);
  for (const Axis axis : drivers::kAxes) {
    const auto& can = rig.lens().axes[axis];
    if (!can || !left[axis]) continue;
    const auto before = kept ? kept->native[axis] : std::nullopt;
    if (before && std::abs((*before - *left[axis]).value) <= can->resolution) continue;
    if (!kept) kept.emplace().label = there.label;
    CopyAxis(axis, there, *kept);
  }
  return kept;
}

LensStay::LensStay(ServedLens& lens) : lens_(lens) {}

std::string LensStay::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}

/// Said once in the log, and in the status for as long as it is so.
void LensStay::Complain(const std::string& problem) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(problem_, problem) != problem && !problem.empty())
    Log(Severity::Warning, Event::BroughtBack, problem, lens_.name());
}

/// A number that changes with each call that drives the lens or stops it.
std::uint64_t LensStay::Commands() const {
  return lens_.users().driving.noted() + lens_.users().stops.newest();
}

void LensStay::Opened(std::optional<rig::Preset> last, const drivers::Capabilities& lens) {
  under_way_.reset();
  for (const Axis axis : drivers::kAxes) homes_[axis] = lens.axes[axis] && lens.axes[axis]->can_home;
  if (!last_ && last) {
    last_ = std::move(last);
    KeepLast();
  }
  drive_ = last_ ? Drive::None : Drive::Asked;
  seen_.calls = Commands();
  seen_.sendings = 0;
  due_ = Commands();
  Look();
}

/// A command that a client gave while the device was away, or since it is back, goes first.
void LensStay::Back() {
  if (!lens_.users().driving.any()) due_ = Commands();
}

bool LensStay::MayMove() const {
  const LensUsers& users = lens_.users();
  return !lens_.WhyAbsent() && !users.stops.latched() && users.lease.now() == nullptr;
}

bool LensStay::AtRest() const {
  const rig::Status& now = lens_.status();
  const auto moving = [&](Axis axis) { return now.axes[axis] && now.axes[axis]->moving; };
  return now.activity.kind == rig::Activity::Kind::Idle && std::ranges::none_of(drivers::kAxes, moving);
}

/// Whether the preset that was missing has been saved meanwhile.
bool LensStay::NotMissingAnyMore() const {
  if (!missing_ || !lens_.presets()) return false;
  const auto& presets = *lens_.presets();
  return std::ranges::find(presets, lens_.config().start_preset, &rig::Preset::label) != presets.end();
}

/// Whether the configuration asks for any of this.
bool LensStay::Wanted() const {
  const LensConfig& config = lens_.config();
  return config.start_last || !config.start_preset.empty() || config.rig.axes[Axis::Focus].keep;
}

void LensStay::Look() {
  if (!Wanted()) return;
  if (under_way_) {
    if (!MayMove()) *under_way_ = true;
    return;
  }
  if (!lens_.status().connected || lens_.status().sampled_at == Instant{} || seen_.saying > 0) return;
  if (due_) return Start();
  if (NotMissingAnyMore()) {
    missing_ = false;
    Complain("");
  }
  Note();
  if (!under_way_ && drive_ == Drive::None) Keep();
}

void LensStay::Start() {
  const LensConfig& config = lens_.config();
  const bool configured = config.start_last || !config.start_preset.empty();
  if (!configured || Commands() != *due_ || lens_.users().stops.latched()) {
    due_.reset();
    return;
  }
  if (!MayMove() || !AtRest() || lens_.status().held_until) return;
  due_.reset();
  if (config.start_last) {
    if (last_) Go({.by = Order::By::Start, .to = *last_, .where = "where it was left"});
    return;
  }
  const std::string wanted = "start = \"preset:" + config.start_preset + "\": nothing was moved: ";
  if (!lens_.presets()) return Complain(wanted + lens_.presets().error().message);
  const auto found = std::ranges::find(*lens_.presets(), config.start_preset, &rig::Preset::label);
  missing_ = found == lens_.presets()->end();
  if (!missing_)
    return Go({.by = Order::By::Start, .to = *found, .where = "at preset \"" + config.start_preset + "\""});
  if (last_) last_->native[Axis::Focus].reset();  // nor is anything brought back there
  Complain(wanted + "there is no such preset; lensctl preset save " + lens_.name() + " \"" + config.start_preset +
           "\" makes one of where the lens stands");
}

/// Whether its position means something.
bool LensStay::Known(Axis axis) const {
  const auto& now = lens_.status().axes[axis];
  return now && !now->lost && (now->homed || !homes_[axis]);
}

/// Where a command has brought the lens is where it is to stay.
void LensStay::Note() {
  using Kind = rig::Activity::Kind;
  const rig::Status& now = lens_.status();
  const Kind kind = now.activity.kind;
  const bool sent = Sendings(now.focus_commands) != seen_.sendings;
  if (std::exchange(seen_.calls, Commands()) != Commands() && drive_ == Drive::None) drive_ = Drive::Asked;
  if (kind == Kind::Moving || kind == Kind::Homing || kind == Kind::Autofocus || kind == Kind::Backlash || sent) {
    drive_ = Drive::Driven;
  }
  if (drive_ == Drive::None || !AtRest()) return;
  seen_.sendings = Sendings(now.focus_commands);
  // What was to be said of the place before is over.
  if (std::exchange(drive_, Drive::None) == Drive::Driven && !missing_) Complain("");
  const auto& focus = now.axes[Axis::Focus];
  if (sent && focus && focus->lost && last_)
    last_->native[Axis::Focus].reset();  // it is elsewhere, and nobody knows where
  const auto left_by_command = [&](Axis axis) {
    const bool by_us = now.axes[axis]->moved_by_us && !now.axes[axis]->moved_by_another;
    return by_us || !last_ || (axis == Axis::Focus && sent);
  };
  drivers::PerAxis<bool> taken;
  for (const Axis axis : drivers::kAxes) taken[axis] = Known(axis) && left_by_command(axis);
  Take(taken);
}

/// These axes are to stay where they stand; of the others what was known before holds.
void LensStay::Take(const drivers::PerAxis<bool>& axes) {
  if (std::ranges::none_of(drivers::kAxes, [&](Axis axis) { return axes[axis]; })) return;
  const rig::Preset here = PlaceIn(lens_.status());
  rig::Preset next = last_.value_or(rig::Preset{});
  next.label = here.label;
  for (const Axis axis : drivers::kAxes) {
    if (axes[axis]) CopyAxis(axis, here, next);
  }
  next.saved = StateFileMoment();
  const bool same = last_ && last_->native == next.native && last_->vergence == next.vergence;
  last_ = std::move(next);
  if (!same) KeepLast();
}

void LensStay::KeepLast() {
  if (!lens_.config().start_last || !last_) return;
  KeepStateFile(lens_, LastFile(lens_.config(), lens_.surroundings().state), rig::PresetsText({*last_}),
                "where the lens was left", [](const Result<void>&) {});
}

void LensStay::Said(Axis axis, bool changed) {
  --seen_.saying;
  seen_.sendings = Sendings(lens_.status().focus_commands);
  if (!changed || !Wanted()) return;
  if (!missing_) Complain("");
  drivers::PerAxis<bool> said;
  said[axis] = Known(axis);
  Take(said);
}

void LensStay::Keep() {
  const auto& focus = lens_.status().axes[Axis::Focus];
  if (!lens_.config().rig.axes[Axis::Focus].keep || !focus || !last_ || !last_->native[Axis::Focus]) return;
  if (!Known(Axis::Focus)) {
    const Error why = rig::WhyLost(Axis::Focus, focus).value_or(NoReference(Axis::Focus));
    if (problem().empty()) Complain("keep: focus is not brought back: " + why.message);
    return;
  }
  const bool automatic = focus->fault == drivers::kOwnAutofocusOn;
  // Just after a motion of ours, a motion by another program may be taken for ours: so the position decides.
  const double off = std::abs((focus->position - *last_->native[Axis::Focus]).value);
  if (!automatic && off <= (focus->moved_by_another ? 0.0 : focus->bound.value)) {
    // A try that failed while the other program went on may have brought it there all the same.
    if (focus->fault.empty() && problem().starts_with("keep: ")) Complain("");
    return;
  }
  if ((!automatic && !focus->fault.empty()) || !AtRest() || !MayMove() || lens_.status().held_until) return;
  const Instant now = lens_.surroundings().clock.Now();
  if (returned_at_ != Instant{} && now - returned_at_ < kBetweenReturns) return;
  returned_at_ = now;
  const std::string what = automatic ? std::string(drivers::kOwnAutofocusOn)
                                     : "another program has moved it to " + Short(focus->position.value, 6);
  Go({.by = Order::By::Keep,
      .to = OnlyAxis(Axis::Focus, *last_),
      .where = "where it is kept",
      .external = "focus: external: " + what});
}

void LensStay::Go(Order order) {
  under_way_ = std::make_shared<std::atomic<bool>>(false);
  const RunOrder run{
      .to = order.to, .homes = order.by == Order::By::Start, .focus_commands = lens_.status().focus_commands};
  const auto go = [run, over = under_way_, &history = lens_.users().history](rig::Rig& rig, auto done) {
    history.Disown(rig);
    std::make_shared<StayRun>(rig, run, over, std::move(done))->Begin();
  };
  lens_.Ask<rig::RecallOutcome>(
      go, [this, order = std::move(order), mine = under_way_](const Result<rig::RecallOutcome>& outcome) {
        if (under_way_ == mine) Ended(order, outcome);
      });
}

void LensStay::Ended(const Order& order, const Result<rig::RecallOutcome>& outcome) {
  under_way_.reset();
  const bool start = order.by == Order::By::Start;
  const std::string what = start ? "start: " : "keep: ";
  if (outcome) lens_.watchers().AnnounceMoves(lens_, MovesJson(lens_.name(), outcome->moves));
  if (outcome && !order.external.empty()) {
    Log(Severity::Info, Event::MovedExternally, order.external + "; it is brought back",
        {.lens = lens_.name(), .axis = "focus"});
  }
  if (!outcome && GaveWay(outcome.error())) {
    const Code code = outcome.error().code;
    if (code == Code::Superseded || code == Code::Cancelled) drive_ = Drive::Driven;
    return Log(Severity::Info, Event::BroughtBack, what + "given up: " + outcome.error().message, lens_.name());
  }
  seen_.sendings = Sendings(lens_.status().focus_commands);
  const std::string missed = outcome ? WhyMissed(*outcome) : outcome.error().message;
  if (!missed.empty()) return Complain(what + "the lens is not " + order.where + ": " + missed);
  if (!missing_) Complain("");
  for (const rig::MoveOutcome& move : outcome->moves) {
    if (!start && last_) last_->native[move.axis] = move.position;
  }
  if (!start) return;
  Log(Severity::Info, Event::BroughtBack, what + "the lens is " + order.where, lens_.name());
  if (!last_) last_ = order.to;
  for (const Axis axis : drivers::kAxes) {
    if (order.to.native[axis]) CopyAxis(axis, order.to, *last_);
  }
  for (const rig::MoveOutcome& move : outcome->moves) last_->native[move.axis] = move.position;
  drive_ = Drive::None;
}

}  // namespace lensd::daemon
