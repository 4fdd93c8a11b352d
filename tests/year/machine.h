// A machine for a whole daemon in this process whose clock and whose scheduler are drawn from a seed.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace lensd::year {

/// Numbers from a seed: the same on every machine.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : state_(seed) {}
  std::uint64_t Next() {  // SplitMix64
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  /// 0 .. below - 1.
  std::uint64_t Below(std::uint64_t below) { return Next() % below; }
  /// 0 <= x < 1.
  double Unit() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }
  double Between(double low, double high) { return low + (high - low) * Unit(); }
  bool OneIn(std::uint64_t n) { return Below(n) == 0; }
  /// Times between events that come at random, `mean` apart.
  double Pause(double mean);

 private:
  std::uint64_t state_;
};

/// From Begin() on, threads, mutexes, condition variables, clocks, timers, epoll and random numbers of this process are
/// the machine's: one thread runs at a time, until it waits for something; which one runs next is drawn from the seed;
/// and time passes only where all of them wait: then it is at once the next instant that any of them waits for. The
/// product's code is not changed: it calls these functions of libc, and the linker finds ours (interposed.cpp).
namespace machine {

constexpr std::int64_t kNever = INT64_MAX;
constexpr std::int64_t kSecond = 1'000'000'000;

/// Ends the run with what was found, and how to repeat it.
[[noreturn]] void Found(const std::string& what);
/// What Found() says besides.
void OnFound(std::function<std::string()> where);

/// The calling thread becomes the first one, which the others wait for in WaitForSockets() and nowhere else.
void Begin(std::uint64_t seed);
/// ns of CLOCK_MONOTONIC.
std::int64_t Now();
/// How often a thread was chosen; names an instant of a run.
std::uint64_t Steps();
/// Of everything that was told to it, in order.
std::uint64_t TraceHash();
void Trace(std::string_view what);
/// Also writes what is traced to a file.
void TraceTo(const std::string& path);

/// Until one of the descriptors in this epoll set is ready, `until` has come, or RequestKill().
void WaitForSockets(int epoll, std::int64_t until);
/// The time of day jumps by so many ns.
void JumpWallClock(std::int64_t by);
/// The calling thread waits so long.
void Sleep(std::int64_t ns);

/// The next connection that is accepted is of this user and these groups.
struct Peer {
  unsigned user = 0;
  unsigned group = 0;
};
void NextPeer(const Peer& peer);

/// The calling thread runs no more, and the first thread is woken: it is to call Kill().
[[noreturn]] void StopHere();
bool KillRequested();
/// No thread but the first runs any more, and every descriptor but those `kept` is closed: what a SIGKILL leaves.
void Kill(const std::function<bool(int descriptor)>& kept);

}  // namespace machine
}  // namespace lensd::year
