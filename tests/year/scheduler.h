// The threads of the machine, of which one runs; for interposed.cpp.
#pragma once

#include <pthread.h>

#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "machine.h"

namespace lensd::year::machine {

struct Thread {
  std::uint64_t number = 0;
  std::atomic<int> baton{0};  ///< 1: it may run
  pthread_t handle{};
  void* (*routine)(void*) = nullptr;
  void* argument = nullptr;
  void* result = nullptr;
  bool ended = false;
  const void* waits_for = nullptr;  ///< null: it can run
  std::int64_t wake = kNever;
  int epoll = -1;  ///< it waits for descriptors of this set
  bool timed_out = false;
};

/// What of the calls of libc has to wait. One thread at a time is in it: the one that runs.
class Scheduler {
 public:
  static Scheduler* Get();  ///< null: before Begin()

  explicit Scheduler(std::uint64_t seed);

  /// True: woken; false: the time came first. `key` is any address.
  bool Wait(const void* key, std::int64_t until);
  void WakeAll(const void* key);
  void WakeOne(const void* key);
  /// Until the set has something, or the time comes.
  void WaitForEpoll(int epoll, std::int64_t until);
  void Yield();
  /// Descriptors may be ready that were not.
  void Stir() { stirred_ = true; }

  int Create(pthread_t* handle, const pthread_attr_t* attributes, void* (*routine)(void*), void* argument);
  void Join(pthread_t handle, void** result);
  void Detach(pthread_t handle);
  void End(Thread& self);
  [[noreturn]] void Vanish();
  void KillOthers();
  Thread& running() const { return *running_; }

  std::int64_t now = kSecond;
  std::int64_t wall_ahead = 1'700'000'000 * kSecond;
  std::uint64_t steps = 0;
  bool kill_requested = false;
  int contended = 0;  ///< threads that wait for a mutex
  Chance chance;
  std::deque<Peer> peers;
  std::map<int, Peer> accepted;
  std::map<int, std::int64_t> timers;  ///< when they go off, by descriptor

 private:
  void Switch();
  Thread& Choose();
  void LookAtDescriptors();
  std::size_t ReleaseDue();
  void PassTime();
  void RingTimers();
  void HandTo(Thread& next);

  std::vector<std::shared_ptr<Thread>> threads_;
  Thread* running_ = nullptr;
  bool stirred_ = false;
};

/// The thread that calls.
Thread& Self();
void WaitForBaton(Thread& self);

/// The functions of libc behind ours.
struct Libc {
  int (*create)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  int (*join)(pthread_t, void**);
  int (*detach)(pthread_t);
  int (*lock)(pthread_mutex_t*);
  int (*trylock)(pthread_mutex_t*);
  int (*unlock)(pthread_mutex_t*);
  long (*call)(long, ...);
};
const Libc& Real();

}  // namespace lensd::year::machine
