// How the parts of a rig work together. A command acts on an axis at once: it displaces the motion before, and begins
// its own. Step() then does the rest: the lens is read, each motion judges the reading and commands the motor, frames
// are fetched and handed out with the readings around them, and last of all those who wait are answered.
#include "rig/impl.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "base/quantity_text.h"
#include "rig/autofocus/conditioned_search.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr Duration kMotionPeriod = std::chrono::milliseconds(2);  ///< between readings while something happens

bool Names(const std::vector<Axis>& axes, Axis axis) {
  return axes.empty() || std::ranges::find(axes, axis) != axes.end();
}

/// The value of a target in the unit of an axis' limits (OpticalState::ReachOf): lengths of the lens in mm, not in m.
double InUnitOf(const Target& target, const std::string& unit) {
  const bool length = target.kind == Target::Kind::Extension || target.kind == Target::Kind::FocalLength;
  return unit == "mm" && length ? 1e3 * target.value : target.value;
}

/// What was asked for, in the unit of the axis' limits (OpticalState::ReachOf).
std::string Asked(const Target& target, const std::string& unit) {
  using Kind = Target::Kind;
  const std::string of = target.kind == Kind::Extension     ? " of extension"
                         : target.kind == Kind::FocalLength ? " of focal length"
                         : target.kind == Kind::TowardNear  ? " toward near"
                                                            : "";
  if (unit == "fNumber") return "f/" + Short(target.value, 6);
  return Short(InUnitOf(target, unit), 6) + " " + unit + of;
}

/// The end of a range in so many digits, rounded to the inside of the range: whoever types it again is not refused.
std::string InsideText(double end, int digits, bool is_minimum) {
  const auto beyond = [&](double value) {
    const double by = is_minimum ? end - value : value - end;
    return by > 1e-12 * std::abs(end);
  };
  const double rounded = std::strtod(Short(end, digits).c_str(), nullptr);
  if (!beyond(rounded)) return Short(end, digits);
  const double last_digit = std::pow(10.0, std::floor(std::log10(std::abs(end))) + 1.0 - digits);
  return Short(rounded + (is_minimum ? last_digit : -last_digit), digits);
}

/// "0.943 m to infinity", in as many digits as tell the end that `wish` lies beyond from the wish. Six are shown at
/// most: where they are too few, the difference is added.
std::string ReachText(const ErrorFacts& reach, double wish) {
  constexpr int kFewestDigits = 4, kMostDigits = 6;
  const std::string before = reach.unit == "fNumber" ? "f/" : "", after = before.empty() ? " " + reach.unit : "";
  const std::string typed = Short(wish, kMostDigits);
  const auto passed = reach.maximum && wish > *reach.maximum ? reach.maximum : reach.minimum;
  int digits = kFewestDigits;
  while (passed && digits < kMostDigits && Short(*passed, digits) == typed) ++digits;
  const auto text = [&](const std::optional<double>& end) {
    return end ? before + InsideText(*end, digits, end == reach.minimum) + after : "infinity";
  };
  std::string reached = text(reach.minimum) + " to " + text(reach.maximum);
  if (passed && Short(*passed, digits) == typed) {
    const std::string beyond = Short(std::abs(wish - *passed), 2);
    reached += ", and the wish lies " + (beyond == "0" ? "less than 0.000001" : beyond) + after + " beyond that";
  }
  return reached;
}

}  // namespace

AxisControllers Rig::Impl::Controllers(const RigConfig& config, drivers::Lens& lens, RememberedPositions& remembered,
                                       const Clock& clock) {
  AxisControllers axes;
  for (const Axis axis : drivers::kAxes) {
    const auto& can = lens.capabilities().axes[axis];
    if (can) axes[axis] = std::make_unique<AxisController>(axis, *can, config.axes[axis], lens, remembered, clock);
  }
  return axes;
}

Rig::Impl::Impl(const RigConfig& config, drivers::Device opened, std::optional<OpticsTable> table,
                const Clock& the_clock, std::shared_ptr<const Calibration> calibration,
                std::unique_ptr<PositionMemory> memory)
    : device(std::move(opened)),
      clock(the_clock),
      remembered(std::move(memory)),
      axes(Controllers(config, *device.lens, remembered, clock)),
      reader(*device.lens, axes, config, clock),
      optics(config, axes, std::move(table), std::move(calibration)),
      frames(device.camera.get(), axes, reader, optics, replies),
      autofocus({device.camera.get(), axes, reader, optics, frames, replies, clock, held_until}) {
  ReadLens();
}

/// No caller is left waiting for an answer that will never come.
Rig::Impl::~Impl() {
  do {
    commands.since_step = false;
    FailAll(Error{Code::Cancelled, "the lens was closed"}, Lens::Closed);
    RunReplies();
  } while (commands.since_step);
}

