// One rig on its own thread.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "rig/rig.h"

namespace lensd::daemon {

/// Drives a rig: takes commands, steps it when it wants to be stepped, and hands on what happened. Commands are taken
/// in the order of Submit(); the rig itself puts stops first and lets the newest command win.
class Worker {
 public:
  using Command = std::move_only_function<void(rig::Rig&)>;
  using Task = std::move_only_function<void()>;
  /// Called on the worker's thread after each step: the rig's state, and then what its callbacks passed to Later(), in
  /// order, so that whoever hears of a finished move finds the state already new.
  using Publish = std::function<void(const rig::Status&, std::vector<Task> later)>;

  /// `clock` must outlive the worker.
  Worker(std::unique_ptr<rig::Rig> rig, const Clock& clock, Publish publish);
  /// Ends what the rig does (its callers get Cancelled, to nobody) and joins the thread.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// From any thread: runs `command` on the worker's thread, before the rig's next step.
  void Submit(Command command);
  /// From a rig's callback only: hands `task` to Publish after this step.
  void Later(Task task) { later_.push_back(std::move(task)); }

 private:
  void Run(const std::stop_token& stop);
  std::vector<Command> Wait(const std::stop_token& stop, Instant wake);

  std::unique_ptr<rig::Rig> rig_;  // the worker's thread, but for Interrupt()
  const Clock& clock_;
  Publish publish_;
  std::vector<Task> later_;  // the worker's thread
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::vector<Command> commands_;  // guarded by mutex_
  std::jthread thread_;
};

}  // namespace lensd::daemon
