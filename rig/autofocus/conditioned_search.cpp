// What is set is noted beside what it was, and brought back in the reverse order; the exposure first, because nothing
// moves for it. A step that fails ends the way there and begins the way back, so that there is one way out of every
// end: answer, refusal, stop, a newer command, a lens that is gone.
#include "rig/autofocus/conditioned_search.h"

#include <cmath>
#include <utility>

#include "base/quantity_text.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr const char* kStopped = "stopped";
constexpr Axis kThere[] = {Axis::Filter, Axis::Iris};
constexpr Axis kBack[] = {Axis::Iris, Axis::Filter};

std::string NameOf(Axis axis) {
  return axis == Axis::Iris ? "the iris" : "the filter";
}

std::optional<Target> WantedOf(const SearchConditions& conditions, Axis axis) {
  using Kind = Target::Kind;
  if (axis == Axis::Iris && conditions.f_number) {
    return Target{.kind = Kind::FNumber, .value = conditions.f_number->value, .from = {}, .take_up = {}};
  }
  if (axis == Axis::Filter && conditions.filter) {
    return Target{.kind = Kind::Native, .value = conditions.filter->value, .from = {}, .take_up = {}};
  }
  return std::nullopt;
}

Error About(const char* parameter, const Error& error) {
  ErrorFacts facts = error.facts ? *error.facts : ErrorFacts{};
  facts.parameter = parameter;
  return Fail(error.code, "the search's conditions: " + error.message, std::move(facts)).error();
}

}  // namespace

// ---- whether ------------------------------------------------------------------------------------------------------

Result<void> ConditionedSearch::Check(const Rig::Impl& rig, const AutofocusRequest& request) {
  const SearchConditions& conditions = *request.conditions;
  if (request.track || request.outside) {
    return Fail(Code::InvalidArgument, "conditions are of one search with the lens' own camera: not of tracking",
                {.parameter = "conditions"});
  }
  for (const Axis axis : kThere) {
    const auto wanted = WantedOf(conditions, axis);
    const char* const parameter = axis == Axis::Iris ? "conditions.fNumber" : "conditions.filterPosition";
    if (!wanted) continue;
    if (auto possible = rig.Resolve(axis, *wanted); !possible) return PassOn(About(parameter, possible.error()));
    if (auto unknown = rig.axes[axis]->WhyUnknown()) return PassOn(About(parameter, *unknown));
  }
  const drivers::ExposureState& exposure = conditions.exposure;
  if (!exposure.exposure && !exposure.gain) return {};
  const char* const parameter = exposure.exposure ? "conditions.exposureMs" : "conditions.gain";
  drivers::Camera* const camera = rig.device.camera.get();
  if (camera == nullptr) return Fail(Code::Unsupported, "this lens has no camera", {.parameter = parameter});
  if (auto possible = camera->Check(exposure); !possible) return PassOn(About(parameter, possible.error()));
  const auto now = camera->ReadExposure();
  if (!now) return PassOn(now);
  if ((exposure.exposure && !now->exposure) || (exposure.gain && !now->gain)) {
    return Fail(Code::Unsupported, "this camera does not report its exposure, so it could not be restored",
                {.parameter = parameter});
  }
  return {};
}

// ---- there --------------------------------------------------------------------------------------------------------

void ConditionedSearch::Begin(Rig::Impl& rig, AutofocusRequest request, ProgressCallback progress,
                              AutofocusCallback done) {
  const auto search =
      std::make_shared<ConditionedSearch>(rig, std::move(request), std::move(progress), std::move(done));
  if (rig.procedure.expired()) rig.procedure = search->activity_;
  const auto exposed = search->Expose(search->request_.conditions->exposure);
  exposed ? search->Prepare() : search->Restore(PassOn(exposed));
}

