#include "worker.h"

#include <utility>

namespace lensd::daemon {

Worker::Worker(std::unique_ptr<rig::Rig> rig, const Clock& clock, Publish publish)
    : rig_(std::move(rig)), clock_(clock), publish_(std::move(publish)) {
  thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

Worker::~Worker() {
  thread_.request_stop();
  rig_->Interrupt();
  thread_.join();
}

void Worker::Submit(Command command) {
  {
    const std::lock_guard lock(mutex_);
    commands_.push_back(std::move(command));
  }
  wake_.notify_one();
}

std::vector<Worker::Command> Worker::Wait(const std::stop_token& stop, Instant wake) {
  std::unique_lock lock(mutex_);
  wake_.wait_until(lock, stop, wake, [this] { return !commands_.empty(); });
  return std::exchange(commands_, {});
}

void Worker::Run(const std::stop_token& stop) {
  Instant wake = clock_.Now();
  while (!stop.stop_requested()) {
    for (Command& command : Wait(stop, wake)) command(*rig_);
    wake = rig_->Step(clock_.Now());
    publish_(rig_->GetStatus(), std::exchange(later_, {}));
  }
}

}  // namespace lensd::daemon
