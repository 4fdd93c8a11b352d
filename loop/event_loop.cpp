// sd-event behind callbacks: descriptors, timers, signals, and tasks posted from other threads. Everything runs on the
// loop's thread but Post().
#include "loop/event_loop.h"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <utility>

#include "base/guarded.h"

namespace lensd::daemon {
namespace {

Result<void> Check(int status, const char* what) {
  if (status >= 0) return {};
  return Fail(Code::Io, std::string(what) + ": " + std::strerror(-status));
}

}  // namespace

Result<std::unique_ptr<EventLoop>> EventLoop::Create() {
  std::unique_ptr<EventLoop> loop(new EventLoop);
  sd_event* event = nullptr;
  if (auto made = Check(sd_event_new(&event), "no event loop"); !made) return PassOn(made);
  loop->event_.reset(event);
  loop->wake_descriptor_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (loop->wake_descriptor_ < 0) return Fail(Code::Io, std::string("no eventfd: ") + std::strerror(errno));
  sd_event_source* source = nullptr;
  auto added = Check(sd_event_add_io(event, &source, loop->wake_descriptor_, EPOLLIN, RunPosted, loop.get()),
                     "cannot watch the eventfd");
  if (!added) return PassOn(added);
  loop->wake_source_.reset(source);
  return loop;
}

EventLoop::~EventLoop() {
  supervisor_.reset();
  wake_source_.reset();
  if (wake_descriptor_ >= 0) close(wake_descriptor_);
}

void EventLoop::Post(Task task) {
  bool wake = false;
  {
    const std::lock_guard lock(mutex_);
    wake = posted_.empty();
    posted_.push_back(std::move(task));
  }
  if (!wake) return;
  // The next to post sees that tasks wait, and wakes no thread: were this lost, all of them would wait for ever.
  constexpr int kAttempts = 3;
  const std::uint64_t one = 1;
  for (int i = 0; i < kAttempts && write(wake_descriptor_, &one, sizeof one) < 0; ++i) {
  }
}

int EventLoop::RunPosted(sd_event_source*, int descriptor, unsigned, void* self) {
  std::uint64_t count = 0;
  (void)!read(descriptor, &count, sizeof count);
  auto& loop = *static_cast<EventLoop*>(self);
  std::vector<Task> tasks;
  {
    const std::lock_guard lock(loop.mutex_);
    tasks.swap(loop.posted_);
  }
  for (Task& task : tasks) (void)Guarded("the event loop", task);
  return 0;
}

void EventLoop::After(Duration delay, Task task) {
  const auto run = [](sd_event_source* source, std::uint64_t, void* self) {
    (void)Guarded("the event loop", *static_cast<Task*>(self));
    return sd_event_source_set_floating(source, 0);
  };
  const auto usec = std::chrono::duration_cast<std::chrono::microseconds>(delay).count();
  auto kept = std::make_unique<Task>(std::move(task));
  sd_event_source* source = nullptr;
  if (sd_event_add_time_relative(event_.get(), &source, CLOCK_MONOTONIC, static_cast<std::uint64_t>(usec), 1000, run,
                                 kept.get()) < 0) {
    return;
  }
  sd_event_source_set_destroy_callback(source, [](void* self) { delete static_cast<Task*>(self); });
  (void)kept.release();  // the event source's now
  sd_event_source_set_floating(source, 1);
  sd_event_source_unref(source);
}

Alarm::Alarm(EventLoop& loop, std::function<void()> task) : task_(std::move(task)) {
  const auto run = [](sd_event_source*, std::uint64_t, void* self) {
    (void)Guarded("the event loop", static_cast<Alarm*>(self)->task_);
    return 0;
  };
  sd_event_source* source = nullptr;
  if (sd_event_add_time(loop.get(), &source, CLOCK_MONOTONIC, 0, 1000, run, this) < 0) return;
  source_.reset(source);
  Off();
}

void Alarm::Set(Instant time) {
  if (!source_) return;
  const auto usec = std::chrono::ceil<std::chrono::microseconds>(time.time_since_epoch()).count();
  sd_event_source_set_time(source_.get(), static_cast<std::uint64_t>(usec));
  sd_event_source_set_enabled(source_.get(), SD_EVENT_ONESHOT);
}

void Alarm::Off() {
  if (source_) sd_event_source_set_enabled(source_.get(), SD_EVENT_OFF);
}

void EventLoop::Supervise(std::function<void()> look) {
  static constexpr Duration kPeriod = std::chrono::milliseconds(250);
  std::uint64_t usec = 0;
  const bool watched = sd_watchdog_enabled(0, &usec) > 0;
  // Four times in its time, and no more often: who is told may be slow to listen.
  const Duration pause = std::chrono::microseconds(usec / 4);
  supervisor_ =
      std::make_unique<Alarm>(*this, [this, look = std::move(look), watched, pause, next = Instant{}]() mutable {
        const Instant now = MonotonicClock().Now();
        supervisor_->Set(now + kPeriod);
        look();
        if (!watched || now < next) return;
        sd_notify(0, "WATCHDOG=1");
        next = now + pause;
      });
  supervisor_->Set(MonotonicClock().Now());
}

int EventLoop::RunSignal(sd_event_source*, const signalfd_siginfo* signal, void* self) {
  const int number = static_cast<int>(signal->ssi_signo);
  static_cast<EventLoop*>(self)->signals_.at(number)(number);
  return 0;
}

Result<void> EventLoop::OnSignals(std::initializer_list<int> signals, const std::function<void(int)>& told) {
  for (const int signal : signals) {
    signals_[signal] = told;
    auto added = Check(sd_event_add_signal(event_.get(), nullptr, signal, RunSignal, this), "cannot watch signals");
    if (!added) return added;
  }
  return {};
}

Result<void> EventLoop::Run() {
  return Check(sd_event_loop(event_.get()), "the event loop failed");
}

}  // namespace lensd::daemon
