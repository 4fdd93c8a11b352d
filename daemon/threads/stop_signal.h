// Word that a stop waits to be carried out, for what a worker waits for meanwhile: the disk.
#pragma once

#include <condition_variable>
#include <mutex>

namespace lensd::daemon {

/// From any thread.
class StopSignal {
 public:
  void Raise() { Change(1); }
  /// As many stops as `count` have been carried out.
  void Lower(int count) { Change(-count); }
  /// The worker is given up: who waits is let go, and nothing may outlive this call that others would see.
  void Sever() {
    Tell([this] {
      severed_ = true;
      ++raised_;
    });
  }
  /// From within `done()` or `change()`.
  bool severed() const { return severed_; }
  /// From there too: whether a disk is being written to.
  void SetWriting(bool writing) { writing_ = writing; }
  bool IsWriting() {
    const std::lock_guard lock(mutex_);
    return writing_;
  }
  bool IsSevered() {
    const std::lock_guard lock(mutex_);
    return severed_;
  }
  /// Waits until a stop waits or `done()`, which is called under a lock; false: a stop came first.
  template <class Done>
  bool WaitUnlessRaised(Done done) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [&] { return raised_ > 0 || done(); });
    return done();
  }
  /// Waits until `done()`, which is called under a lock.
  template <class Done>
  void Wait(Done done) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, done);
  }
  /// Changes what `done()` looks at, and wakes who waits for it.
  template <class Change>
  void Tell(Change change) {
    {
      const std::lock_guard lock(mutex_);
      change();
    }
    wake_.notify_all();
  }

 private:
  void Change(int by) {
    Tell([&] { raised_ += by; });
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  int raised_ = 0;        // guarded by mutex_
  bool severed_ = false;  // guarded by mutex_
  bool writing_ = false;  // guarded by mutex_
};

}  // namespace lensd::daemon