ConditionedSearch::ConditionedSearch(Rig::Impl& rig, AutofocusRequest request, ProgressCallback progress,
                                     AutofocusCallback done)
    : rig_(rig),
      request_(std::move(request)),
      progress_(progress ? std::make_shared<ProgressCallback>(std::move(progress)) : nullptr),
      done_(std::move(done)),
      activity_(std::make_shared<Activity>(Activity{Activity::Kind::Autofocus, 0, 0})) {
  begun_ = {.at = rig.clock.Now(),
            .commands = rig.commands.all.given,
            .focus_commands = rig.commands.of[Axis::Focus].given,
            .stops = rig.commands.all.stops,
            .motions = rig.axes[Axis::Focus]->commands()};
  if (rig.device.camera) exposure_before_ = rig.device.camera->ReadExposure().value_or(drivers::ExposureState{});
  under_.work = Here();
  for (const Axis axis : kThere) {
    Part& part = parts_[axis];
    part.wanted = WantedOf(*request_.conditions, axis);
    if (!part.wanted) continue;
    const AxisController& controller = *rig.axes[axis];
    part.before = controller.target().value_or(controller.state() ? controller.state()->position : Native{});
    const bool known = axis == Axis::Iris && under_.work.f_number;
    part.was = known ? "f/" + Short(under_.work.f_number->value) : "position " + Short(part.before.value, 6);
  }
}

FocusConditions ConditionedSearch::Here() const {
  FocusConditions here;
  here.f_number = rig_.optics.f_number();
  const auto& filter = rig_.axes[Axis::Filter];
  if (filter && filter->state()) here.filter = filter->state()->position;
  const OpticsTable* optics = rig_.optics.table();
  if (optics != nullptr && optics->has_zoom()) here.focal_length = optics->focal_length();
  return here;
}

Result<void> ConditionedSearch::Expose(const drivers::ExposureState& exposure) {
  drivers::Camera* const camera = rig_.device.camera.get();
  if (exposure.exposure) {
    if (auto set = camera->SetExposure(*exposure.exposure); !set) return set;
  }
  if (exposure.gain) {
    if (auto set = camera->SetGain(*exposure.gain); !set) return set;
  }
  if (exposure.exposure || exposure.gain) under_.exposure = camera->ReadExposure().value_or(drivers::ExposureState{});
  return {};
}

void ConditionedSearch::Prepare() {
  for (const Axis axis : kThere) {
    Part& part = parts_[axis];
    if (!part.wanted || part.set) continue;
    part.set = true;
    part.commands = rig_.commands.of[axis].given;
    return rig_.Move(axis, *part.wanted,
                     [self = shared_from_this(), axis](Result<MoveOutcome> moved) { self->OnPrepared(axis, moved); });
  }
  Search();
}

void ConditionedSearch::OnPrepared(Axis axis, const Result<MoveOutcome>& moved) {
  if (!moved) return Restore(PassOn(moved));
  if (!moved->reached) {
    return Restore(
        Refusal(autofocus::Cause::Missed, NameOf(axis) + " did not get where it was sent: " + moved->reason));
  }
  if (Stopped()) return Restore(Fail(Code::Cancelled, kStopped));
  if (rig_.commands.all.given != begun_.commands) {
    return Restore(Fail(Code::Superseded, "another command for this lens took over"));
  }
  Prepare();
}

void ConditionedSearch::Search() {
  under_.search = Here();
  AutofocusRequest request = request_;
  request.conditions.reset();
  // The job may keep this beyond the end.
  auto progress = [activity = std::weak_ptr(activity_), tell = progress_](const AutofocusProgress& now) {
    if (const auto ours = activity.lock()) *ours = {Activity::Kind::Autofocus, now.frames, now.frames_expected};
    if (tell) (*tell)(now);
  };
  rig_.Autofocus(std::move(request), std::move(progress),
                 [self = shared_from_this()](Result<AutofocusOutcome> answer) { self->Restore(std::move(answer)); });
}

// ---- and back -----------------------------------------------------------------------------------------------------

