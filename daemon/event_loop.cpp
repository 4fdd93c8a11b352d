#include "event_loop.h"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstring>
#include <utility>

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
  if (auto made = Check(sd_event_new(&event), "no event loop"); !made) return PassOn(std::move(made));
  loop->event_.reset(event);
  loop->wake_descriptor_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (loop->wake_descriptor_ < 0) return Fail(Code::Io, std::string("no eventfd: ") + std::strerror(errno));
  sd_event_source* source = nullptr;
  auto added = Check(sd_event_add_io(event, &source, loop->wake_descriptor_, EPOLLIN, RunPosted, loop.get()),
                     "cannot watch the eventfd");
  if (!added) return PassOn(std::move(added));
  loop->wake_source_.reset(source);
  return loop;
}

EventLoop::~EventLoop() {
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
  const std::uint64_t one = 1;
  if (wake) (void)!write(wake_descriptor_, &one, sizeof one);
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
  for (Task& task : tasks) task();
  return 0;
}

Result<void> EventLoop::QuitOnSignals() {
  for (const int signal : {SIGTERM, SIGINT}) {
    // Without a handler sd-event ends the loop, as wanted.
    auto added = Check(sd_event_add_signal(event_.get(), nullptr, signal, nullptr, nullptr), "cannot watch signals");
    if (!added) return added;
  }
  return {};
}

Result<void> EventLoop::Run() {
  return Check(sd_event_loop(event_.get()), "the event loop failed");
}

}  // namespace lensd::daemon
