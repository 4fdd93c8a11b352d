#include "looks.h"

#include <algorithm>
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
  return done;
}

Result<void> Looks::Poll(Instant now, std::optional<Instant> steady_since, bool keep) {
  if (camera_ == nullptr) return {};
  if (auto streaming = SetStreaming(anyone() || keep); !streaming) return streaming;
  // No frame exposed while the lens is steady can be ready before one exposure has passed.
  if (!anyone() || frame_ || !steady_since || now < *steady_since + exposure_) return {};
  auto polled = camera_->Poll();
  if (!polled) {
    const bool transient = polled.error().code == Code::Timeout || polled.error().code == Code::Protocol;
    if (transient && ++failures_ < kAttempts) return {};
    return PassOn(std::move(polled));
  }
  failures_ = 0;
  frame_ = *std::move(polled);
  if (frame_) exposure_ = frame_->exposure_end - frame_->exposure_start;
  return {};
}

std::vector<SnapshotCallback> Looks::TakeSatisfied(Instant begin) {
  std::vector<SnapshotCallback> satisfied;
  for (Waiting& waiting : waiting_) {
    if (waiting.since <= begin) satisfied.push_back(std::move(waiting.done));
  }
  std::erase_if(waiting_, [&](const Waiting& waiting) { return waiting.since <= begin; });
  return satisfied;
}

std::vector<SnapshotCallback> Looks::TakeExpired(Instant now, std::optional<Instant> steady_since) {
  std::vector<SnapshotCallback> expired;
  if (!steady_since) return expired;
  const auto late = [&](const Waiting& waiting) { return now > std::max(waiting.since, *steady_since) + kPatience; };
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

Instant Looks::NextPoll(Instant now, Instant steady_since) const {
  return std::max(now + kPollPeriod, steady_since + exposure_);
}

}  // namespace lensd::rig
