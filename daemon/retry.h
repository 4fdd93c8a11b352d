// Something tried on a thread of its own until it works: opening a device that is not there yet.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <thread>
#include <utility>

#include "plug_signal.h"

namespace lensd::daemon {

/// Pauses grow between attempts, for devices that come without a word from the kernel (a drive on a network); something
/// plugged in ends the pause. The destructor waits for the attempt in progress.
class Retry {
 public:
  static constexpr Duration kFirstPause = std::chrono::milliseconds(250);
  static constexpr Duration kLongestPause = std::chrono::seconds(10);

  /// `attempt` runs on the thread until it returns true. `signal` must outlive this.
  Retry(PlugSignal& signal, std::function<bool()> attempt)
      : thread_([&signal, attempt = std::move(attempt)](const std::stop_token& stop) { Run(signal, attempt, stop); }) {}

 private:
  static void Run(PlugSignal& signal, const std::function<bool()>& attempt, const std::stop_token& stop) {
    Duration pause = kFirstPause;
    while (!stop.stop_requested()) {
      const auto seen = signal.count();
      if (attempt()) return;
      pause = signal.Wait(stop, seen, pause) ? kFirstPause : std::min(2 * pause, kLongestPause);
    }
  }

  std::jthread thread_;
};

}  // namespace lensd::daemon