// ---- a step -------------------------------------------------------------------------------------------------------

Instant Rig::Impl::Step(Instant now) {
  commands.since_step = false;
  if (replies.TakeHurry()) {
    RunReplies();
    return now;
  }
  frames.Poll(now, autofocus.uses_camera());
  if (WantsReading(now)) ReadLens();
  AdvanceMotions();
  frames.Serve(clock.Now());
  autofocus.Serve();
  FollowTemperature();
  RunReplies();
  return NextStep(now);
}

/// A lens that does not answer is asked again now and then, or because a command needs it.
bool Rig::Impl::WantsReading(Instant now) const {
  const bool asked = frames.any() || frames.has_frame() || autofocus.judges() ||
                     std::ranges::any_of(drivers::kAxes, [&](Axis axis) { return axes[axis] && axes[axis]->motion(); });
  return asked || (reader.Moving() && !reader.problem()) || now >= reader.next_read();
}

void Rig::Impl::ReadLens() {
  if (const auto lost = reader.Read()) return FailAll(*lost, Lens::Lost);
  optics.NoteConditions(reader.temperature());
}

void Rig::Impl::AdvanceMotions() {
  if (!reader.connected()) return;
  for (const Axis axis : drivers::kAxes) {
    if (!axes[axis]) continue;
    auto end = axes[axis]->Advance(*reader.sampled_at());
    if (!end) continue;
    if (!*end && end->error().code == Code::Disconnected) reader.NoteBrokenLink();
    EndMotion(axis, *std::move(end));
  }
}

/// While nothing else goes on, focus goes after the temperature, once that is worth a move.
void Rig::Impl::FollowTemperature() {
  if (reader.problem() || autofocus.running() || frames.any() || reader.Moving()) return;
  if (clock.Now() < held_until) return;
  const auto wanted = optics.Drifted();
  if (!wanted) return;
  const Target target{.kind = Target::Kind::Native, .value = wanted->value, .from = {}, .take_up = {}};
  // To follow is not to be brought elsewhere.
  Move(Axis::Focus, target, [this, held = optics.held()](const Result<MoveOutcome>& moved) {
    if (moved && moved->reached) optics.Hold(held);
  });
}

/// A reply may command the rig anew.
void Rig::Impl::RunReplies() {
  for (autofocus.Tidy(); !replies.empty(); autofocus.Tidy()) replies.Take()();
}

Instant Rig::Impl::NextStep(Instant now) const {
  if (commands.since_step) return now;
  if (reader.problem() && !frames.any() && !autofocus.judges()) return reader.next_read();
  const auto steady = reader.SteadySince();
  if (!steady || frames.has_frame() || autofocus.watches_external()) {
    Instant next = now + kMotionPeriod;
    for (const Axis axis : drivers::kAxes) {
      const auto part = axes[axis] && axes[axis]->motion() ? axes[axis]->motion()->next_part() : std::nullopt;
      if (part && *part > now) next = std::min(next, *part);  // one that is due and waits is tried at the next reading
    }
    return next;
  }
  const Instant held = held_until > now ? held_until : reader.next_read();  // its end is told
  const Instant viewed = std::min({reader.next_read(), held, frames.NextView(now).value_or(reader.next_read())});
  return frames.any() ? std::min(viewed, frames.NextPoll(now, *steady)) : viewed;
}

// ---- commands -----------------------------------------------------------------------------------------------------

/// What is out of reach is told with what is in it.
Result<Native> Rig::Impl::Resolve(Axis axis, const Target& target) const {
  if (!axes[axis]) return Fail(Code::Unsupported, "this lens has no motorised " + std::string(AxisName(axis)));
  if (auto lost = WhyMeaningless(axis, target)) return PassOn(*std::move(lost));
  auto native = InReach(axis, target);
  if (native || native.error().code != Code::OutOfRange) return native;
  return Fail(Code::OutOfRange, native.error().message, optics.ReachOf(axis, target));
}

