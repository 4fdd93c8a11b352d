#include "autofocus_run.h"

#include <cmath>
#include <ctime>
#include <utility>

namespace lensd::rig {
namespace {

Duration ThreadCpu() {
  timespec spent{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &spent);
  return std::chrono::seconds(spent.tv_sec) + std::chrono::nanoseconds(spent.tv_nsec);
}

}  // namespace

AutofocusRun::AutofocusRun(autofocus::Regions search, Instant deadline, Hands hands, Scale scale,
                           ProgressCallback progress)
    : search_(std::move(search)),
      began_at_(hands.now()),
      deadline_(deadline),
      hands_(std::move(hands)),
      scale_(std::move(scale)),
      progress_(std::move(progress)) {}

void AutofocusRun::Begin() {
  Look();
}

void AutofocusRun::Look(bool in_motion_too) {
  hands_.look(in_motion_too, [this](Result<Seen> seen) { OnFrame(std::move(seen)); });
}

Activity AutofocusRun::activity() const {
  return {Activity::Kind::Autofocus, search_.frames(), search_.frames_expected()};
}

void AutofocusRun::CheckDeadline() {
  if (holding_ || hands_.now() < deadline_ || going_back_with_) return;
  GoBack(Refusal("no answer by the deadline"));
}

void AutofocusRun::OnFrame(Result<Seen> seen) {
  if (going_back_with_) return;
  if (!seen) return GoBack(PassOn(std::move(seen)));
  const auto& focus = seen->lensed.axes[drivers::Axis::Focus];
  if (!focus) return GoBack(Fail(Code::Internal, "a frame came without the lens position it was taken at"));
  if (passing_ && arrived_ && !focus->moving) passing_ = false;
  stands_ = WithSlack(passing_ ? focus->mid : 0.5 * (focus->lowest + focus->highest));
  place_ = PlaceOf(*focus);
  if (holding_) {
    auto changed = Watch(*seen);
    if (!changed) return End(PassOn(std::move(changed)));
    if (!*changed) return Look();
  }
  if (!start_) start_ = stands_;
  const Duration before = ThreadCpu();
  auto advice = Show(*seen);
  cpu_ += ThreadCpu() - before;
  if (!advice) return GoBack(PassOn(std::move(advice)));
  Report();
  Follow(*advice);
}

/// A frame on the way belongs to the middle of its exposure; the bound of that place is taken for an even distribution.
autofocus::Place AutofocusRun::PlaceOf(const LensedFrame::AxisDuring& focus) const {
  if (!passing_) return scale_.position(stands_);
  const double span = scale_.position(focus.mid + focus.mid_bound) - scale_.position(focus.mid - focus.mid_bound);
  return {scale_.position(focus.mid), std::abs(span) / std::sqrt(12.0)};
}

Result<autofocus::Advice> AutofocusRun::Show(const Seen& seen) {
  if (seen.score) return search_.NextScore(place_.position, *seen.score);
  return search_.Next(place_, seen.lensed.frame);
}

void AutofocusRun::Report() {
  if (!progress_) return;
  progress_({.frames = search_.frames(),
             .moves = hands_.motions() - motions_before_,
             .frames_expected = search_.frames_expected(),
             .position = stands_,
             .sharpness = search_.relative_sharpness()});
}

void AutofocusRun::Follow(const autofocus::Advice& advice) {
  if (const auto* verdict = std::get_if<autofocus::Verdict>(&advice)) {
    if (!verdict->focused) return GoBack(Outcome(*verdict));
    return End(Outcome(*verdict));
  }
  const auto& go = std::get<autofocus::GoAndLook>(advice);
  if (go.stride > 0) return Pass(go);
  passing_ = false;
  GoTo(go);
}

void AutofocusRun::GoTo(const autofocus::GoAndLook& advice) {
  const Native target = scale_.native(advice.position);
  const Native reading = target - Native{scale_.slack};
  // Against the approach direction, and far enough to lose all of the backlash: then where it ends is known.
  const bool back = (stands_ - reading).value * scale_.slack > 2.0 * scale_.slack * scale_.slack;
  const bool loose = advice.loose && !loose_ && back;
  if (!loose && !loose_ && std::abs((target - stands_).value) < 0.5 * scale_.resolution) return Look();
  const Arrival arrival = loose ? Arrival::Anyhow : loose_ ? Arrival::Anew : Arrival::TakenUp;
  loose_ = loose;
  hands_.move(loose ? reading : target, arrival, [this](Result<MoveOutcome> moved) { OnMoved(std::move(moved)); });
}

/// Sets out, and looks; or looks again while on the way.
void AutofocusRun::Pass(const autofocus::GoAndLook& go) {
  if (!passing_) {
    passing_ = true;
    arrived_ = loose_ = false;
    hands_.pass(scale_.native(go.position), go.stride / scale_.stride, [this](Result<MoveOutcome> moved) {
      if (!passing_ || going_back_with_) return;
      if (!moved) return GoBack(PassOn(std::move(moved)));
      if (!moved->reached) return GoBack(Refusal("the lens did not get where it was sent: " + moved->reason));
      arrived_ = true;
    });
  }
  Look(true);
}

void AutofocusRun::OnMoved(Result<MoveOutcome> moved) {
  if (going_back_with_) return;
  if (!moved) return GoBack(PassOn(std::move(moved)));
  stands_ = WithSlack(moved->position);
  if (!moved->reached) return GoBack(Refusal("the lens did not get where it was sent: " + moved->reason));
  Look();
}

/// Returns the lens to where the run found it, then gives the answer; says so where that fails.
void AutofocusRun::GoBack(Result<AutofocusOutcome> answer) {
  passing_ = false;
  going_back_with_ = std::move(answer);
  if (!start_) return End(*std::move(going_back_with_));
  const Arrival arrival = std::exchange(loose_, false) ? Arrival::Anew : Arrival::TakenUp;
  hands_.move(*start_, arrival, [this](Result<MoveOutcome> moved) {
    auto last = *std::move(going_back_with_);
    const bool back = moved && moved->reached;
    const std::string trouble =
        back ? "" : "; the lens could not be brought back: " + (moved ? moved->reason : moved.error().message);
    if (!last) return End(Fail(last.error().code, last.error().message + trouble));
    if (moved) stands_ = moved->position;
    AutofocusOutcome refusal = Refusal(last->reason + trouble);
    refusal.candidates = std::move(last->candidates);
    End(std::move(refusal));
  });
}

/// The end, unless the subject is to be tracked: then only an error is.
void AutofocusRun::End(Result<AutofocusOutcome> answer) {
  if (!tracking_ || !answer) return hands_.end(std::move(answer));
  tracking_->tell(*answer);
  tracker_.SearchEnded(answer->focused, hands_.now());
  holding_ = true;
  start_.reset();
  Look();
}

/// Whether the scene has changed; then a new search has begun, and the frame at hand is its first.
Result<bool> AutofocusRun::Watch(const Seen& seen) {
  const drivers::Frame& frame = seen.lensed.frame;
  auto window = autofocus::WindowOf(search_.regions().front(), frame.width, frame.height);
  if (!window) return PassOn(std::move(window));
  auto score = autofocus::ScoreFocus(frame, *window);
  if (!score) return PassOn(std::move(score));
  if (!tracker_.Changed(*score, frame.bits, window->width * window->height, hands_.now())) return false;
  auto search = tracking_->search_anew();
  if (!search) return PassOn(std::move(search));
  search_ = *std::move(search);
  holding_ = false;
  start_ = stands_;
  began_at_ = hands_.now();
  deadline_ = began_at_ + tracking_->limit;
  motions_before_ = hands_.motions();
  cpu_ = {};
  return true;
}

AutofocusOutcome AutofocusRun::Refusal(std::string reason) const {
  autofocus::Verdict verdict;
  verdict.reason = std::move(reason);
  return Outcome(verdict);
}

AutofocusOutcome AutofocusRun::Outcome(const autofocus::Verdict& verdict) const {
  AutofocusOutcome outcome;
  outcome.focused = verdict.focused;
  outcome.method = search_.method();
  outcome.frames = search_.frames();
  outcome.moves = hands_.motions() - motions_before_;
  outcome.elapsed = hands_.now() - began_at_;
  outcome.position = stands_;
  outcome.cpu = cpu_;
  outcome.confidence = verdict.confidence;
  outcome.reason = verdict.reason;
  if (scale_.optics != nullptr) {
    const Metres extension = scale_.optics->ExtensionFromNative(stands_);
    const double to_sensor = (scale_.optics->FocalLengthAt(extension) + extension).value;
    outcome.vergence = scale_.optics->VergenceFromExtension(extension);
    // dU/de = 1/Z_s².
    if (verdict.focused) outcome.sigma = Dioptres{verdict.sigma / (to_sensor * to_sensor)};
    if (verdict.focused && verdict.subject) {
      outcome.subject = scale_.optics->VergenceFromExtension(Metres{verdict.subject->position});
      outcome.subject_sigma = Dioptres{verdict.subject->sigma / (to_sensor * to_sensor)};
    }
  }
  for (const autofocus::Candidate& found : verdict.candidates) {
    AutofocusCandidate candidate;
    candidate.position = scale_.native(found.position);
    candidate.region = found.region;
    if (scale_.optics != nullptr) {
      candidate.vergence = scale_.optics->VergenceFromExtension(Metres{found.position});
    }
    outcome.candidates.push_back(candidate);
  }
  return outcome;
}

}  // namespace lensd::rig
