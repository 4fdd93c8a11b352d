// One rig on its own thread.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "daemon/threads/stop_signal.h"
#include "rig/rig.h"

namespace lensd::daemon {

/// Drives a rig: takes commands, steps it when it wants to be stepped, and hands on what happened. Commands are taken
/// in the order of Submit(), all that are there at once, so that a stop ends every one before it. A thread that does
/// not come back from a call of the driver cannot be helped: Abandon() lets the others go on without it.
class Worker {
 public:
  using Command = std::move_only_function<void(rig::Rig&)>;
  using Task = std::move_only_function<void()>;
  /// Both are called on the worker's thread.
  struct Listener {
    /// After each step: the rig's state, and then what its callbacks passed to Later(), in order, so that a callback
    /// that hears of a finished move finds the state already new.
    std::function<void(const rig::Status&, std::vector<Task> later)> published;
    /// Once, when the rig is no more: what its callbacks passed to Later() in the end, and why where it failed.
    std::function<void(std::vector<Task> later, std::optional<Error> why)> ended;
  };

  /// What may wait to be taken.
  static constexpr std::size_t kMostCommands = 128;

  /// `clock` must outlive the worker. `stops` says when a stop waits.
  Worker(std::unique_ptr<rig::Rig> rig, const Clock& clock, std::shared_ptr<StopSignal> stops, Listener listener);
  /// End(), and joins the thread.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// From any thread: runs `command` on the worker's thread, before the rig's next step. False: too many wait already,
  /// or the worker has ended; `command` is gone.
  bool Submit(Command command);
  /// The same for a command that stops something: it is always taken, and ends what the thread waits for.
  void SubmitStop(Command command);
  bool full();
  /// From a rig's callback only: hands `task` to the listener of the worker whose thread this is, after its step.
  static void Later(Task task);
  /// Since when the thread has been at one piece of work; nothing: it waits for the next.
  std::optional<Instant> busy_since();
  /// The thread hangs: what waits for it is dropped, and of what it yet does nothing is published. Only its end is
  /// told.
  void Abandon();
  /// Begins to end: stops what moves, waits a moment until it stands and until the disk has where, and answers every
  /// caller Cancelled.
  void End();

 private:
  void Run(const std::stop_token& stop);
  void Serve(const std::stop_token& stop);
  void ComeToRest();
  /// What waited to be taken.
  struct Batch {
    std::vector<Command> commands;
    int stops = 0;  ///< how many of them are stops
  };
  Batch Wait(const std::stop_token& stop, Instant wake);

  std::unique_ptr<rig::Rig> rig_;  // the worker's thread, but for Interrupt()
  const Clock& clock_;
  const std::shared_ptr<StopSignal> stops_;
  Listener listener_;
  std::vector<Task> later_;  // the worker's thread
  void Publish();
  /// Guarded by mutex_.
  struct State {
    Batch waiting;
    bool ended = false;
    std::optional<Instant> busy_since;
  };
  std::mutex mutex_;
  std::condition_variable_any wake_;
  State state_;
  std::mutex publishing_;   // held while the listener is told
  bool abandoned_ = false;  // guarded by publishing_
  std::jthread thread_;
};

/// Whether where the axes rest is not on disk, as far as their device says where that is.
bool PositionsWait(const rig::Status& status);

}  // namespace lensd::daemon
