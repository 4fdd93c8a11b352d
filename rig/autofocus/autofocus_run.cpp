// Each frame is shown to the session, whose advice becomes a move, a sweep or the end; the next frame is asked for when
// the lens stands, or on the sweep. However it ends, the callback comes once, after the lens has been brought back if
// need be.
#include "rig/autofocus/autofocus_run.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <sstream>
#include <utility>

#include "autofocus/regions.h"
#include "base/missing_optics.h"
#include "drivers/api/arrival_watch.h"

namespace lensd::rig {
namespace {

constexpr Duration kShortMove = std::chrono::milliseconds(100);  ///< what the time of a search allows for each

Duration ThreadCpu() {
  timespec spent{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &spent);
  return std::chrono::seconds(spent.tv_sec) + std::chrono::nanoseconds(spent.tv_nsec);
}

}  // namespace

Result<std::unique_ptr<autofocus::RegionSearch>> AutofocusRun::SearchOf(const AutofocusRequest& request,
                                                                        const autofocus::Setup& setup,
                                                                        const Scale& scale,
                                                                        std::vector<drivers::Region> regions) {
  if (!request.map) {
    auto search = autofocus::Regions::Create(request.method, setup, std::move(regions), request.policy);
    if (!search) return PassOn(search);
    return std::make_unique<autofocus::Regions>(*std::move(search));
  }
  if (scale.optics == nullptr) {
    return Fail(
        Code::Unsupported,
        OpticsMissing("a focus map is in micrometres of extension, which a liquid lens has not, and those of this "
                      "lens are"));
  }
  return autofocus::MakeMapSearch(setup, *request.map);
}

AutofocusRun::AutofocusRun(Plan plan, FocusActuator& lens, Scale scale, std::function<Result<Plan>()> plan_anew)
    : lens_(lens), scale_(scale), plan_anew_(std::move(plan_anew)), search_(SearchFor(std::move(plan))) {}

AutofocusRun::Search AutofocusRun::SearchFor(Plan plan) const {
  const Instant deadline = lens_.Now() + plan.limit;
  autofocus::FrameGate gate(plan.setup, lens_.lag_frames(), lens_.source(), lens_.last_frame());
  return {.plan = std::move(plan),
          .gate = std::move(gate),
          .began_at = lens_.Now(),
          .deadline = deadline,
          .motions_before = lens_.motions(),
          .cpu = {}};
}

void AutofocusRun::Track() {
  tracking_ = Tracking{.tracker = autofocus::Tracker(), .holding = false};
}

void AutofocusRun::Begin(Native stands) {
  stands_ = stands;
  if (!EntersRange()) RequestFrame();
}

/// From where it stands outside of the range the lens goes to the nearer end; a frame is asked for there.
bool AutofocusRun::EntersRange() {
  if (!search_.plan.range) return false;
  const Native inside = std::clamp(stands_, search_.plan.range->first, search_.plan.range->second);
  if (std::abs((inside - stands_).value) < 0.5 * scale_.resolution) return false;
  start_ = stands_;
  GoTo({.position = scale_.Position(inside)});
  return true;
}

void AutofocusRun::Allow(Duration limit) {
  search_.plan.limit = search_.plan.usual = limit;
  search_.deadline = search_.began_at + limit;
}

void AutofocusRun::RequestFrame(LensMotion lens) {
  lens_.RequestFrame(lens, [this](Result<Observation> seen) { OnFrame(std::move(seen)); });
}

Activity AutofocusRun::activity() const {
  return {Activity::Kind::Autofocus, frames(), frames_expected()};
}

void AutofocusRun::CheckDeadline() {
  if (holding() || lens_.Now() < search_.deadline || going_back_with_) return;
  std::ostringstream reason;
  reason.precision(3);
  const auto seconds = [](Duration time) { return std::chrono::duration<double>(time).count(); };
  reason << "no answer by the deadline, " << seconds(search_.plan.limit) << " s";
  if (search_.plan.usual > search_.plan.limit) {
    reason << ": a search of the whole range may take " << seconds(search_.plan.usual) << " s";
  }
  GoBack(Refusal(autofocus::Cause::Deadline, reason.str()));
}

void AutofocusRun::OnFrame(Result<Observation> seen) {
  if (going_back_with_) return;
  if (!seen) return GoBack(PassOn(seen));
  const auto& focus = seen->lensed.axes[drivers::Axis::Focus];
  if (!focus) return GoBack(Fail(Code::Internal, "a frame came without the lens position it was taken at"));
  if (sweep_ == Sweep::Arrived && !focus->moving) sweep_ = Sweep::None;
  stands_ = WithSlack(sweep_ != Sweep::None ? focus->mid : 0.5 * (focus->lowest + focus->highest));
  const autofocus::Place place = PlaceOf(*focus);
  if (holding() && lens_.Held()) return RequestFrame();
  if (holding()) {
    auto changed = Watch(*seen);
    if (!changed) return End(PassOn(changed));
    if (!*changed) return RequestFrame();
    if (EntersRange()) return;
  }
  if (!start_) start_ = stands_;
  const Duration before = ThreadCpu();
  ++search_.taken;
  auto admitted = Admit(*seen, place);
  if (!admitted) return GoBack(PassOn(admitted));
  if (*admitted == Admission::Ended) return;
  if (*admitted == Admission::Again) {
    search_.cpu += ThreadCpu() - before;
    return RequestFrame(sweep_ != Sweep::None ? LensMotion::Any : LensMotion::Standing);
  }
  search_.frames.push_back(SampleOf(*seen));
  auto advice = seen->score ? search_.plan.regions->NextScore(place.position, *seen->score)
                            : search_.plan.regions->Next(place, seen->lensed.frame);
  search_.cpu += ThreadCpu() - before;
  if (!advice) return GoBack(PassOn(advice));
  lens_.Report({.frames = frames(),
                .moves = lens_.motions() - search_.motions_before,
                .frames_expected = frames_expected(),
                .position = stands_,
                .sharpness = search_.plan.regions->relative_sharpness(),
                .samples = Samples()},
               [this, next = *std::move(advice)] { Follow(next); });
}

/// A frame on the way belongs to the middle of its exposure; the bound of that place is taken for an even distribution.
autofocus::Place AutofocusRun::PlaceOf(const LensedFrame::AxisDuring& focus) const {
  if (sweep_ == Sweep::None) return scale_.Position(stands_);
  const double span = scale_.Position(focus.mid + focus.mid_bound) - scale_.Position(focus.mid - focus.mid_bound);
  return {scale_.Position(focus.mid), std::abs(span) / std::sqrt(12.0)};
}

/// Its place, without its score.
AutofocusSample AutofocusRun::SampleOf(const Observation& seen) const {
  using State = AutofocusSample::State;
  const auto& focus = *seen.lensed.axes[drivers::Axis::Focus];
  AutofocusSample sample;
  sample.frame = search_.taken - 1;
  sample.state = sweep_ != Sweep::None ? State::Moving : backlash_open_ ? State::BacklashOpen : State::Standing;
  sample.position = stands_;
  sample.bound = sweep_ != Sweep::None ? focus.mid_bound : focus.bound;
  if (scale_.optics != nullptr) {
    sample.vergence = scale_.optics->VergenceFromExtension(scale_.optics->ExtensionFromNative(stands_));
  }
  sample.exposure_start = seen.lensed.frame.exposure_start;
  sample.exposure_end = seen.lensed.frame.exposure_end;
  return sample;
}

std::vector<AutofocusSample> AutofocusRun::Samples() const {
  const auto curves = search_.plan.regions->Curves();
  std::vector<AutofocusSample> samples;
  for (std::size_t i = curves.size() - std::min(curves.size(), kMostSamples); i < curves.size(); ++i) {
    const auto& seen = curves[i];
    AutofocusSample sample = search_.frames[static_cast<std::size_t>(seen.frame)];
    sample.region = seen.region;
    sample.score = seen.score;
    sample.score_sigma = seen.sigma;
    samples.push_back(sample);
  }
  return samples;
}

void AutofocusRun::Follow(const autofocus::Advice& advice) {
  if (const auto* verdict = std::get_if<autofocus::Verdict>(&advice)) {
    if (!search_.gate.ToLookAgain(*verdict)) return EndWith(*verdict);
    search_.ends_with = *verdict;
    return RequestFrame();
  }
  const auto& go = std::get<autofocus::GoAndLook>(advice);
  if (go.stride > 0) return GoOn(go);
  sweep_ = Sweep::None;
  GoTo(go);
}

void AutofocusRun::EndWith(const autofocus::Verdict& verdict) {
  verdict.focused ? End(Outcome(verdict)) : GoBack(Outcome(verdict));
}

void AutofocusRun::GoTo(const autofocus::GoAndLook& advice) {
  const Native target = scale_.NativeAt(advice.position);
  const Native reading = target - Native{scale_.slack};
  // Against the approach direction, and far enough to lose all of the backlash: then where it ends is known.
  const bool back = (stands_ - reading).value * scale_.slack > 2.0 * scale_.slack * scale_.slack;
  const bool was_open = std::exchange(backlash_open_, advice.backlash_open && !backlash_open_ && back);
  if (!backlash_open_ && !was_open && std::abs((target - stands_).value) < 0.5 * scale_.resolution) {
    return RequestFrame();
  }
  const Approach approach = backlash_open_ ? Approach::AnyDirection
                            : was_open     ? Approach::Reapproach
                                           : Approach::BacklashTakenUp;
  lens_.MoveTo(backlash_open_ ? reading : target, approach,
               [this](Result<MoveOutcome> moved) { OnMoved(std::move(moved)); });
}

/// Where the caller sets no deadline, the time that registers take to tell the truth about a short move is not the
/// search's.
void AutofocusRun::AllowForLag(Duration move) {
  const Duration lag = std::min(move - kShortMove, drivers::kRegisterLag);
  if (lag > Duration::zero() && search_.plan.limit == search_.plan.usual) Allow(search_.plan.limit + lag);
}

void AutofocusRun::OnMoved(Result<MoveOutcome> moved) {
  if (going_back_with_) return;
  if (!moved) return GoBack(PassOn(moved));
  AllowForLag(moved->elapsed);
  stands_ = WithSlack(moved->position);
  if (!moved->reached) return GoBack(Missed(*moved));
  RequestFrame();
}

/// Sets out on a sweep, and takes a frame; or another one while on the way.
void AutofocusRun::GoOn(const autofocus::GoAndLook& advice) {
  if (sweep_ == Sweep::None) {
    sweep_ = Sweep::UnderWay;
    backlash_open_ = false;
    lens_.SweepTo(scale_.NativeAt(advice.position), advice.stride / scale_.stride,
                  [this](Result<MoveOutcome> moved) { OnSwept(std::move(moved)); });
  }
  RequestFrame(LensMotion::Any);
}

void AutofocusRun::OnSwept(Result<MoveOutcome> moved) {
  if (sweep_ == Sweep::None || going_back_with_) return;
  if (!moved) return GoBack(PassOn(moved));
  if (!moved->reached) return GoBack(Missed(*moved));
  sweep_ = Sweep::Arrived;
}

/// Returns the lens to where the run found it, then gives the answer; says so where that fails.
void AutofocusRun::GoBack(Result<AutofocusOutcome> answer) {
  sweep_ = Sweep::None;
  going_back_with_ = std::move(answer);
  if (!start_) return End(*std::move(going_back_with_));
  const Approach approach = std::exchange(backlash_open_, false) ? Approach::Reapproach : Approach::BacklashTakenUp;
  lens_.MoveTo(*start_, approach, [this](Result<MoveOutcome> moved) {
    auto last = *std::move(going_back_with_);
    const bool back = moved && moved->reached;
    const std::string trouble =
        back ? "" : "; the lens could not be moved back: " + (moved ? moved->reason : moved.error().message);
    if (!last) return End(Fail(last.error().code, last.error().message + trouble));
    if (moved) stands_ = moved->position;
    AutofocusOutcome refusal = Refusal(last->cause, {});
    refusal.reason = last->reason + trouble;
    refusal.candidates = std::move(last->candidates);
    refusal.samples = std::move(last->samples);
    End(std::move(refusal));
  });
}

/// The end, unless the subject is to be tracked: then only an error is.
void AutofocusRun::End(Result<AutofocusOutcome> answer) {
  if (!tracking_ || !answer) return lens_.End(std::move(answer));
  lens_.Tell(*answer);
  tracking_->tracker.SearchEnded(answer->focused, lens_.Now());
  tracking_->holding = true;
  start_.reset();
  RequestFrame();
}

/// Whether the scene has changed; then a new search has begun, and the frame at hand is its first.
Result<bool> AutofocusRun::Watch(const Observation& seen) {
  const drivers::Frame& frame = seen.lensed.frame;
  auto window = autofocus::WindowOf(regions().front(), frame.width, frame.height);
  if (!window) return PassOn(window);
  auto score = autofocus::ScoreFocus(frame, *window);
  if (!score) return PassOn(score);
  if (!tracking_->tracker.Changed(*score, frame.bits, window->width * window->height, lens_.Now())) return false;
  auto search = plan_anew_();
  if (!search) return PassOn(search);
  search_ = SearchFor(*std::move(search));
  tracking_->holding = false;
  start_ = stands_;
  return true;
}

AutofocusOutcome AutofocusRun::Missed(const MoveOutcome& moved) const {
  return Refusal(autofocus::Cause::Missed, "the lens did not reach its target: " + moved.reason);
}

AutofocusOutcome AutofocusRun::Refusal(autofocus::Cause cause, std::string reason) const {
  autofocus::Verdict verdict;
  verdict.cause = cause;
  verdict.reason = std::move(reason);
  return Outcome(verdict);
}

AutofocusSubject AutofocusRun::SubjectOf(const autofocus::Verdict& verdict) const {
  const double position = verdict.subject ? verdict.subject->position : verdict.position;
  AutofocusSubject subject;
  subject.region = search_.plan.regions->answered();
  subject.by = verdict.found_by;
  subject.position = scale_.NativeAt(position);
  if (scale_.optics == nullptr) return subject;
  const Metres extension{position};
  const double to_sensor = (scale_.optics->FocalLengthAt(extension) + extension).value;
  const double sigma = verdict.subject ? verdict.subject->sigma : verdict.sigma;
  subject.vergence = scale_.optics->VergenceFromExtension(extension);
  subject.sigma = Dioptres{sigma / (to_sensor * to_sensor)};
  return subject;
}

AutofocusOutcome AutofocusRun::Outcome(const autofocus::Verdict& verdict) const {
  AutofocusOutcome outcome;
  outcome.focused = verdict.focused;
  outcome.method = search_.plan.regions->method();
  outcome.frames = frames();
  outcome.moves = lens_.motions() - search_.motions_before;
  outcome.elapsed = lens_.Now() - search_.began_at;
  outcome.position = stands_;
  outcome.cpu = search_.cpu;
  outcome.confidence = verdict.confidence;
  outcome.cause = verdict.cause;
  outcome.reason = WithLeftOut(verdict.reason);
  outcome.left_out = search_.left_out;
  outcome.lag_frames = search_.gate.lag();
  if (scale_.optics != nullptr) {
    const Metres extension = scale_.optics->ExtensionFromNative(stands_);
    const double to_sensor = (scale_.optics->FocalLengthAt(extension) + extension).value;
    outcome.vergence = scale_.optics->VergenceFromExtension(extension);
    // dU/de = 1/Z_s².
    if (verdict.focused) outcome.sigma = Dioptres{verdict.sigma / (to_sensor * to_sensor)};
  }
  outcome.samples = Samples();
  outcome.regions = regions();
  outcome.stars = verdict.stars;
  if (verdict.focused) outcome.subject = SubjectOf(verdict);
  outcome.known_slope = search_.plan.known_slope;
  outcome.slope = ShownSlope(verdict);
  if (const autofocus::FocusMap* map = search_.plan.regions->map()) {
    outcome.map = FocusMapOutcomeOf(*map, *scale_.optics, search_.plan.setup);
  }
  for (const autofocus::Candidate& found : verdict.candidates) {
    AutofocusCandidate candidate;
    candidate.position = scale_.NativeAt(found.position);
    candidate.region = found.region;
    if (scale_.optics != nullptr) {
      candidate.vergence = scale_.optics->VergenceFromExtension(Metres{found.position});
    }
    outcome.candidates.push_back(candidate);
  }
  return outcome;
}

}  // namespace lensd::rig
