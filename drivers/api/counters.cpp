// Gaps in the numbers of frames are losses, gaps in their times are delays.
#include "drivers/api/counters.h"

namespace lensd::drivers {
namespace {

constexpr double kLatePeriods = 1.0;  ///< the frame after it is due by then; less than that, resends cost every day

}  // namespace

FrameCounter::FrameCounter(double rate_hz) : rate_hz_(rate_hz) {}

void FrameCounter::Restart() {
  const std::lock_guard lock(mutex_);
  last_.reset();
}

void FrameCounter::Came(std::uint64_t sequence, Instant at) {
  const std::lock_guard lock(mutex_);
  ++counts_.frames;
  if (last_ && sequence > last_->sequence) {
    const std::uint64_t steps = sequence - last_->sequence;
    counts_.frames_lost += steps - 1;
    const double periods = std::chrono::duration<double>(at - last_->at).count() * rate_hz_;
    if (rate_hz_ > 0.0 && periods > static_cast<double>(steps) + kLatePeriods) ++counts_.frames_late;
  }
  last_ = {sequence, at};
}

void FrameCounter::Damaged(std::uint64_t sequence, Instant at) {
  const std::lock_guard lock(mutex_);
  ++counts_.frames_damaged;
  ++counts_.frames_lost;
  if (last_ && sequence <= last_->sequence) return;
  if (last_) counts_.frames_lost += sequence - last_->sequence - 1;
  last_ = {sequence, at};
}

void FrameCounter::Flawed() {
  const std::lock_guard lock(mutex_);
  ++counts_.frames_flawed;
}

void FrameCounter::CountPackets(std::uint64_t lost, std::uint64_t resent) {
  const std::lock_guard lock(mutex_);
  counts_.packets_lost += lost;
  counts_.packets_resent += resent;
}

Counters FrameCounter::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace lensd::drivers
