// The thread of one rig: commands in, steps, what happened out; and an end in order, whatever the rig throws.
#include "daemon/lens/worker.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "base/guarded.h"
#include "drivers/api/thread_barrier.h"

namespace lensd::daemon {
namespace {

/// How long a lens may take to stand still before it is closed: a motor is stopped as soon as a silent device answers,
/// and whether one stands that was just commanded shows only after half a second. lensd itself waits a little longer
/// (main.cpp).
constexpr Duration kRestAtMost = std::chrono::milliseconds(2500);
/// How long its positions may take to get to the disk after that. When lensd ends it may be over before.
constexpr Duration kKeptAtMost = std::chrono::seconds(12);

/// The worker whose thread this is.
thread_local Worker* t_here = nullptr;

bool AnyMoving(const rig::Status& status) {
  return status.connected && std::ranges::any_of(drivers::kAxes, [&](drivers::Axis axis) {
           return status.axes[axis] && status.axes[axis]->moving;
         });
}

}  // namespace

bool PositionsWait(const rig::Status& status) {
  return status.connected && (status.unkept || status.in_motion_on_disk);
}

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
  if (state_.ended) return;
  thread_.request_stop();
  rig_->Interrupt();
}

void Worker::Abandon() {
  Batch never_taken;
  {
    const std::lock_guard publishing(publishing_);
    abandoned_ = true;
  }
  const std::lock_guard lock(mutex_);
  state_.ended = true;
  never_taken = std::exchange(state_.waiting, {});
  thread_.request_stop();
  if (rig_) rig_->Interrupt();
}

bool Worker::full() {
  const std::lock_guard lock(mutex_);
  return state_.waiting.commands.size() >= kMostCommands;
}

std::optional<Instant> Worker::busy_since() {
  const std::lock_guard lock(mutex_);
  return state_.busy_since;
}

void Worker::Later(Task task) {
  t_here->later_.push_back(std::move(task));
}

bool Worker::Submit(Command command) {
  {
    const std::lock_guard lock(mutex_);
    if (state_.ended || state_.waiting.commands.size() >= kMostCommands) return false;
    state_.waiting.commands.push_back(std::move(command));
  }
  wake_.notify_one();
  return true;
}

void Worker::SubmitStop(Command command) {
  {
    const std::lock_guard lock(mutex_);
    if (state_.ended) return;
    stops_->Raise();
    ++state_.waiting.stops;
    state_.waiting.commands.push_back(std::move(command));
    rig_->CutReadingShort();
  }
  wake_.notify_one();
}

Worker::Batch Worker::Wait(const std::stop_token& stop, Instant wake) {
  std::unique_lock lock(mutex_);
  state_.busy_since.reset();
  wake_.wait_until(lock, stop, wake, [this] { return !state_.waiting.commands.empty(); });
  state_.busy_since = clock_.Now();
  return std::exchange(state_.waiting, {});
}

void Worker::Serve(const std::stop_token& stop) {
  Instant wake = clock_.Now();
  while (!stop.stop_requested()) {
    Batch batch = Wait(stop, wake);
    for (Command& command : batch.commands) {
      if (!stop.stop_requested()) command(*rig_);
    }
    wake = rig_->Step(clock_.Now());
    Publish();
    // Only now: nothing that the step was to wait for came before the stop.
    if (batch.stops > 0) stops_->Lower(batch.stops);
  }
}

void Worker::Publish() {
  const std::lock_guard publishing(publishing_);
  if (!abandoned_) listener_.published(rig_->GetStatus(), std::exchange(later_, {}));
}

void Worker::ComeToRest() {
  const Instant latest = clock_.Now() + kKeptAtMost;
  Instant deadline = clock_.Now() + kRestAtMost;
  const auto waits = [&](const rig::Status& status) {
    return AnyMoving(status) ? clock_.Now() < deadline : PositionsWait(status) && clock_.Now() < latest;
  };
  rig_->Stop({}, [](const Result<void>&) {});
  Instant wake = clock_.Now();
  do {
    std::this_thread::sleep_until(std::min(wake, AnyMoving(rig_->GetStatus()) ? deadline : latest));
    const Instant before = clock_.Now();
    wake = rig_->Step(before);
    Publish();
    deadline = std::min(latest, deadline + (clock_.Now() - before));  // a slow disk takes none of the lens' time
  } while (waits(rig_->GetStatus()));
}

void Worker::Run(const std::stop_token& stop) {
  t_here = this;
  auto why = Guarded("the worker of this lens", [&] {
    Serve(stop);
    const rig::Status status = rig_->GetStatus();
    if (AnyMoving(status) || PositionsWait(status)) ComeToRest();
  });
  Batch never_taken;
  std::unique_ptr<rig::Rig> gone;
  {
    const std::lock_guard lock(mutex_);
    state_.ended = true;
    never_taken = std::exchange(state_.waiting, {});
    gone = std::move(rig_);
  }
  auto worse = Guarded("the end of this lens", [&] {
    gone.reset();
    if (const auto contained = drivers::TakeContained()) throw std::runtime_error(*contained);
  });
  never_taken = {};
  listener_.ended(std::exchange(later_, {}), why ? why : worse);
  const std::lock_guard lock(mutex_);
  state_.busy_since.reset();
}

}  // namespace lensd::daemon
