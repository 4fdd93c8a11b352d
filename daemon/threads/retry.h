// Something tried on a thread of its own until it works: opening a device that is not there yet.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <thread>
#include <utility>

#include "base/guarded.h"
#include "daemon/threads/plug_signal.h"

namespace lensd::daemon {

/// Pauses grow between attempts, for devices that come without a word from the kernel (a drive on a network); something
/// plugged in ends the pause. The destructor waits for the attempt in progress.
class Retry {
 public:
  static constexpr Duration kFirstPause = std::chrono::milliseconds(250);
  static constexpr Duration kLongestPause = std::chrono::seconds(10);

  /// `attempt` runs on the thread until it returns true, for the first time after `delay`. `signal` must outlive this.
  Retry(PlugSignal& signal, std::function<bool()> attempt, Duration delay = {})
      : thread_([&signal, attempt = std::move(attempt), delay, done = done_](const std::stop_token& stop) {
          Run(signal, attempt, delay, stop);
          *done = true;
        }) {}

  /// No further attempt.
  void End() { thread_.request_stop(); }
  /// The destructor will not wait long.
  bool ended() const { return *done_; }

 private:
  static void Run(PlugSignal& signal, const std::function<bool()>& attempt, Duration delay,
                  const std::stop_token& stop) {
    if (delay > Duration{}) signal.Wait(stop, signal.count(), delay);
    Duration pause = kFirstPause;
    while (!stop.stop_requested()) {
      const auto seen = signal.count();
      bool works = false;
      (void)Guarded("opening", [&] { works = attempt(); });
      if (works) return;
      pause = signal.Wait(stop, seen, pause) ? kFirstPause : std::min(2 * pause, kLongestPause);
    }
  }

  std::shared_ptr<std::atomic<bool>> done_ = std::make_shared<std::atomic<bool>>(false);
  std::jthread thread_;
};

}  // namespace lensd::daemon
