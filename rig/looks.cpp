#include "looks.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lensd::rig {
namespace {

constexpr Duration kPollPeriod = std::chrono::milliseconds(2);
constexpr int kAttempts = 3;
constexpr Duration kPatience = std::chrono::seconds(5);

}  // namespace

void Looks::ForgetAutofocus() {
  std::erase_if(waiting_, [](const Waiting& waiting) { return waiting.for_autofocus; });
}

Result<void> Looks::SetStreaming(bool wanted) {
  if (wanted == streaming_) return {};
  auto done = wanted ? camera_->Start() : camera_->Stop();
  streaming_ = wanted && done;
  last_start_.reset();
  return done;
}

Result<void> Looks::Poll(Instant now, std::optional<Instant> steady_since, bool keep) {
  if (camera_ == nullptr) return {};
  if (auto streaming = SetStreaming(anyone() || keep); !streaming) return streaming;
  if (!anyone() || frame_ || !MayPoll(now, steady_since)) return {};
  auto polled = camera_->Poll();
  if (!polled) {
    const bool transient = polled.error().code == Code::Timeout || polled.error().code == Code::Protocol;
    if (transient && ++failures_ < kAttempts) return {};
    return PassOn(std::move(polled));
  }
  failures_ = 0;
  frame_ = *std::move(polled);
  if (frame_) {
    exposure_ = frame_->exposure_end - frame_->exposure_start;
    last_start_ = frame_->exposure_start;
  }
  return {};
}

bool Looks::anyone_in_motion() const {
  return std::ranges::any_of(waiting_, &Waiting::in_motion_too);
}

/// In motion every frame may be wanted, so none is waited for.
bool Looks::MayPoll(Instant now, std::optional<Instant> steady_since) const {
  return anyone_in_motion() || (steady_since && now >= EarliestFrame(*steady_since));
}

std::vector<SnapshotCallback> Looks::TakeSatisfied(Instant begin, bool moved) {
  const auto satisfies = [&](const Waiting& waiting) {
    return waiting.since <= begin && (!moved || waiting.in_motion_too);
  };
  std::vector<SnapshotCallback> satisfied;
  for (Waiting& waiting : waiting_) {
    if (satisfies(waiting)) satisfied.push_back(std::move(waiting.done));
  }
  std::erase_if(waiting_, satisfies);
  return satisfied;
}

std::vector<SnapshotCallback> Looks::TakeExpired(Instant now, std::optional<Instant> steady_since) {
  std::vector<SnapshotCallback> expired;
  const auto late = [&](const Waiting& waiting) {
    if (waiting.in_motion_too) return now > waiting.since + kPatience;
    return steady_since && now > std::max(waiting.since, *steady_since) + kPatience;
  };
  for (Waiting& waiting : waiting_) {
    if (late(waiting)) expired.push_back(std::move(waiting.done));
  }
  std::erase_if(waiting_, late);
  return expired;
}

std::vector<SnapshotCallback> Looks::TakeAll() {
  std::vector<SnapshotCallback> all;
  for (Waiting& waiting : std::exchange(waiting_, {})) all.push_back(std::move(waiting.done));
  return all;
}

/// When the first frame that can satisfy anybody may be ready: exposed wholly after the lens became steady and somebody
/// asked, and where the camera keeps its rate, on the beat of the frames before it. Asking earlier would only fetch
/// frames to throw away.
Instant Looks::EarliestFrame(Instant steady_since) const {
  Instant from = steady_since;
  if (anyone()) from = std::max(from, std::ranges::min_element(waiting_, {}, &Waiting::since)->since);
  const double rate = camera_->capabilities().frame_rate_hz;
  if (!last_start_ || !(rate > 0)) return from + exposure_;
  if (*last_start_ >= from) return *last_start_ + exposure_;
  const auto period = std::chrono::duration<double>(1.0 / rate);
  const double beats = std::ceil((from - *last_start_) / period - 1e-3);
  return *last_start_ + std::chrono::duration_cast<Duration>(beats * period) + exposure_;
}

Instant Looks::NextPoll(Instant now, Instant steady_since) const {
  return std::max(now + kPollPeriod, EarliestFrame(steady_since));
}

}  // namespace lensd::rig
