// A thread for work too long for the event loop.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>

#include "base/guarded.h"

namespace lensd::daemon {

/// Runs tasks one after the other; what one throws is dropped with it. The destructor finishes the one in progress and
/// drops the rest.
class TaskThread {
 public:
  using Task = std::move_only_function<void()>;

  TaskThread() : thread_([this](const std::stop_token& stop) { Run(stop); }) {}

  /// Waits for the task in progress and drops the rest; none is taken after it.
  void End() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }

  /// Asks the task in progress to end early, if it heeds stop(); no other is begun.
  void RequestStop() { thread_.request_stop(); }
  /// Requested once the thread is to end: tasks that take long had better heed it.
  std::stop_token stop() const { return thread_.get_stop_token(); }

  static constexpr std::size_t kMostTasks = 64;

  std::size_t waiting() {
    const std::lock_guard lock(mutex_);
    return tasks_.size();
  }
  /// Whether a task is in progress: the destructor would wait for it.
  bool busy() {
    const std::lock_guard lock(mutex_);
    return busy_;
  }

  /// From any thread. False: too many wait already.
  bool Submit(Task task) {
    {
      const std::lock_guard lock(mutex_);
      if (tasks_.size() >= kMostTasks) return false;
      tasks_.push_back(std::move(task));
    }
    wake_.notify_one();
    return true;
  }

 private:
  void Run(const std::stop_token& stop) {
    for (;;) {
      std::unique_lock lock(mutex_);
      busy_ = false;
      if (!wake_.wait(lock, stop, [this] { return !tasks_.empty(); }) || stop.stop_requested()) return;
      Task task = std::move(tasks_.front());
      tasks_.pop_front();
      busy_ = true;
      lock.unlock();
      (void)Guarded("a task", task);
    }
  }

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<Task> tasks_;  // guarded by mutex_
  bool busy_ = false;       // guarded by mutex_
  std::jthread thread_;     // last: it uses the others
};

}  // namespace lensd::daemon
