// A request waits here until the lens stands (or may move), the camera has a frame exposed after that, and a reading of
// the lens from after the exposure tells where it was meanwhile.
#include "rig/frames/frame_requests.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rig/common/retries.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr Duration kPollPeriod = std::chrono::milliseconds(2);
constexpr Duration kPatience = std::chrono::seconds(5);  ///< of a request, beside what is below
/// So many frames, over so long, are no bad luck where none of them can be used.
constexpr int kManyUnusable = 10;
constexpr Duration kLongUnusable = std::chrono::seconds(1);
constexpr double kSlowFrames = 3.0;  ///< the one under way, one that is lost, and the next

}  // namespace

void FrameRequests::Add(FrameRequest request) {
  if (camera_ == nullptr) {
    return replies_.Add(std::move(request.done),
                        Result<LensedFrame>(Fail(Code::Unsupported, "this lens has no camera")));
  }
  waiting_.push_back(std::move(request));
}

Result<void> FrameRequests::View(FrameViewer viewer) {
  if (camera_ == nullptr) return Fail(Code::Unsupported, "this lens has no camera");
  onlookers_.push_back({std::move(viewer), {}, {}});
  return {};
}

void FrameRequests::ForgetAutofocus() {
  std::erase_if(waiting_, [](const FrameRequest& request) { return request.for_autofocus; });
}

template <class Predicate>
std::vector<SnapshotCallback> FrameRequests::TakeIf(const Predicate& predicate) {
  std::vector<SnapshotCallback> taken;
  for (FrameRequest& request : waiting_) {
    if (predicate(request)) taken.push_back(std::move(request.done));
  }
  std::erase_if(waiting_, predicate);
  return taken;
}

void FrameRequests::FailAll(const Error& error) {
  for (FrameRequest& request : std::exchange(waiting_, {})) {
    replies_.Add(std::move(request.done), Result<LensedFrame>(PassOn(error)));
  }
  for (const Onlooker& onlooker : std::exchange(onlookers_, {})) (void)onlooker.viewer.show(PassOn(error));
}

// ---- from the camera ----------------------------------------------------------------------------------------------

void FrameRequests::Poll(Instant now, bool keep) {
  if (camera_ == nullptr) return;
  stream_.kept = keep;
  auto polled = SetStreaming(any() || keep || !onlookers_.empty());
  if (polled && (any() || ViewIsDue(now)) && !frame_) polled = Ask(now);
  if (!polled) FailAll(polled.error());
}

Result<void> FrameRequests::SetStreaming(bool wanted) {
  if (wanted == stream_.on) return {};
  auto done = wanted ? camera_->Start() : camera_->Stop();
  stream_.on = wanted && done;
  stream_.unusable_since.reset();
  beat_.last_start.reset();
  return done;
}

/// In motion every frame may be wanted, so none is waited for.
Result<void> FrameRequests::Ask(Instant now) {
  const auto steady = lens_.SteadySince();
  const bool may_serve = any() && steady && now >= EarliestFrame(*steady);
  if (!anyone_in_motion() && !may_serve && !ViewIsDue(now)) return {};
  auto polled = camera_->Poll();
  if (!polled) {
    if (IsTransient(polled.error().code) && ++stream_.failures < kAttempts) return {};
    return PassOn(polled);
  }
  stream_.failures = 0;
  frame_ = *std::move(polled);
  if (!frame_) return JudgeUnusable(now);
  stream_.unusable_since.reset();
  beat_.exposure = frame_->exposure_end - frame_->exposure_start;
  beat_.last_start = frame_->exposure_start;
  return {};
}

/// Protocol: frames come, and none can be used. A few bad ones are waited out.
Result<void> FrameRequests::JudgeUnusable(Instant now) {
  const drivers::UnusableFrames unusable = camera_->unusable();
  if (unusable.count == 0) {
    stream_.unusable_since.reset();
    return {};
  }
  if (!stream_.unusable_since) stream_.unusable_since = now;
  if (unusable.count < kManyUnusable || now - *stream_.unusable_since < kLongUnusable) return {};
  return PassOn(NoneInTime());
}

