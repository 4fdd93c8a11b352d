// What a lens has had to do, for Metrics.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

#include "daemon/lens/histogram.h"

namespace lensd::daemon {

/// From any thread.
struct LensWork {
  std::atomic<std::int64_t> waiting = 0;   ///< commands that its worker has not taken yet
  std::atomic<std::int64_t> refused = 0;   ///< calls that were answered with an error
  std::atomic<std::int64_t> openings = 0;  ///< times that its device was opened
  std::atomic<std::int64_t> failures = 0;  ///< times that its worker failed
  Histogram waits;                         ///< of commands, until the worker took them
  Histogram settles;                       ///< of moves and homings that ended by themselves, until their end
};

/// A place in the queue of a worker.
class Queued {
 public:
  explicit Queued(LensWork& work) : work_(&work) { ++work_->waiting; }
  Queued(Queued&& other) noexcept : work_(std::exchange(other.work_, nullptr)) {}
  Queued& operator=(Queued&&) = delete;
  ~Queued() {
    if (work_ != nullptr) --work_->waiting;
  }

 private:
  LensWork* work_;
};

}  // namespace lensd::daemon
