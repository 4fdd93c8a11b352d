// The control channel of one camera, on a thread of its own.
//
// Aravis blocks up to 2.5 s in a register access without an answer, and longer in opening; its feature tree belongs
// to one thread. So one thread owns the camera and does what others ask of it, one task after the other; who asks waits
// no longer than the deadline. A task that no caller waits for any more is not begun. When control is lost (the camera
// has gone, was restarted, or another program took it) the thread closes it and tries to open it again, with growing
// pauses, until it is back or the link is destroyed.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "base/clock.h"
#include "base/result.h"
#include "camera_search.h"
#include "config.h"
#include "drivers/api/thread_barrier.h"
#include "gobject_handles.h"

using ArvCamera = struct _ArvCamera;

namespace lensd::drivers::aravis {

inline constexpr int kMostMissed = 3;  ///< deadlines in a row: then the camera is gone

class AravisLink {
 public:
  /// Brings a camera just opened into the state wanted, and says whether it moves a lens; on the link's thread, each
  /// time it is opened.
  using Setup = std::function<Result<bool>(ArvCamera*)>;
  template <class T>
  using Work = std::function<Result<T>(ArvCamera*)>;

  /// Opens and sets up, within 12 s. Errors as OpenAravis().
  static Result<std::shared_ptr<AravisLink>> Open(const DriverConfig& config, Setup setup);
  /// Closes; waits for what the thread is in the middle of.
  ~AravisLink();
  AravisLink(const AravisLink&) = delete;
  AravisLink& operator=(const AravisLink&) = delete;

  /// Does `work` on the link's thread and waits for it. Timeout: not done by the deadline (it may still have an effect
  /// if it had begun). Cancelled: Interrupt(). Disconnected: there is no camera now. Throws what `work` threw, and what
  /// anything else threw on the link's thread, which has ended then.
  template <class T>
  Result<T> Call(Work<T> work);
  /// As Call(), without waiting. Where the camera goes away before, `work` gets nullptr, perhaps on this thread.
  void Post(std::function<void(ArvCamera*)> work);

  /// What the camera's part does on the link's thread: before a lost camera is closed, once it is open again and set
  /// up, and every second. None runs any more once this has replaced them.
  struct Hooks {
    std::function<void()> lost;
    std::function<void(ArvCamera*)> reopened;
    std::function<void(ArvCamera*)> every_second;
  };
  void SetHooks(Hooks hooks);

  /// From any thread: calls in progress return Cancelled.
  void Interrupt();
  /// The camera is there, as far as is known.
  bool connected() const;
  /// How often the camera has been opened. On the link's thread.
  int times_opened() const { return camera_.times_opened; }

 private:
  struct Task {
    std::function<void(ArvCamera*)> run;  ///< nullptr: there is no camera
    std::function<bool()> wanted;         ///< a caller still waits for it
  };
  struct Camera {
    Handle<ArvCamera> handle;
    unsigned long lost_handler = 0;
    std::unique_ptr<CameraInUse> in_use;  ///< once it is set up
    int times_opened = 0;
  };
  struct State {
    std::optional<Result<void>> opened;  ///< for the first time
    bool connected = false;
    bool lost = false;
    int missed = 0;                ///< deadlines in a row, no call having been answered since
    std::optional<Error> why_not;  ///< why it could not be opened again, since that was last tried
    std::string address;           ///< of a camera on a network
    ThreadBarrier barrier;         ///< has a lock of its own
  };

  AravisLink(const DriverConfig& config, Setup setup);
  void Run(const std::stop_token& stop);
  void OpenAndServe(const std::stop_token& stop);
  void Serve(const std::stop_token& stop);
  Result<void> OpenCamera();
  void Close();
  void Reopen(const std::stop_token& stop);
  void FailQueue();
  bool StillControls();
  Result<void> CheckPrivilege() const;
  Result<void> CheckAfter(Instant began) const;
  void CheckUp();
  void Note(const Error& error);
  Error WhyAbsent() const;
  Result<void> WaitFor(const std::function<bool()>& done, std::uint64_t generation);
  bool Gone(std::unique_lock<std::mutex>& lock, const std::function<bool()>& over);
  std::uint64_t Enqueue(Task task);

  const DriverConfig config_;
  const Setup setup_;
  Camera camera_;  // the link's thread

  mutable std::mutex mutex_;
  std::condition_variable_any wake_;  // the link's thread waits
  std::condition_variable answered_;  // callers wait
  std::deque<Task> tasks_;            // guarded by mutex_, as all below
  State state_;
  std::uint64_t interrupts_ = 0;
  std::mutex hooks_mutex_;  // held while a hook runs
  Hooks hooks_;
  std::jthread thread_;
};

template <class T>
Result<T> AravisLink::Call(Work<T> work) {
  struct Slot {
    std::optional<Result<T>> answer;
    bool given_up = false;
  };
  const auto slot = std::make_shared<Slot>();
  const auto lock_free_done = [slot] { return slot->answer.has_value(); };
  Task task;
  task.wanted = [slot] { return !slot->given_up; };
  task.run = [this, slot, work = std::move(work)](ArvCamera* camera) {
    Result<T> answer = std::unexpected(WhyAbsent());
    if (camera != nullptr) {
      state_.barrier.Run([&] {
        const Instant began = std::chrono::steady_clock::now();
        answer = work(camera);
        if (auto ours = CheckAfter(began); answer && !ours) answer = PassOn(ours);
      });
    }
    if (!answer && camera != nullptr) Note(answer.error());
    const std::lock_guard lock(mutex_);
    if (answer) state_.missed = 0;
    slot->answer = std::move(answer);
    answered_.notify_all();
  };
  const std::uint64_t generation = Enqueue(std::move(task));
  const auto waited = WaitFor(lock_free_done, generation);
  state_.barrier.Check();
  const std::lock_guard lock(mutex_);
  if (slot->answer) return std::move(*slot->answer);
  slot->given_up = true;
  // Aravis itself takes longer to give a camera up than those who follow a motion can wait.
  if (waited.error().code == Code::Timeout && ++state_.missed >= kMostMissed) {
    return Fail(Code::Disconnected, waited.error().message);
  }
  return PassOn(waited);
}

}  // namespace lensd::drivers::aravis