/// Whether frames came that could not be used, or none came at all.
Error FrameRequests::NoneInTime() const {
  const drivers::UnusableFrames unusable = camera_->unusable();
  if (unusable.count == 0) return {Code::Timeout, "the camera gave no usable frame in time"};
  const bool decoding = unusable.why.starts_with("damaged");
  const std::string came = unusable.count == 1 ? "1 frame" : std::to_string(unusable.count) + " frames";
  return {Code::Protocol, came + " came, none could be " + (decoding ? "decoded: " : "used: ") + unusable.why};
}

bool FrameRequests::anyone_in_motion() const {
  return std::ranges::find(waiting_, LensMotion::Any, &FrameRequest::lens) != waiting_.end();
}

/// When the first frame that can satisfy a request may be ready: exposed wholly after the lens was steady and a caller
/// asked, and where the camera keeps its rate, on the beat of the frames before it. Asking earlier would only fetch
/// frames to throw away.
Instant FrameRequests::EarliestFrame(Instant steady_since) const {
  Instant from = steady_since;
  if (any()) from = std::max(from, std::ranges::min_element(waiting_, {}, &FrameRequest::since)->since);
  const double rate = camera_->capabilities().frame_rate_hz;
  if (!beat_.last_start || !(rate > 0)) return from + beat_.exposure;
  if (*beat_.last_start >= from) return *beat_.last_start + beat_.exposure;
  const auto period = std::chrono::duration<double>(1.0 / rate);
  const double beats = std::ceil((from - *beat_.last_start) / period - 1e-3);
  return *beat_.last_start + std::chrono::duration_cast<Duration>(beats * period) + beat_.exposure;
}

Instant FrameRequests::NextPoll(Instant now, Instant steady_since) const {
  return std::max(now + kPollPeriod, EarliestFrame(steady_since));
}

// ---- for those who look on ----------------------------------------------------------------------------------------

/// Whether a frame may be fetched for those who look on alone: a search must not wait for one that is made for them.
bool FrameRequests::SparesOthers() const {
  return !stream_.kept || !camera_->capabilities().on_demand;
}

bool FrameRequests::IsShown(const Onlooker& onlooker) const {
  return SparesOthers() && (onlooker.viewer.lens == LensMotion::Any || lens_.SteadySince());
}

bool FrameRequests::ViewIsDue(Instant now) const {
  return std::ranges::any_of(
      onlookers_, [&](const Onlooker& onlooker) { return IsShown(onlooker) && now >= onlooker.next + beat_.exposure; });
}

/// On the camera's beat, where it keeps one: to ask in between is work for nothing.
std::optional<Instant> FrameRequests::NextView(Instant now) const {
  if (onlookers_.empty() && !any() && stream_.on && !stream_.kept) return now;  // to end the stream
  std::optional<Instant> next;
  for (const Onlooker& onlooker : onlookers_) {
    if (IsShown(onlooker)) next = std::min(next.value_or(onlooker.next), onlooker.next);
  }
  if (!next) return next;
  const double rate = camera_->capabilities().frame_rate_hz;
  if (beat_.last_start && rate > 0) {
    const std::chrono::duration<double> period(1.0 / rate);
    next = std::max(*next, *beat_.last_start + std::chrono::duration_cast<Duration>(period));
  }
  return std::max(*next + beat_.exposure, now + kPollPeriod);
}

void FrameRequests::Show(const LensedFrame& frame, bool moved) {
  const Instant start = frame.frame.exposure_start;
  std::erase_if(onlookers_, [&](Onlooker& onlooker) {
    const FrameViewer& viewer = onlooker.viewer;
    onlooker.heard = frame.frame.exposure_end;
    // The camera's beat and that of the viewer wander: a frame hardly too early is not worth waiting for another.
    if ((moved && viewer.lens == LensMotion::Standing) || start + viewer.period / 8 < onlooker.next) return false;
    onlooker.next = std::max(onlooker.next, start) + viewer.period;
    return !viewer.show(frame);
  });
}