AutofocusOutcome ConditionedSearch::Refusal(autofocus::Cause cause, std::string reason) const {
  AutofocusOutcome outcome;
  outcome.method = request_.method;
  outcome.cause = cause;
  outcome.reason = std::move(reason);
  const auto& focus = rig_.axes[Axis::Focus];
  if (focus->state()) outcome.position = focus->state()->position;
  return outcome;
}

void ConditionedSearch::Stays(const std::string& what) {
  under_.stays += (under_.stays.empty() ? "" : "; ") + what;
}

void ConditionedSearch::Restore(Result<AutofocusOutcome> answer) {
  answer_ = std::move(answer);
  RestoreExposure();
  RestoreAxes();
}

void ConditionedSearch::RestoreExposure() {
  const drivers::ExposureState& set = request_.conditions->exposure;
  const SearchedUnder search = under_;
  drivers::ExposureState before;
  if (set.exposure) before.exposure = exposure_before_.exposure;
  if (set.gain) before.gain = exposure_before_.gain;
  if (auto back = Expose(before); !back) Stays("the exposure could not be set back: " + back.error().message);
  under_.exposure = search.exposure;
}

/// It rests where it was before, by whichever command.
bool ConditionedSearch::IsBack(Axis axis) const {
  const AxisController& controller = *rig_.axes[axis];
  return !controller.moving() && controller.state() &&
         std::abs((controller.state()->position - parts_[axis].before).value) <= controller.setup().tolerance;
}

/// Why an axis is left where it is; empty: it is ours to bring back.
std::string ConditionedSearch::WhyLeft(Axis axis) const {
  if (rig_.commands.of[axis].given != parts_[axis].commands) return "a stop or another command came for it";
  return rig_.autofocus.running() ? "another autofocus has begun" : "";
}

void ConditionedSearch::RestoreAxes() {
  for (const Axis axis : kBack) {
    Part& part = parts_[axis];
    if (!part.set || std::exchange(part.restored, true)) continue;
    if (const std::string why = WhyLeft(axis); !why.empty()) {
      if (IsBack(axis)) continue;
      Stays(NameOf(axis) + " is left where it is (" + why + "), and was at " + part.was);
      continue;
    }
    const Target back{.kind = Target::Kind::Native, .value = part.before.value, .from = {}, .take_up = {}};
    if (rig_.procedure.expired()) rig_.procedure = activity_;  // a stop ends procedures
    return rig_.Move(axis, back,
                     [self = shared_from_this(), axis](Result<MoveOutcome> moved) { self->OnRestored(axis, moved); });
  }
  under_.work = Here();
  ApplyShift();
}

void ConditionedSearch::OnRestored(Axis axis, const Result<MoveOutcome>& moved) {
  if (!moved || !moved->reached) {
    Stays(NameOf(axis) + " did not come back to " + parts_[axis].was + ": " +
          (moved ? moved->reason : moved.error().message));
  }
  const bool ended = !moved && (moved.error().code == Code::Cancelled || moved.error().code == Code::Superseded);
  if (ended && *answer_) answer_ = PassOn(moved);
  RestoreAxes();
}