Result<Native> Rig::Impl::InReach(Axis axis, const Target& target) const {
  using Kind = Target::Kind;
  if (std::isnan(target.value)) return Fail(Code::InvalidArgument, "a target must be a number");
  Result<Native> aimed = Native{target.value};
  if (target.kind == Kind::TowardNear && axis != Axis::Focus) {
    return Fail(Code::InvalidArgument, "only focus has a near and a far side");
  }
  if (target.kind == Kind::NativeRelative || target.kind == Kind::TowardNear) {
    const FocusDirection& direction = axes[axis]->setup().direction;
    if (target.kind == Kind::TowardNear && !direction.direction) {
      return PassOn(DirectionUnknown("focus cannot be sent nearer or farther"));
    }
    const bool backward = target.kind == Kind::TowardNear && !direction.near_positive();
    aimed = axes[axis]->Ahead(backward ? -target.value : target.value);
  } else if (target.kind != Kind::Native) {
    aimed = optics.Aim(axis, target);
  }
  if (!aimed) return aimed;
  const double place = aimed->value;
  if (axis == Axis::Filter && std::isfinite(place) && place != std::round(place)) {
    // The place next to it is another filter.
    const AxisSetup& wheel = axes[axis]->setup();
    return Fail(Code::OutOfRange, "filter stands in whole places, " + Short(wheel.minimum.value) + " to " +
                                      Short(wheel.maximum.value) + ": there is none at " + Short(place));
  }
  auto landed = axes[axis]->Land(*aimed);
  if (landed) return landed;
  const ErrorFacts reach = optics.ReachOf(axis, target);
  return Fail(Code::OutOfRange, Asked(target, reach.unit) + " is outside what " + reach.axis +
                                    " may reach: " + ReachText(reach, InUnitOf(target, reach.unit)));
}

void Rig::Impl::Move(Axis axis, const Target& target, MoveCallback done) {
  auto native = Resolve(axis, target);
  if (native) {
    if (auto unknown = axes[axis]->WhyUnknown()) native = PassOn(*std::move(unknown));
  }
  if (!native && axis == Axis::Focus) ++commands.refused;
  if (!native) return replies.Add(std::move(done), Result<MoveOutcome>(PassOn(native)));
  Disturb(axis);
  axes[axis]->Move(*native, target.take_up, std::move(done));
}

void Rig::Impl::Home(Axis axis, MoveCallback done) {
  if (!axes[axis] || !axes[axis]->setup().can.can_home) {
    const std::string name(AxisName(axis));
    return replies.Add(
        std::move(done),
        Result<MoveOutcome>(Fail(Code::Unsupported, "this lens has no " + name + " that can search a reference")));
  }
  Disturb(axis);
  axes[axis]->Start({.target = std::nullopt, .done = std::move(done)});
}

/// The caller of a motion that cannot be stopped hears of its end when it rests.
void Rig::Impl::Stop(const std::vector<Axis>& named, StopCallback done) {
  const Error cancelled{Code::Cancelled, "stopped"};
  const bool ends_search = autofocus.running();
  Result<void> answer;
  for (const Axis axis : drivers::kAxes) {
    if (!axes[axis] || !(Names(named, axis) || (ends_search && axis == Axis::Focus))) continue;
    const auto stopped = axes[axis]->Stop();
    if (!stopped && answer) answer = stopped;
    if (!stopped && stopped.error().code == Code::Disconnected) reader.NoteBrokenLink();
    if (!axes[axis]->runs_out()) EndMotion(axis, PassOn(cancelled));
  }
  autofocus.Cancel(cancelled);
  replies.Add(std::move(done), std::move(answer));
  replies.Hurry();  // a reading may take longer than the stop did
}

void Rig::Impl::ResetFaults(const std::vector<Axis>& named, StopCallback done) {
  Result<void> answer;
  for (const Axis axis : drivers::kAxes) {
    if (!axes[axis] || !Names(named, axis)) continue;
    const auto reset = device.lens->ResetFault(axis);
    const bool no_matter = !reset && reset.error().code == Code::Unsupported && named.empty();
    if (!reset && !no_matter && answer) answer = reset;
  }
  reader.ReadSoon();
  replies.Add(std::move(done), std::move(answer));
}

/// From here on the ends of its range are native positions, wherever the lens goes.
Result<void> Rig::Impl::PinRange(AutofocusRequest& request) const {
  if (!request.range) return {};
  for (auto [end, name] : {std::pair(&request.range->from, "range.from"), std::pair(&request.range->to, "range.to")}) {
    auto native = Resolve(Axis::Focus, *end);
    if (!native) {
      ErrorFacts facts = native.error().facts ? *native.error().facts : ErrorFacts{};
      facts.parameter = name;
      return Fail(native.error().code, "the range: " + native.error().message, std::move(facts));
    }
    *end = {.kind = Target::Kind::Native, .value = native->value, .from = {}, .take_up = {}};
  }
  return {};
}

void Rig::Impl::Autofocus(AutofocusRequest request, ProgressCallback progress, AutofocusCallback done) {
  const auto refuse = [&](const Error& why) {
    ++commands.refused;
    replies.Add(std::move(done), Result<AutofocusOutcome>(PassOn(why)));
  };
  if (auto pinned = PinRange(request); !pinned) return refuse(pinned.error());
  if (auto judged = CheckPolicy(request); !judged) return refuse(judged.error());
  auto search = autofocus.SearchFor(request);
  if (!search) return refuse(search.error());
  if (request.conditions) {
    if (auto possible = ConditionedSearch::Check(*this, request); !possible) return refuse(possible.error());
    return ConditionedSearch::Begin(*this, std::move(request), std::move(progress), std::move(done));
  }
  const bool focus_under_way = axes[Axis::Focus]->motion() != nullptr;
  Disturb(Axis::Focus);
  if (focus_under_way) (void)axes[Axis::Focus]->Halt();
  autofocus.Begin(std::move(request), *std::move(search), std::move(progress), std::move(done));
}

