// What throws where no caller can catch it, on a driver's own thread or in a destructor, is kept, and comes out where
// one can: in a call of the lens' user, who closes that lens and opens it anew.
#pragma once

#include <exception>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/result.h"

namespace lensd::drivers {

/// What was thrown, in words; inside a handler.
inline std::string CaughtText() {
  try {
    throw;
  } catch (const std::exception& failure) {
    return failure.what();
  } catch (...) {
    return "an exception of no known type";
  }
}

/// Between one thread of a driver, or the callbacks of a library, and those who use the driver. Any thread.
class ThreadBarrier {
 public:
  /// On the driver's thread: runs `work`. False: it threw; the first of what was thrown is kept.
  template <class Work>
  bool Run(Work&& work) {
    try {
      std::forward<Work>(work)();
      return true;
    } catch (...) {
      std::string what = CaughtText();
      const std::lock_guard lock(mutex_);
      if (!what_) what_ = std::move(what);
      return false;
    }
  }
  /// The same; the Result that `work` returns, Internal where it threw.
  template <class Work>
  auto Answer(Work&& work) -> decltype(work()) {
    decltype(work()) answer = Fail(Code::Internal, "internal error in the driver");
    Run([&] { answer = std::forward<Work>(work)(); });
    return answer;
  }
  /// On the thread of a call: throws what was kept, now and whenever it is asked again.
  void Check() const {
    const std::lock_guard lock(mutex_);
    if (what_) throw std::runtime_error(*what_);
  }

 private:
  mutable std::mutex mutex_;
  std::optional<std::string> what_;  // guarded by mutex_
};

/// What destructors on this thread have contained since it was last taken, the first of it.
inline std::optional<std::string>& Contained() {
  thread_local std::optional<std::string> contained;
  return contained;
}
inline std::optional<std::string> TakeContained() {
  return std::exchange(Contained(), std::nullopt);
}

/// For what a destructor does and may throw: no destructor may let it out. The caller who closed the device takes it.
template <class Work>
void Contain(Work&& work) {
  try {
    std::forward<Work>(work)();
  } catch (...) {
    std::string what = CaughtText();
    if (!Contained()) Contained() = std::move(what);
  }
}

}  // namespace lensd::drivers
