// The functions of libc that wait, tell the time, or draw at random, in the machine's place: the linker prefers those
// of a program to those of its libraries, so that lensd's code, libstdc++ and sd-event call these.
#include <dlfcn.h>
#include <errno.h>
#include <linux/futex.h>
#include <pthread.h>
#include <sched.h>
#include <stdarg.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <random>

#include "scheduler.h"

using namespace lensd::year;
using machine::kNever;
using machine::kSecond;
using machine::Real;
using machine::Scheduler;

namespace {

/// Reading a clock takes so long: who waits in a loop sees time pass.
constexpr std::int64_t kOfReading = 50;

std::int64_t Nanoseconds(const timespec& time) {
  return time.tv_sec * kSecond + time.tv_nsec;
}

timespec Timespec(std::int64_t ns) {
  return {static_cast<time_t>(ns / kSecond), static_cast<long>(ns % kSecond)};
}

/// An instant of a clock, as one of CLOCK_MONOTONIC.
std::int64_t Monotonic(const Scheduler& here, clockid_t clock, const timespec& at) {
  return Nanoseconds(at) - (clock == CLOCK_REALTIME ? here.wall_ahead : 0);
}

int WaitOn(Scheduler& here, pthread_cond_t* condition, pthread_mutex_t* mutex, std::int64_t until) {
  pthread_mutex_unlock(mutex);
  const bool woken = here.Wait(condition, until);
  pthread_mutex_lock(mutex);
  return woken ? 0 : ETIMEDOUT;
}

int EpollWait(int set, epoll_event* events, int most, std::int64_t timeout_ns) {
  Scheduler* const here = Scheduler::Get();
  const std::int64_t until = timeout_ns < 0 ? kNever : here->now + timeout_ns;
  for (;;) {
    const long ready = Real().call(SYS_epoll_wait, set, events, most, 0);
    if (ready != 0 || timeout_ns == 0 || here->now >= until) return static_cast<int>(ready);
    here->WaitForEpoll(set, until);
  }
}

}  // namespace

extern "C" {

// ---- threads -------------------------------------------------------------------------------------------------------

int pthread_create(pthread_t* handle, const pthread_attr_t* attributes, void* (*routine)(void*), void* argument) {
  Scheduler* const here = Scheduler::Get();
  return here == nullptr ? Real().create(handle, attributes, routine, argument)
                         : here->Create(handle, attributes, routine, argument);
}

int pthread_join(pthread_t handle, void** result) {
  Scheduler* const here = Scheduler::Get();
  if (here == nullptr) return Real().join(handle, result);
  here->Join(handle, result);
  return 0;
}

int pthread_mutex_lock(pthread_mutex_t* mutex) {
  Scheduler* const here = Scheduler::Get();
  if (here == nullptr) return Real().lock(mutex);
  for (;;) {
    const int status = Real().trylock(mutex);
    if (status != EBUSY) return status;
    ++here->contended;
    here->Wait(mutex, kNever);
    --here->contended;
  }
}

int pthread_mutex_unlock(pthread_mutex_t* mutex) {
  const int status = Real().unlock(mutex);
  if (Scheduler* const here = Scheduler::Get(); here != nullptr && here->contended > 0) here->WakeAll(mutex);
  return status;
}

int pthread_cond_wait(pthread_cond_t* condition, pthread_mutex_t* mutex) {
  return WaitOn(*Scheduler::Get(), condition, mutex, kNever);
}

int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock, const timespec* at) {
  Scheduler& here = *Scheduler::Get();
  return WaitOn(here, condition, mutex, Monotonic(here, clock, *at));
}

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* at) {
  return pthread_cond_clockwait(condition, mutex, CLOCK_REALTIME, at);
}

int pthread_cond_signal(pthread_cond_t* condition) {
  if (Scheduler* const here = Scheduler::Get()) here->WakeOne(condition);
  return 0;
}

int pthread_cond_broadcast(pthread_cond_t* condition) {
  if (Scheduler* const here = Scheduler::Get()) here->WakeAll(condition);
  return 0;
}

int sched_yield() {
  if (Scheduler* const here = Scheduler::Get()) here->Yield();
  return 0;
}

/// libstdc++ waits for atomics and semaphores by this.
long syscall(long number, ...) {
  va_list list;
  va_start(list, number);
  long given[6];
  for (long& one : given) one = va_arg(list, long);
  va_end(list);
  Scheduler* const here = Scheduler::Get();
  const bool futex = here != nullptr && number == SYS_futex;
  if (!futex) return Real().call(number, given[0], given[1], given[2], given[3], given[4], given[5]);
  // NOLINTNEXTLINE(performance-no-int-to-ptr): a system call takes its pointers as numbers.
  auto* const word = reinterpret_cast<int*>(given[0]);
  switch (given[1] & FUTEX_CMD_MASK) {
    case FUTEX_WAIT:
    case FUTEX_WAIT_BITSET:
      if (__atomic_load_n(word, __ATOMIC_SEQ_CST) == static_cast<int>(given[2])) here->Wait(word, kNever);
      return 0;
    default:
      here->WakeAll(word);
      return 1;
  }
}

// ---- clocks --------------------------------------------------------------------------------------------------------

