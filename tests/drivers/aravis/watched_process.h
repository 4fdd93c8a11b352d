// Work that may end its process or never end, done in a process of its own that is watched from here.
#pragma once

#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <ctime>
#include <functional>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace lensd::testing {

/// What came of the pieces of work from `first` to `end`.
struct Watched {
  struct Bad {
    std::uint64_t piece = 0;
    std::string what;  ///< "signal 11", "4.0 s of processor time"
  };
  std::uint64_t done = 0, counted = 0;  ///< pieces; those for which work() was true
  double longest_s = 0.0;               ///< processor time of one piece that ended
  std::vector<Bad> bad;
};

/// Does work(prepare(piece)) for each in a child process; one that ends the child, or whose work takes more processor
/// time than `limit_s`, is bad, and another child goes on after it. Stops after `most_bad`. Call while this process has
/// one thread.
inline Watched WatchWork(std::uint64_t first, std::uint64_t end, double limit_s, std::size_t most_bad,
                         const std::function<std::string(std::uint64_t)>& prepare,
                         const std::function<bool(const std::string&)>& work) {
  struct Shared {
    std::atomic<std::uint64_t> piece{0}, done{0}, counted{0};
    std::atomic<bool> working{false};
    std::atomic<std::int64_t> began_ns{0}, longest_ns{0};
  };
  const auto cpu_ns = [](clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
  };
  void* memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::runtime_error("no shared memory");
  auto& shared = *new (memory) Shared;
  Watched watched;
  for (std::uint64_t next = first; next < end && watched.bad.size() < most_bad; next = shared.piece + 1) {
    shared.piece = next;
    shared.working = false;
    const pid_t child = fork();
    if (child < 0) throw std::runtime_error("no process");
    if (child == 0) {
      for (std::uint64_t piece = next; piece < end; ++piece) {
        shared.piece = piece;
        const std::string prepared = prepare(piece);
        const std::int64_t began = cpu_ns(CLOCK_PROCESS_CPUTIME_ID);
        shared.began_ns = began;
        shared.working = true;
        if (work(prepared)) ++shared.counted;
        shared.working = false;
        ++shared.done;
        const std::int64_t took = cpu_ns(CLOCK_PROCESS_CPUTIME_ID) - began;
        if (took > shared.longest_ns) shared.longest_ns = took;
      }
      _exit(0);
    }
    clockid_t clock{};
    clock_getcpuclockid(child, &clock);
    int status = 0;
    bool slow = false;
    while (waitpid(child, &status, WNOHANG) == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      const std::uint64_t piece = shared.piece;
      const double took_s = 1e-9 * static_cast<double>(cpu_ns(clock) - shared.began_ns);
      if (slow || !shared.working || took_s < limit_s || piece != shared.piece) continue;
      slow = true;
      kill(child, SIGKILL);
    }
    if (slow) watched.bad.push_back({shared.piece, "more than " + std::to_string(limit_s) + " s of processor time"});
    if (!slow && WIFSIGNALED(status))
      watched.bad.push_back({shared.piece, "signal " + std::to_string(WTERMSIG(status))});
    if (!slow && WIFEXITED(status) && WEXITSTATUS(status) != 0) {
      watched.bad.push_back({shared.piece, "exit " + std::to_string(WEXITSTATUS(status))});
    }
    if (!slow && WIFEXITED(status) && WEXITSTATUS(status) == 0) break;
  }
  watched.done = shared.done;
  watched.counted = shared.counted;
  watched.longest_s = 1e-9 * static_cast<double>(shared.longest_ns);
  munmap(memory, sizeof(Shared));
  return watched;
}

}  // namespace lensd::testing
