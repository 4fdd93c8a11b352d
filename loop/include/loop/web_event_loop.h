// The one thread of lens-web: sd-event behind callbacks.
#pragma once

#include <systemd/sd-event.h>

#include <cstdint>
#include <functional>
#include <memory>

#include "base/clock.h"
#include "base/result.h"

namespace lensd::web {

struct EventUnref {
  void operator()(sd_event* event) const { sd_event_unref(event); }
  void operator()(sd_event_source* source) const { sd_event_source_disable_unref(source); }
};
/// What is watched for as long as it is held; it may be let go of in its own callback.
using Watch = std::unique_ptr<sd_event_source, EventUnref>;

/// Runs until Quit(). All of it belongs to one thread.
class EventLoop {
 public:
  /// Code::Io: the kernel refuses a descriptor.
  static Result<std::unique_ptr<EventLoop>> Create();

  /// Calls `ready` with the events of epoll that came. Null where the kernel refuses.
  Watch OnDescriptor(int descriptor, std::uint32_t events, std::function<void(std::uint32_t)> ready);
  /// Calls `due` once, before the loop sleeps again.
  Watch Soon(std::function<void()> due);
  /// Calls `due` once, that much later.
  Watch After(Duration delay, std::function<void()> due);
  /// Ends Run() at SIGTERM and SIGINT, which must be blocked already.
  Result<void> QuitOnSignals();
  /// Code::Io: the loop itself failed.
  Result<void> Run();
  void Quit() { sd_event_exit(event_.get(), 0); }

 private:
  EventLoop() = default;
  std::unique_ptr<sd_event, EventUnref> event_;
};

}  // namespace lensd::web
