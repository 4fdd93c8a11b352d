// Word that something was plugged in, for everybody who waits for a device.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <stop_token>

#include "base/clock.h"

namespace lensd::daemon {

/// From any thread.
class PlugSignal {
 public:
  void Raise() {
    {
      const std::lock_guard lock(mutex_);
      ++count_;
    }
    wake_.notify_all();
  }
  std::uint64_t count() const {
    const std::lock_guard lock(mutex_);
    return count_;
  }
  /// Waits until the count differs from `seen`, `stop` is requested, or the time is over. True: it was raised.
  bool Wait(const std::stop_token& stop, std::uint64_t seen, Duration at_most) {
    std::unique_lock lock(mutex_);
    return wake_.wait_for(lock, stop, at_most, [&] { return count_ != seen; });
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::uint64_t count_ = 0;  // guarded by mutex_
};

}  // namespace lensd::daemon
