// One thread runs at a time; whoever waits hands on to one that can run, drawn from the seed. Where none can, time
// passes to the next instant that one waits for.
#include "scheduler.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace lensd::year {

double Chance::Pause(double mean) {
  return -mean * std::log1p(-Unit());
}

namespace machine {
namespace {

Scheduler* scheduler = nullptr;
thread_local Thread* t_self = nullptr;
pthread_key_t at_end;
std::function<std::string()> told_where;
std::uint64_t trace_hash = 0xcbf29ce484222325ULL;
std::FILE* trace_file = nullptr;
int first_of_ours = 3;  ///< descriptors below it were there before

constexpr std::uint64_t kMostStepsAtOneInstant = 2'000'000;

/// What a thread waits for that never comes.
const char kNothing = 0;
/// What the first thread waits for besides its descriptors.
const char kEpoll = 0;

void Futex(std::atomic<int>& word, int operation, int value) {
  Real().call(SYS_futex, reinterpret_cast<int*>(&word), operation | FUTEX_PRIVATE_FLAG, value, nullptr, nullptr, 0);
}

/// Thread-local objects of the product are destroyed while the thread still runs alone: this comes after them.
void AtEnd(void* self) {
  scheduler->End(*static_cast<Thread*>(self));
}

void* Run(void* argument) {
  t_self = static_cast<Thread*>(argument);
  WaitForBaton(*t_self);
  pthread_setspecific(at_end, t_self);
  t_self->result = t_self->routine(t_self->argument);
  return t_self->result;
}

template <class Function>
void Find(Function& function, const char* name) {
  function = reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

const Libc& Real() {
  static const Libc libc = [] {
    Libc found{};
    Find(found.create, "pthread_create");
    Find(found.join, "pthread_join");
    Find(found.detach, "pthread_detach");
    Find(found.lock, "pthread_mutex_lock");
    Find(found.trylock, "pthread_mutex_trylock");
    Find(found.unlock, "pthread_mutex_unlock");
    Find(found.call, "syscall");
    return found;
  }();
  return libc;
}

Thread& Self() {
  return *t_self;
}

void WaitForBaton(Thread& self) {
  while (self.baton.exchange(0) == 0) Futex(self.baton, FUTEX_WAIT, 0);
}

Scheduler* Scheduler::Get() {
  return t_self == nullptr ? nullptr : scheduler;
}

Scheduler::Scheduler(std::uint64_t seed) : chance(seed) {
  auto first = std::make_shared<Thread>();
  first->handle = pthread_self();
  running_ = first.get();
  threads_.push_back(std::move(first));
}

bool Scheduler::Wait(const void* key, std::int64_t until) {
  Thread& self = *running_;
  self.waits_for = key;
  self.wake = until;
  self.timed_out = false;
  Switch();
  return !self.timed_out;
}

void Scheduler::WakeAll(const void* key) {
  for (const auto& thread : threads_) {
    if (thread->waits_for == key) thread->waits_for = nullptr;
  }
}

void Scheduler::WakeOne(const void* key) {
  std::vector<Thread*> waiting;
  for (const auto& thread : threads_) {
    if (thread->waits_for == key) waiting.push_back(thread.get());
  }
  if (!waiting.empty()) waiting[chance.Below(waiting.size())]->waits_for = nullptr;
}

void Scheduler::WaitForEpoll(int epoll, std::int64_t until) {
  running_->epoll = epoll;
  stirred_ = true;  // what came before this call counts
  Wait(&kEpoll, until);
  running_->epoll = -1;
}

void Scheduler::Yield() {
  now += 1000;  // who asks again and again sees time pass
  Switch();
}

void Scheduler::HandTo(Thread& next) {
  running_ = &next;
  next.baton = 1;
  Futex(next.baton, FUTEX_WAKE, 1);
}

void Scheduler::Switch() {
  Thread& self = *running_;
  Thread& next = Choose();
  if (&next == &self) return;
  HandTo(next);
  WaitForBaton(self);
}

Thread& Scheduler::Choose() {
  static std::uint64_t last_instant_step = 0;
  static std::int64_t last_instant = 0;
  for (;;) {
    RingTimers();
    if (std::exchange(stirred_, false)) LookAtDescriptors();
    const std::size_t able = ReleaseDue();
    if (able == 0) {
      PassTime();
      continue;
    }
    ++steps;
    if (now / 1'000'000 != last_instant) {
      last_instant = now / 1'000'000;
      last_instant_step = steps;
    } else if (steps - last_instant_step > kMostStepsAtOneInstant) {
      Found("time does not pass: threads wake each other without end");
    }
    std::size_t which = able == 1 ? 0 : chance.Below(able);
    for (const auto& thread : threads_) {
      if (thread->waits_for == nullptr && which-- == 0) return *thread;
    }
  }
}

void Scheduler::LookAtDescriptors() {
  for (const auto& thread : threads_) {
    if (thread->epoll < 0 || thread->waits_for == nullptr) continue;
    pollfd set{thread->epoll, POLLIN, 0};
    if (poll(&set, 1, 0) > 0) thread->waits_for = nullptr;
  }
}

/// Those whose time has come need wait no more. How many can run.
std::size_t Scheduler::ReleaseDue() {
  std::size_t able = 0;
  for (const auto& thread : threads_) {
    if (thread->waits_for != nullptr && thread->wake <= now) {
      thread->waits_for = nullptr;
      thread->timed_out = true;
    }
    able += thread->waits_for == nullptr ? 1 : 0;
  }
  return able;
}

void Scheduler::PassTime() {
  std::int64_t next = kNever;
  for (const auto& thread : threads_) next = std::min(next, thread->wake);
  for (const auto& [unused, at] : timers) next = std::min(next, at);
  if (next == kNever) Found("every thread waits, for nothing that will ever come");
  now = std::max(now, next);
}

void Scheduler::RingTimers() {
  for (auto& [descriptor, at] : timers) {
    if (at > now) continue;
    at = kNever;
    const std::uint64_t once = 1;
    (void)!Real().call(SYS_write, descriptor, &once, sizeof once);
    stirred_ = true;
  }
}

int Scheduler::Create(pthread_t* handle, const pthread_attr_t*, void* (*routine)(void*), void* argument) {
  static std::uint64_t count = 0;
  auto thread = std::make_shared<Thread>();
  thread->number = ++count;
  thread->routine = routine;
  thread->argument = argument;
  pthread_attr_t small;
  pthread_attr_init(&small);
  pthread_attr_setstacksize(&small, std::size_t{1} << 20);  // many lives leave theirs behind
  const int status = Real().create(&thread->handle, &small, Run, thread.get());
  pthread_attr_destroy(&small);
  if (status != 0) return status;
  *handle = thread->handle;
  threads_.push_back(std::move(thread));
  return 0;
}

void Scheduler::Join(pthread_t handle, void** result) {
  const auto found = std::ranges::find_if(threads_, [&](const auto& thread) { return thread->handle == handle; });
  if (found == threads_.end()) Found("a thread is joined that is none");
  // NOLINTNEXTLINE(performance-unnecessary-copy-initialization): other threads change the list meanwhile.
  const std::shared_ptr<Thread> thread = *found;
  while (!thread->ended) Wait(thread.get(), kNever);
  Real().join(handle, result);
  std::erase(threads_, thread);
}

void Scheduler::Detach(pthread_t handle) {
  Real().detach(handle);
}

void Scheduler::End(Thread& self) {
  self.ended = true;
  self.waits_for = &kNothing;
  self.wake = kNever;
  WakeAll(&self);
  HandTo(Choose());
}

void Scheduler::Vanish() {
  for (;;) Wait(&kNothing, kNever);
}

void Scheduler::KillOthers() {
  // Their memory stays, as what they point at does: nothing of theirs runs again.
  static std::vector<std::shared_ptr<Thread>> dead;
  for (auto& thread : threads_) {
    if (thread.get() != running_) dead.push_back(std::move(thread));
  }
  std::erase(threads_, nullptr);
  timers.clear();
  accepted.clear();
  peers.clear();
  contended = 0;
  kill_requested = false;
}

// ---- for the tests -------------------------------------------------------------------------------------------------

void OnFound(std::function<std::string()> where) {
  told_where = std::move(where);
}

void Found(const std::string& what) {
  std::fprintf(stderr, "year: FOUND: %s\n%s\n", what.c_str(), told_where ? told_where().c_str() : "");
  if (trace_file != nullptr) std::fflush(trace_file);
  std::fflush(stderr);
  _exit(1);
}

void Begin(std::uint64_t seed) {
  (void)Real();
  pthread_key_create(&at_end, AtEnd);
  static Scheduler made(seed);
  scheduler = &made;
  t_self = &made.running();
  for (int descriptor = 0; descriptor < 64; ++descriptor) {
    if (fcntl(descriptor, F_GETFD) >= 0) first_of_ours = descriptor + 1;
  }
}

std::int64_t Now() {
  return scheduler->now;
}
std::uint64_t Steps() {
  return scheduler == nullptr ? 0 : scheduler->steps;
}
std::uint64_t TraceHash() {
  return trace_hash;
}

void TraceTo(const std::string& path) {
  trace_file = std::fopen(path.c_str(), "w");
}

void Trace(std::string_view what) {
  const auto add = [](std::string_view bytes) {
    for (const char c : bytes) trace_hash = (trace_hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  };
  const std::string at = std::to_string(scheduler->now) + " " + std::to_string(scheduler->steps) + " ";
  add(at);
  add(what);
  if (trace_file != nullptr)
    std::fprintf(trace_file, "%s%.*s\n", at.c_str(), static_cast<int>(what.size()), what.data());
}

void WaitForSockets(int epoll, std::int64_t until) {
  if (!scheduler->kill_requested) scheduler->WaitForEpoll(epoll, until);
}

void JumpWallClock(std::int64_t by) {
  scheduler->wall_ahead += by;
}

void Sleep(std::int64_t ns) {
  scheduler->Wait(&kNothing, scheduler->now + ns);
}

void NextPeer(const Peer& peer) {
  scheduler->peers.push_back(peer);
}

void StopHere() {
  scheduler->kill_requested = true;
  scheduler->WakeAll(&kEpoll);
  scheduler->Vanish();
}

bool KillRequested() {
  return scheduler->kill_requested;
}

void Kill(const std::function<bool(int)>& kept) {
  scheduler->KillOthers();
  constexpr int kMost = 2048;
  for (int descriptor = first_of_ours; descriptor < kMost; ++descriptor) {
    if (!kept(descriptor)) Real().call(SYS_close, descriptor);
  }
}

}  // namespace machine
}  // namespace lensd::year
