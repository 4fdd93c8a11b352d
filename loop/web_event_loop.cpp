// Callbacks live as long as their source: sd-event frees a source after its dispatch, so one may end itself.
#include "loop/web_event_loop.h"

#include <signal.h>
#include <sys/epoll.h>

#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <utility>

namespace lensd::web {
namespace {

using Ready = std::function<void(std::uint32_t)>;
using Due = std::function<void()>;

/// Nothing may be thrown through sd-event, which is C: what is thrown ends one callback.
template <class Work>
void Walled(const Work& work) {
  try {
    work();
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "lens-web: internal error: %s\n", failure.what());
  }
}

int RunReady(sd_event_source*, int, std::uint32_t events, void* self) {
  Walled([&] { (*static_cast<Ready*>(self))(events); });
  return 0;
}

int RunDue(sd_event_source*, std::uint64_t, void* self) {
  Walled([&] { (*static_cast<Due*>(self))(); });
  return 0;
}

int RunSoon(sd_event_source*, void* self) {
  Walled([&] { (*static_cast<Due*>(self))(); });
  return 0;
}

template <class Function>
Watch Keep(int status, sd_event_source* source, std::unique_ptr<Function> function) {
  if (status < 0) return nullptr;
  sd_event_source_set_destroy_callback(source, [](void* self) { delete static_cast<Function*>(self); });
  (void)function.release();
  return Watch(source);
}

Result<void> Checked(int status, const char* what) {
  if (status >= 0) return {};
  return Fail(Code::Io, std::string(what) + ": " + std::strerror(-status));
}

}  // namespace

Result<std::unique_ptr<EventLoop>> EventLoop::Create() {
  std::unique_ptr<EventLoop> loop(new EventLoop);
  sd_event* event = nullptr;
  if (auto made = Checked(sd_event_new(&event), "no event loop"); !made) return PassOn(made);
  loop->event_.reset(event);
  return loop;
}

Watch EventLoop::OnDescriptor(int descriptor, std::uint32_t events, Ready ready) {
  auto function = std::make_unique<Ready>(std::move(ready));
  sd_event_source* source = nullptr;
  const int status = sd_event_add_io(event_.get(), &source, descriptor, events, RunReady, function.get());
  return Keep(status, source, std::move(function));
}

Watch EventLoop::Soon(Due due) {
  auto function = std::make_unique<Due>(std::move(due));
  sd_event_source* source = nullptr;
  const int status = sd_event_add_defer(event_.get(), &source, RunSoon, function.get());
  return Keep(status, source, std::move(function));
}

Watch EventLoop::After(Duration delay, Due due) {
  auto function = std::make_unique<Due>(std::move(due));
  const auto usec = std::chrono::ceil<std::chrono::microseconds>(delay).count();
  sd_event_source* source = nullptr;
  const int status = sd_event_add_time_relative(event_.get(), &source, CLOCK_MONOTONIC,
                                                static_cast<std::uint64_t>(usec), 1000, RunDue, function.get());
  return Keep(status, source, std::move(function));
}

Result<void> EventLoop::QuitOnSignals() {
  for (const int signal : {SIGTERM, SIGINT}) {
    auto added = Checked(sd_event_add_signal(event_.get(), nullptr, signal, nullptr, nullptr), "cannot watch signals");
    if (!added) return added;
  }
  return {};
}

Result<void> EventLoop::Run() {
  return Checked(sd_event_loop(event_.get()), "the event loop failed");
}

}  // namespace lensd::web
