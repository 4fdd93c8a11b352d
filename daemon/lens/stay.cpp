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

rig::Preset OnlyAxis(Axis axis, const rig::Preset& preset) {
  rig::Preset one;
  one.label = preset.label;
  CopyAxis(axis, preset, one);
  return one;
}

/// On the worker's thread: to a preset, each axis homed first where that is needed.
class StayRun : public std::enable_shared_from_this<StayRun> {
 public:
  using Done = std::move_only_function<void(Result<rig::RecallOutcome>)>;
  StayRun(rig::Rig& rig, rig::Preset preset, std::shared_ptr<const std::atomic<bool>> over, Done done)
      : rig_(rig),
        preset_(std::move(preset)),
        over_(std::move(over)),
        mine_(rig.commands_given({})),
        done_(std::move(done)) {}

  /// Where one axis stands that is not known, none moves.
  void Begin() {
    const rig::Status status = rig_.GetStatus();
    if (auto busy = rig_.WhyNotAtRest()) return done_(PassOn(*std::move(busy)));
    for (const Axis axis : kGoingOrder) {
      if (!Moves(axis)) continue;
      if (auto lost = rig::WhyLost(axis, status.axes[axis])) return done_(PassOn(*std::move(lost)));
    }
    Next();
  }

 private:
  bool Moves(Axis axis) const { return preset_.native[axis] && rig_.lens().axes[axis]; }

  std::optional<Error> WhyOver() const {
    const rig::CommandCount now = rig_.commands_given({});
    if (now.stops != mine_.stops) return Error{Code::Cancelled, "stopped"};
    if (now != mine_) return Error{Code::Superseded, "another command for this lens took over"};
    if (*over_) return Error{Code::Leased, "the lens was leased meanwhile"};
    return std::nullopt;
  }

  void Next() {
    while (step_ < std::size(kGoingOrder) && !Moves(kGoingOrder[step_])) ++step_;
    if (step_ == std::size(kGoingOrder)) return done_(std::move(outcome_));
    if (auto over = WhyOver()) return done_(PassOn(*std::move(over)));
    const Axis axis = kGoingOrder[step_++];
    const auto now = rig_.GetStatus().axes[axis];
    if (!now || now->homed || !rig_.lens().axes[axis]->can_home) return Recall(axis);
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
    rig::RecallPreset(rig_, OnlyAxis(axis, preset_), end);
    mine_ = rig_.commands_given({});
  }

  rig::Rig& rig_;
  const rig::Preset preset_;
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
  std::string where{};  ///< for people
};

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

void LensStay::Opened(std::optional<rig::Preset> last) {
  under_way_.reset();
  if (!last_) last_ = std::move(last);
  moved_ = !last_;
  taking_ = false;
  seen_ = Commands();
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
  if (!lens_.status().connected) return;
  if (due_) return Start();
  if (NotMissingAnyMore()) {
    missing_ = false;
    Complain("");
  }
  Note();
  if (!under_way_ && !moved_ && !taking_) Keep();
}

void LensStay::Start() {
  const LensConfig& config = lens_.config();
  const bool configured = config.start_last || !config.start_preset.empty();
  if (!configured || Commands() != *due_ || lens_.users().stops.latched()) {
    due_.reset();
    return;
  }
  if (!MayMove() || !AtRest()) return;
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
  Complain(wanted + "there is no such preset; lensctl preset save " + lens_.name() + " \"" + config.start_preset +
           "\" makes one of where the lens stands");
}

/// Where a command has brought the lens is where it is to stay.
void LensStay::Note() {
  using Kind = rig::Activity::Kind;
  const Kind kind = lens_.status().activity.kind;
  if (std::exchange(seen_, Commands()) != Commands()) moved_ = true;
  if (kind == Kind::Moving || kind == Kind::Homing || kind == Kind::Autofocus || kind == Kind::Backlash) moved_ = true;
  if (!moved_ || taking_ || !AtRest()) return;
  moved_ = false;
  taking_ = true;
  lens_.Ask<rig::Preset>([](rig::Rig& rig, auto done) { done(rig::TakePreset(rig, "last")); },
                         [this](const Result<rig::Preset>& here) {
                           taking_ = false;
                           if (here) return Take(*here);
                           // Where clients have left it is not known then, and what was known before is out of date.
                           if (here.error().code != Code::Busy) last_.reset();
                           moved_ = moved_ || here.error().code == Code::Busy;
                         });
}

/// Of an axis that no command of a client has moved, or another program since, what was known before stays.
void LensStay::Take(const rig::Preset& here) {
  if (moved_) return;  // by a command that came meanwhile
  rig::Preset next = last_.value_or(here);
  for (const Axis axis : drivers::kAxes) {
    const auto& now = lens_.status().axes[axis];
    if (now && now->moved_by_us && !now->moved_by_another) CopyAxis(axis, here, next);
  }
  next.saved = StateFileMoment();
  const bool same = last_ && last_->native == next.native && last_->vergence == next.vergence;
  last_ = std::move(next);
  if (!lens_.config().start_last || same) return;
  KeepStateFile(lens_, LastFile(lens_.config(), lens_.surroundings().state), rig::PresetsText({*last_}),
                "where the lens was left", [](const Result<void>&) {});
}

void LensStay::Keep() {
  const auto& focus = lens_.status().axes[Axis::Focus];
  if (!lens_.config().rig.axes[Axis::Focus].keep || !focus || !last_ || !last_->native[Axis::Focus]) return;
  const bool automatic = focus->fault == drivers::kOwnAutofocusOn;
  // Just after a motion of ours, a motion by another program may be taken for ours: so the position decides.
  const double off = std::abs((focus->position - *last_->native[Axis::Focus]).value);
  if (!automatic && off <= (focus->moved_by_another ? 0.0 : focus->bound.value)) {
    // A try that failed while the other program went on may have brought it there all the same.
    if (focus->fault.empty() && problem().starts_with("keep: ")) Complain("");
    return;
  }
  if ((!automatic && !focus->fault.empty()) || !AtRest() || !MayMove()) return;
  const Instant now = lens_.surroundings().clock.Now();
  if (returned_at_ != Instant{} && now - returned_at_ < kBetweenReturns) return;
  returned_at_ = now;
  const std::string what = automatic ? std::string(drivers::kOwnAutofocusOn)
                                     : "another program has moved it to " + Short(focus->position.value, 6);
  Log(Severity::Info, Event::MovedExternally, "focus: external: " + what + "; it is brought back",
      {.lens = lens_.name(), .axis = "focus"});
  Go({.by = Order::By::Keep, .to = OnlyAxis(Axis::Focus, *last_), .where = "where it is kept"});
}

void LensStay::Go(Order order) {
  under_way_ = std::make_shared<std::atomic<bool>>(false);
  const auto go = [to = order.to, over = under_way_](rig::Rig& rig, auto done) {
    std::make_shared<StayRun>(rig, to, over, std::move(done))->Begin();
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
  if (!outcome && GaveWay(outcome.error())) {
    const Code code = outcome.error().code;
    moved_ = moved_ || code == Code::Superseded || code == Code::Cancelled;
    return Log(Severity::Info, Event::BroughtBack, what + "given up: " + outcome.error().message, lens_.name());
  }
  const std::string missed = outcome ? WhyMissed(*outcome) : outcome.error().message;
  if (!missed.empty()) return Complain(what + "the lens is not " + order.where + ": " + missed);
  Complain("");
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
  moved_ = false;
}

}  // namespace lensd::daemon
