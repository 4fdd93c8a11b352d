// A driver process that several devices may share, as those on one bus do.
#pragma once

#include <array>
#include <memory>
#include <mutex>

#include "base/result.h"
#include "host_process.h"
#include "loop/descriptor.h"

namespace lensd::drivers::process {

/// Lets nobody connect to a process while the last device leaves it: the process is about to end then, and may hold the
/// port that the next one needs. Any thread.
class SharedProcess {
 public:
  /// The one for all programs with the same `shares`; one of its own where that is empty.
  static std::shared_ptr<SharedProcess> For(const Program& program);

  struct Connected {
    std::shared_ptr<HostProcess> process;
    std::array<daemon::Descriptor, 3> connections;
  };
  /// Of the process that runs, else of one that is started. Disconnected: it cannot be started, or ended at once. Busy:
  /// too many files are open.
  Result<Connected> Connect(const Program& program);

  /// `leave` closes a device's connections and lets go of its process, which may take 4 s.
  template <class Leave>
  void LeaveBy(Leave leave) {
    const std::lock_guard lock(mutex_);
    leave();
  }

 private:
  std::mutex mutex_;  // guards the next, and is held while devices come and go
  std::weak_ptr<HostProcess> process_;
};

}  // namespace lensd::drivers::process