// ---- who is displaced ---------------------------------------------------------------------------------------------

/// A new command for `axis` displaces its motion and any autofocus.
void Rig::Impl::Disturb(Axis axis) {
  const Error superseded{Code::Superseded, "a newer command for this lens took over"};
  if (autofocus.running()) {
    const bool focus_under_way = axis != Axis::Focus && axes[Axis::Focus]->motion() != nullptr;
    autofocus.Cancel(superseded);
    if (focus_under_way) (void)axes[Axis::Focus]->Halt();
  }
  EndMotion(axis, PassOn(superseded));
}

void Rig::Impl::EndMotion(Axis axis, Result<MoveOutcome> end) {
  const bool reached = end && end->reached;
  const bool taken_away = end && end->moved_by_another;
  auto motion = axes[axis]->End(reached      ? AxisController::Outcome::Reached
                                : taken_away ? AxisController::Outcome::TakenAway
                                             : AxisController::Outcome::CutShort);
  if (!motion) return;
  if (end) optics.Describe(*end);
  if (reached) SayWhetherKept(axis, *end);
  if (axis == Axis::Focus && reached) optics.Hold(end->extension);
  replies.Add(std::move(motion->done), std::move(end));
}

void Rig::Impl::SayWhetherKept(Axis axis, MoveOutcome& outcome) const {
  if (!remembered.keeps()) return;
  const auto& unkept = remembered.unkept(axis);
  outcome.kept = !unkept;
  if (!unkept) return;
  if (outcome.cause == MoveCause::None) outcome.cause = MoveCause::NotKept;
  outcome.reason +=
      (outcome.reason.empty() ? "" : "; ") + std::string("its position is not on disk: ") + unkept->reason;
}

void Rig::Impl::FailAll(const Error& error, Lens lens) {
  autofocus.Cancel(error);
  for (const Axis axis : drivers::kAxes) {
    if (axes[axis]) EndMotion(axis, PassOn(lens == Lens::Lost ? axes[axis]->GivenUp(error) : error));
  }
  frames.FailAll(error);
}

// ---- status -------------------------------------------------------------------------------------------------------

Status Rig::Impl::GetStatus() const {
  const auto& problem = reader.problem();
  Status status;
  status.connected = reader.connected();
  if (problem) status.problem = problem->message;
  status.wrong_device = problem && problem->code == Code::WrongDevice;
  status.has_camera = device.camera != nullptr;
  if (device.camera) status.counters = device.camera->counters();
  status.counters.bus_errors += device.lens->bus_errors();
  status.streaming = frames.streaming();
  status.activity = CurrentActivity();
  if (clock.Now() < held_until) status.held_until = held_until;
  const CommandCount& focus = commands.of[Axis::Focus];
  if (axes[Axis::Focus]) status.direction = axes[Axis::Focus]->setup().direction;
  status.focus_commands = {focus.given + commands.searches - commands.refused, focus.stops};
  if (!reader.sampled_at()) return status;
  status.sampled_at = *reader.sampled_at();
  reader.Describe(status);
  for (const Axis axis : drivers::kAxes) {
    const auto& unkept = remembered.unkept(axis);
    if (unkept && (!status.unkept || unkept->since < status.unkept->since)) status.unkept = unkept;
    if (!axes[axis]) continue;
    status.limits_set += axes[axis]->setup().limits_set;
    if (!axes[axis]->state()) continue;
    status.axes[axis] = axes[axis]->Describe(problem.has_value());
    if (remembered.InMotion(axis)) status.in_motion_on_disk = true;
  }
  optics.Describe(status, problem.has_value());
  return status;
}

Activity Rig::Impl::CurrentActivity() const {
  if (const auto occupied = procedure.lock()) return *occupied;
  if (autofocus.running()) return autofocus.activity();
  if (const auto axis = InMotion())
    return {axes[*axis]->motion()->homing() ? Activity::Kind::Homing : Activity::Kind::Moving, 0, 0};
  if (frames.any()) return {Activity::Kind::Snapshot, 0, 0};
  return {};
}

/// The first axis that was sent somewhere.
std::optional<Axis> Rig::Impl::InMotion() const {
  const auto* const found =
      std::ranges::find_if(drivers::kAxes, [&](Axis axis) { return axes[axis] && axes[axis]->motion() != nullptr; });
  return found == drivers::kAxes.end() ? std::nullopt : std::optional(*found);
}

}  // namespace lensd::rig
