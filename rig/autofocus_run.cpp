#include "autofocus_run.h"

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

void AutofocusRun::Look() {
  hands_.look([this](Result<Seen> seen) { OnFrame(std::move(seen)); });
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
  stands_ = Native{0.5 * (focus->lowest + focus->highest).value};
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

Result<autofocus::Advice> AutofocusRun::Show(const Seen& seen) {
  const double position = scale_.position(stands_);
  if (seen.score) return search_.NextScore(position, *seen.score);
  return search_.Next(position, seen.lensed.frame);
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
  const Native target = scale_.native(std::get<autofocus::GoAndLook>(advice).position);
  if (std::abs((target - stands_).value) < 0.5 * scale_.resolution) return Look();
  hands_.move(target, [this](Result<MoveOutcome> moved) { OnMoved(std::move(moved)); });
}

void AutofocusRun::OnMoved(Result<MoveOutcome> moved) {
  if (going_back_with_) return;
  if (!moved) return GoBack(PassOn(std::move(moved)));
  stands_ = moved->position;
  if (!moved->reached) return GoBack(Refusal("the lens did not get where it was sent: " + moved->reason));
  Look();
}

/// Returns the lens to where the run found it, then gives the answer; says so where that fails.
void AutofocusRun::GoBack(Result<AutofocusOutcome> answer) {
  going_back_with_ = std::move(answer);
  if (!start_) return End(*std::move(going_back_with_));
  hands_.move(*start_, [this](Result<MoveOutcome> moved) {
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