/// Focus stands where the search found it; under the conditions of work it is sharp elsewhere.
void ConditionedSearch::ApplyShift() {
  if (!*answer_ || !(*answer_)->focused || Stopped()) return Finish();
  if (rig_.commands.of[Axis::Focus].given != begun_.focus_commands) {
    answer_ = Fail(Code::Superseded, "a newer command for this lens took over");
  }
  const OpticsTable* const optics = rig_.optics.focus_table();
  const bool native = optics == nullptr;
  if (!*answer_ || !under_.stays.empty() || request_.conditions->shift == SearchConditions::Shift::Ignore) {
    return Finish();
  }
  const auto& calibration = rig_.optics.calibration();
  const auto shift = ShiftBetween(calibration ? calibration->focus_shifts : std::vector<FocusShift>{}, under_.search,
                                  under_.work, native);
  if (!shift) {
    under_.shift_reason = shift.error().message + "; focus is where the search found it";
    return Finish();
  }
  const Native found = (*answer_)->position;
  if (shift->value == 0.0) {
    MoveOutcome stays;
    stays.reached = true;
    stays.position = found;
    return OnShifted(*shift, stays);
  }
  const Native there = native ? found + Native{shift->value}
                              : optics->NativeFromExtension(optics->ExtensionFromNative(found) + Metres{shift->value});
  rig_.Move(Axis::Focus, {.kind = Target::Kind::Native, .value = there.value, .from = {}, .take_up = {}},
            [self = shared_from_this(), shift = *shift](Result<MoveOutcome> moved) { self->OnShifted(shift, moved); });
}

void ConditionedSearch::OnShifted(const ShiftSize& shift, const Result<MoveOutcome>& moved) {
  if (!moved && moved.error().code != Code::OutOfRange) {
    answer_ = PassOn(moved);
    return Finish();
  }
  AutofocusOutcome& outcome = **answer_;
  if (!moved || !moved->reached) {
    outcome.focused = false;
    outcome.cause = autofocus::Cause::NotRestored;
    outcome.reason = "focus was found under the conditions of the search, but the move by the focus shift failed: " +
                     (moved ? moved->reason : moved.error().message);
    if (moved) outcome.position = moved->position;
    return Finish();
  }
  under_.shift = shift;
  const Native by = moved->position - outcome.position;
  outcome.position = moved->position;
  if (outcome.subject) outcome.subject->position = outcome.subject->position + by;
  const OpticsTable* const optics = rig_.optics.table();
  if (!shift.native && outcome.sigma) {
    const Metres extension = optics->ExtensionFromNative(outcome.position);
    const double to_sensor = (optics->FocalLengthAt(extension) + extension).value;
    const double also = shift.sigma / (to_sensor * to_sensor);  // dU/de = 1/Z_s²
    outcome.sigma = Dioptres{std::hypot(outcome.sigma->value, also)};
    if (outcome.subject && outcome.subject->sigma) {
      outcome.subject->sigma = Dioptres{std::hypot(outcome.subject->sigma->value, also)};
    }
  }
  Finish();
}

void ConditionedSearch::Finish() {
  auto answer = *std::move(answer_);
  if (answer && Stopped()) answer = Fail(Code::Cancelled, kStopped);
  if (!answer) {
    const std::string also = under_.stays.empty() ? "" : "; " + under_.stays;
    return rig_.replies.Add(
        std::move(done_), Result<AutofocusOutcome>(Fail(answer.error().code, answer.error().message + also,
                                                        answer.error().facts ? *answer.error().facts : ErrorFacts{})));
  }
  if (!under_.stays.empty()) {
    const bool found = std::exchange(answer->focused, false);
    if (found) answer->cause = autofocus::Cause::NotRestored;
    answer->reason =
        (found ? "focus was found, but not all is as before the search: " : answer->reason + "; ") + under_.stays;
    if (found) answer->sigma.reset();
    if (found) answer->subject.reset();
  }
  if (!under_.shift_reason.empty()) answer->reason += "; " + under_.shift_reason;
  const OpticsTable* const optics = rig_.optics.focus_table();
  if (optics != nullptr) {
    const auto at = [&](Native position) {
      return optics->VergenceFromExtension(optics->ExtensionFromNative(position));
    };
    answer->vergence = at(answer->position);
    if (answer->subject) answer->subject->vergence = at(answer->subject->position);
  }
  answer->elapsed = rig_.clock.Now() - begun_.at;
  answer->moves = rig_.axes[Axis::Focus]->commands() - begun_.motions;
  answer->under = under_;
  rig_.replies.Add(std::move(done_), Result<AutofocusOutcome>(*std::move(answer)));
}

}  // namespace lensd::rig