int clock_gettime(clockid_t clock, timespec* now) {
  Scheduler* const here = Scheduler::Get();
  if (here == nullptr) return static_cast<int>(Real().call(SYS_clock_gettime, clock, now));
  if (clock == CLOCK_THREAD_CPUTIME_ID || clock == CLOCK_PROCESS_CPUTIME_ID) {
    *now = {};
    return 0;
  }
  here->now += kOfReading;
  *now = Timespec(here->now + (clock == CLOCK_REALTIME ? here->wall_ahead : 0));
  return 0;
}

time_t time(time_t* into) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (into != nullptr) *into = now.tv_sec;
  return now.tv_sec;
}

int clock_nanosleep(clockid_t clock, int flags, const timespec* time, timespec* left) {
  Scheduler* const here = Scheduler::Get();
  if (here == nullptr) return static_cast<int>(Real().call(SYS_clock_nanosleep, clock, flags, time, left));
  const bool absolute = (flags & TIMER_ABSTIME) != 0;
  const std::int64_t until = absolute ? Monotonic(*here, clock, *time) : here->now + Nanoseconds(*time);
  if (until > here->now) machine::Sleep(until - here->now);
  return 0;
}

int nanosleep(const timespec* time, timespec* left) {
  return clock_nanosleep(CLOCK_MONOTONIC, 0, time, left);
}

/// An eventfd that the scheduler writes to.
int timerfd_create(clockid_t, int) {
  const int descriptor = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (Scheduler* const here = Scheduler::Get()) here->timers[descriptor] = kNever;
  return descriptor;
}

int timerfd_settime(int descriptor, int flags, const itimerspec* wanted, itimerspec*) {
  Scheduler& here = *Scheduler::Get();
  std::uint64_t count = 0;
  (void)!read(descriptor, &count, sizeof count);
  const std::int64_t value = Nanoseconds(wanted->it_value);
  here.timers[descriptor] = value == 0 ? kNever : (flags & TFD_TIMER_ABSTIME) != 0 ? value : here.now + value;
  return 0;
}

// ---- descriptors ---------------------------------------------------------------------------------------------------

int epoll_wait(int set, epoll_event* events, int most, int timeout_ms) {
  if (Scheduler::Get() == nullptr) return static_cast<int>(Real().call(SYS_epoll_wait, set, events, most, timeout_ms));
  return EpollWait(set, events, most, timeout_ms < 0 ? -1 : std::int64_t{timeout_ms} * 1'000'000);
}

int epoll_pwait2(int set, epoll_event* events, int most, const timespec* timeout, const sigset_t*) {
  return EpollWait(set, events, most, timeout == nullptr ? -1 : Nanoseconds(*timeout));
}

ssize_t write(int descriptor, const void* bytes, size_t count);  // disk.cpp

ssize_t send(int socket, const void* bytes, size_t count, int flags) {
  if (Scheduler* const here = Scheduler::Get()) here->Stir();
  return Real().call(SYS_sendto, socket, bytes, count, flags, nullptr, 0);
}

ssize_t sendmsg(int socket, const msghdr* message, int flags) {
  if (Scheduler* const here = Scheduler::Get()) here->Stir();
  return Real().call(SYS_sendmsg, socket, message, flags);
}

ssize_t recv(int socket, void* bytes, size_t count, int flags) {
  if (Scheduler* const here = Scheduler::Get()) here->Stir();
  return Real().call(SYS_recvfrom, socket, bytes, count, flags, nullptr, nullptr);
}

int connect(int socket, const sockaddr* address, socklen_t size) {
  if (Scheduler* const here = Scheduler::Get()) here->Stir();
  return static_cast<int>(Real().call(SYS_connect, socket, address, size));
}

int accept4(int listening, sockaddr* address, socklen_t* size, int flags) {
  const int socket = static_cast<int>(Real().call(SYS_accept4, listening, address, size, flags));
  Scheduler* const here = Scheduler::Get();
  if (socket < 0 || here == nullptr || here->peers.empty()) return socket;
  here->accepted[socket] = here->peers.front();
  here->peers.pop_front();
  return socket;
}

/// Who is at the other end is whom the tests say: all of them are this process.
int getsockopt(int socket, int level, int option, void* value, socklen_t* size) {
  Scheduler* const here = Scheduler::Get();
  const auto peer = here == nullptr ? std::map<int, machine::Peer>::iterator{} : here->accepted.find(socket);
  const bool ours = here != nullptr && level == SOL_SOCKET && peer != here->accepted.end();
  if (ours && option == SO_PEERCRED) {
    constexpr int kNobodysPid = 99'999'999;
    *static_cast<ucred*>(value) = {kNobodysPid, peer->second.user, peer->second.group};
    return 0;
  }
  if (ours && option == SO_PEERGROUPS) {
    *size = 0;
    return 0;
  }
  return static_cast<int>(Real().call(SYS_getsockopt, socket, level, option, value, size));
}
}  // extern "C"

/// Keys of leases and the like are drawn from the seed too.
std::random_device::result_type std::random_device::_M_getval() {
  Scheduler* const here = Scheduler::Get();
  return here == nullptr ? 4 : static_cast<result_type>(here->chance.Next());
}
