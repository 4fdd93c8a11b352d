// The thread of one rig: commands in, steps, what happened out; and an end in order, whatever the rig throws.
#include "worker.h"

#include <algorithm>
#include <utility>

#include "barrier.h"

namespace lensd::daemon {
namespace {

/// How long a lens may take to stand still before it is closed.
constexpr Duration kRestAtMost = std::chrono::milliseconds(500);

bool AnyMoving(const rig::Status& status) {
  return status.connected && std::ranges::any_of(drivers::kAxes, [&](drivers::Axis axis) {
           return status.axes[axis] && status.axes[axis]->moving;
         });
}

}  // namespace

Worker::Worker(std::unique_ptr<rig::Rig> rig, const Clock& clock, std::shared_ptr<StopSignal> stops, Listener listener)
    : rig_(std::move(rig)), clock_(clock), stops_(std::move(stops)), listener_(std::move(listener)) {
  thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

Worker::~Worker() {
  End();
  thread_.join();
}

void Worker::End() {
  const std::lock_guard lock(mutex_);
  if (ended_) return;
  thread_.request_stop();
  rig_->Interrupt();
}

bool Worker::full() {
  const std::lock_guard lock(mutex_);
  return waiting_.commands.size() >= kMostCommands;
}

bool Worker::Submit(Command command) {
  {
    const std::lock_guard lock(mutex_);
    if (ended_ || waiting_.commands.size() >= kMostCommands) return false;
    waiting_.commands.push_back(std::move(command));
  }
  wake_.notify_one();
  return true;
}

void Worker::SubmitStop(Command command) {
  {
    const std::lock_guard lock(mutex_);
    if (ended_) return;
    stops_->Raise();
    ++waiting_.stops;
    waiting_.commands.push_back(std::move(command));
    rig_->CutReadingShort();
  }
  wake_.notify_one();
}

Worker::Batch Worker::Wait(const std::stop_token& stop, Instant wake) {
  std::unique_lock lock(mutex_);
  wake_.wait_until(lock, stop, wake, [this] { return !waiting_.commands.empty(); });
  return std::exchange(waiting_, {});
}

void Worker::Serve(const std::stop_token& stop) {
  Instant wake = clock_.Now();
  while (!stop.stop_requested()) {
    Batch batch = Wait(stop, wake);
    for (Command& command : batch.commands) command(*rig_);
    wake = rig_->Step(clock_.Now());
    listener_.published(rig_->GetStatus(), std::exchange(later_, {}));
    // Only now: nothing that the step was to wait for came before the stop.
    if (batch.stops > 0) stops_->Lower(batch.stops);
  }
}

void Worker::ComeToRest() {
  const Instant deadline = clock_.Now() + kRestAtMost;
  rig_->Stop({}, [](const Result<void>&) {});
  Instant wake = rig_->Step(clock_.Now());
  while (AnyMoving(rig_->GetStatus()) && clock_.Now() < deadline) {
    std::this_thread::sleep_until(std::min(wake, deadline));
    wake = rig_->Step(clock_.Now());
  }
}

void Worker::Run(const std::stop_token& stop) {
  auto why = Guarded("the worker of this lens", [&] {
    Serve(stop);
    if (AnyMoving(rig_->GetStatus())) ComeToRest();
  });
  Batch never_taken;
  std::unique_ptr<rig::Rig> gone;
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    never_taken = std::exchange(waiting_, {});
    gone = std::move(rig_);
  }
  auto worse = Guarded("the end of this lens", [&] { gone.reset(); });
  never_taken = {};
  listener_.ended(std::exchange(later_, {}), why ? why : worse);
}

}  // namespace lensd::daemon
