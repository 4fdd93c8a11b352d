// One thread that renders frames, so that a poll never waits for a renderer. At most one frame is under way; a newer
// one replaces it.
#include "sim/camera/darkroom.h"

#include <utility>

namespace lensd::sim {

Darkroom::~Darkroom() {
  Cancel();
}

bool Darkroom::busy() const {
  barrier_.Check();
  const std::lock_guard lock(mutex_);
  return next_ || done_ || (under_way_ && !under_way_->stop_requested());
}

void Darkroom::Submit(Shot shot) {
  if (!thread_.joinable()) thread_ = std::jthread([this](const std::stop_token& end) { Work(end); });
  {
    const std::lock_guard lock(mutex_);
    next_ = std::move(shot);
  }
  wake_.notify_one();
}

std::optional<Darkroom::Developed> Darkroom::Take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(done_, std::nullopt);
}

void Darkroom::Cancel() {
  const std::lock_guard lock(mutex_);
  next_.reset();
  done_.reset();
  if (under_way_) under_way_->request_stop();
}

void Darkroom::Work(const std::stop_token& end) {
  for (;;) {
    Shot shot;
    std::stop_token stop;
    {
      std::unique_lock lock(mutex_);
      if (!wake_.wait(lock, end, [this] { return next_.has_value(); })) return;
      shot = *std::exchange(next_, std::nullopt);
      stop = under_way_.emplace().get_token();
    }
    barrier_.Run([&] { Develop(shot, stop); });
    const std::lock_guard lock(mutex_);
    under_way_.reset();
  }
}

void Darkroom::Develop(const Shot& shot, const std::stop_token& stop) {
  Result<Samples> samples = maker_.Make(shot, stop);
  const std::lock_guard lock(mutex_);
  if (!stop.stop_requested()) done_.emplace(shot.exposure, std::move(samples));
}

}  // namespace lensd::sim
