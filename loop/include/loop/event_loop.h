// The one thread that serves sockets: sd-event, plus work handed over from other threads.
#pragma once

#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include <sys/signalfd.h>
#include <systemd/sd-event.h>

#include "base/clock.h"
#include "base/result.h"

namespace lensd::daemon {

struct EventDeleter {
  void operator()(sd_event* event) const { sd_event_unref(event); }
  void operator()(sd_event_source* source) const { sd_event_source_disable_unref(source); }
};
using EventSource = std::unique_ptr<sd_event_source, EventDeleter>;
using Task = std::move_only_function<void()>;

class Alarm;

/// Runs until Quit(). Everything but Post() belongs to the thread that calls Run().
class EventLoop {
 public:
  /// Code::Io: the kernel refuses a descriptor.
  static Result<std::unique_ptr<EventLoop>> Create();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  sd_event* get() const { return event_.get(); }
  /// From any thread: runs `task` in the loop, in the order of posting. Tasks posted after Run() has returned are
  /// destroyed without running.
  void Post(Task task);
  /// Runs `task` once, that much later, unless the loop has ended by then.
  void After(Duration delay, Task task);
  /// Calls `told` in the loop for each of these signals, which must be blocked in every thread already.
  Result<void> OnSignals(std::initializer_list<int> signals, const std::function<void(int)>& told);
  /// Has `look` look after all that may hang, four times a second, and tells systemd's watchdog, where it asks for
  /// that, that all is well, after `look` has returned: if the loop hangs or `look` throws it is not told. Call it
  /// once.
  void Supervise(std::function<void()> look);
  /// Code::Io: the loop itself failed.
  Result<void> Run();
  void Quit() { sd_event_exit(event_.get(), 0); }

 private:
  EventLoop() = default;
  static int RunSignal(sd_event_source* source, const signalfd_siginfo* signal, void* self);
  static int RunPosted(sd_event_source* source, int descriptor, unsigned revents, void* self);

  std::unique_ptr<sd_event, EventDeleter> event_;
  EventSource wake_source_;
  int wake_descriptor_ = -1;
  std::unique_ptr<Alarm> supervisor_;
  std::map<int, std::function<void(int)>> signals_;
  std::mutex mutex_;
  std::vector<Task> posted_;  // guarded by mutex_
};

/// Runs a task at a time that may be changed before it comes. Event loop thread only; the loop must outlive it.
class Alarm {
 public:
  Alarm(EventLoop& loop, std::function<void()> task);
  Alarm(const Alarm&) = delete;
  Alarm& operator=(const Alarm&) = delete;

  /// Once, at `time` on CLOCK_MONOTONIC or soon after, in place of the time that was set before.
  void Set(Instant time);
  void Off();

 private:
  const std::function<void()> task_;
  EventSource source_;
};

}  // namespace lensd::daemon