void FrameRequests::EndLateViews(Instant now) {
  std::erase_if(onlookers_, [&, patience = Patience()](Onlooker& onlooker) {
    const bool asked = IsShown(onlooker) && now >= onlooker.next;
    if (!asked || onlooker.heard == Instant{}) onlooker.heard = now;
    if (now <= onlooker.heard + patience) return false;
    (void)onlooker.viewer.show(PassOn(NoneInTime()));
    return true;
  });
}

// ---- to those who wait --------------------------------------------------------------------------------------------

Duration FrameRequests::Patience() const {
  const double rate = camera_ != nullptr ? camera_->capabilities().frame_rate_hz : 0.0;
  const std::chrono::duration<double> frames(rate > 0.0 ? kSlowFrames / std::max(rate, 0.01) : 0.0);
  return kPatience + beat_.exposure + std::chrono::duration_cast<Duration>(frames);
}

/// The camera is not to blame for a time in which it was not asked, because the machine had no time for this program:
/// after that it has a moment to give its frame.
bool FrameRequests::MayBeLate(Instant now) {
  constexpr Duration kPause = std::chrono::seconds(1);
  if (now - service_.last > kPause) service_.spared_until = now + kPause;
  service_.last = now;
  return now >= service_.spared_until;
}

void FrameRequests::Serve(Instant now) {
  const auto steady = lens_.SteadySince();
  const bool may_be_late = MayBeLate(now);
  const auto late = [&, patience = Patience()](const FrameRequest& request) {
    if (!may_be_late) return false;
    if (request.lens == LensMotion::Any) return now > request.since + patience;
    return steady && now > std::max(request.since, *steady) + patience;
  };
  for (auto& done : TakeIf(late)) {
    replies_.Add(std::move(done), Result<LensedFrame>(PassOn(NoneInTime())));
  }
  if (may_be_late) EndLateViews(now);
  // A frame is judged only once a reading from after its exposure is there.
  if (!frame_ || !lens_.sampled_at() || *lens_.sampled_at() < frame_->exposure_end) return;
  const drivers::Frame frame = *std::exchange(frame_, std::nullopt);
  const bool settled = steady && frame.exposure_start >= *steady;
  if (settled || anyone_in_motion() || !onlookers_.empty()) HandOut(frame, settled);
}

void FrameRequests::HandOut(const drivers::Frame& frame, bool settled) {
  LensedFrame lensed = WithLens(frame);
  bool moved = !settled;
  for (const Axis axis : drivers::kAxes) {
    if (!lensed.axes[axis]) continue;
    lensed.axes[axis]->moving |= !settled;
    moved |= lensed.axes[axis]->moving;
  }
  const auto satisfied = [&](const FrameRequest& request) {
    return request.since <= frame.exposure_start && (!moved || request.lens == LensMotion::Any);
  };
  for (auto& done : TakeIf(satisfied)) replies_.Add(std::move(done), Result<LensedFrame>(lensed));
  Show(lensed, moved);
}

LensedFrame FrameRequests::WithLens(const drivers::Frame& frame) {
  LensedFrame lensed;
  lensed.frame = frame;
  lensed.axes = lens_.history().During(frame.exposure_start, frame.exposure_end);
  for (const Axis axis : drivers::kAxes) {
    auto& during = lensed.axes[axis];
    if (!during) continue;
    const Native bound{axes_[axis]->track().Bound() + axes_[axis]->track().adrift()};
    during->bound = 0.5 * (during->highest - during->lowest) + bound;
    during->mid_bound = during->mid_bound + bound;
  }
  optics_.Describe(lensed);
  if (auto& focus = lensed.axes[Axis::Focus]) {
    // Backlash that was taken up since may still have been there during the exposure.
    const AxisTrack& track = axes_[Axis::Focus]->track();
    const Native bound{track.Bound() + track.adrift()};
    const Native before = std::exchange(handed_out_bound_, bound);
    if (before > bound) focus->mid_bound = focus->mid_bound + (before - bound);
  }
  return lensed;
}

}  // namespace lensd::rig
