// One lens as the daemon serves it: there or not, with what it last told of itself.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config.h"
#include "driving_calls.h"
#include "event_loop.h"
#include "lens_lease.h"
#include "planning.h"
#include "plug_signal.h"
#include "retry.h"
#include "rig/calibration.h"
#include "rig/presets.h"
#include "rig/rig.h"
#include "stop_signal.h"
#include "task_thread.h"
#include "watchers.h"
#include "worker.h"

namespace lensd::daemon {

/// What the lenses share; all of it outlives them.
struct LensSurroundings {
  EventLoop& loop;
  const Clock& clock;
  Watchers& watchers;
  PlugSignal& plugged;
  TaskThread& files;  ///< writes what is kept: no disk is waited for in the event loop
  TaskThread& plans;  ///< solves what may take longer than the event loop can spare
  std::string state;  ///< folder for what outlives the daemon; empty: nowhere
};

/// Who drives a lens, and who alone may.
struct LensUsers {
  LensUsers(EventLoop& loop, const Clock& clock, LensLease::Told told) : lease(loop, clock, std::move(told)) {}
  LensLease lease;
  DrivingCalls driving;
};

class ServedLens;

/// The way of one answer from the rig to the event loop. Dropped unanswered, it says that the lens came to its end.
template <class Answer>
class Reply {
 public:
  using Then = std::move_only_function<void(const Result<Answer>&)>;
  Reply(ServedLens& lens, Then then) : lens_(&lens), then_(std::move(then)) {}
  Reply(Reply&&) noexcept = default;
  Reply& operator=(Reply&&) = delete;
  ~Reply();
  /// On the worker's thread; once.
  void operator()(Result<Answer> answer);

 private:
  ServedLens* lens_;
  Then then_;
};

/// Event loop thread only, where nothing else is said. Reading its state never waits for a device: its worker publishes
/// it, serialised, after every step. What its worker or its driver throws ends this lens alone, which is opened again.
class ServedLens {
 public:
  using Open = std::function<Result<drivers::Device>()>;

  /// Not there yet: `open` is tried on a thread of its own, from Begin() on until it works.
  ServedLens(LensConfig config, const LensSurroundings& surroundings, Open open);
  ServedLens(const ServedLens&) = delete;
  ServedLens& operator=(const ServedLens&) = delete;

  /// Unless it has come to its end already.
  void Begin();
  /// Begins to end: what moves is stopped, and every caller answered; from now on it says `why` it takes no commands.
  void End(std::string why);
  bool ended() const;  ///< the destructor will not wait

  const LensConfig& config() const { return config_; }
  const std::string& name() const { return config_.name; }
  /// Why it takes no commands now; nothing: it does.
  std::optional<Error> WhyAbsent() const;
  /// Its device is being opened for the first time: runs `task` when that has worked or not, or takes long. False:
  /// it is past that.
  bool OnceTried(Task task);
  const std::string& info() const { return shown_.info; }  ///< LensInfo, serialised
  const std::string& text() const { return shown_.text; }  ///< LensStatus, serialised
  const rig::Status& status() const { return *shown_.status; }
  const std::shared_ptr<const rig::Status>& shared_status() const { return shown_.status; }
  /// Null: the optics are not known.
  const std::shared_ptr<const Planning>& planning() const { return plans_.planning; }
  /// Null: real hardware, or not there.
  const std::shared_ptr<drivers::Simulation>& simulation() const { return simulation_; }
  const std::string& calibration_file() const { return kept_.calibration_file; }  ///< empty: nowhere
  Watchers& watchers() const { return surroundings_.watchers; }
  const LensSurroundings& surroundings() const { return surroundings_; }

  /// Gives the rig a command and hears its answer in the event loop, where the state is new already. On the worker's
  /// thread `command(rig, reply)` has the rig call `reply` with a Result<Answer>, once. Busy: too many commands wait.
  template <class Answer, class Command>
  void Ask(Command command, typename Reply<Answer>::Then then) {
    if (auto why = WhyAbsent()) return then(PassOn(*why));
    if (worker_->full()) return then(Fail(Code::Busy, "too many commands wait for this lens"));
    Submit([command = std::move(command), reply = Reply<Answer>(*this, std::move(then))](rig::Rig& rig) mutable {
      command(rig, std::move(reply));
    });
  }
  /// The same for what stops something: never refused, and nothing that the worker waits for comes before it.
  template <class Answer, class Command>
  void AskToStop(Command command, typename Reply<Answer>::Then then) {
    if (auto why = WhyAbsent()) return then(PassOn(*why));
    SubmitStop([command = std::move(command), reply = Reply<Answer>(*this, std::move(then))](rig::Rig& rig) mutable {
      command(rig, std::move(reply));
    });
  }
  /// Commands without an answer, where there is a worker to take them.
  void Submit(Worker::Command command) {
    if (worker_) (void)worker_->Submit(std::move(command));
  }
  void SubmitStop(Worker::Command command) {
    if (worker_) worker_->SubmitStop(std::move(command));
  }
  /// From a rig's callback only: runs `task` in the event loop once the state is new.
  void Later(Worker::Task task) { worker_->Later(std::move(task)); }

  /// A call of this number stops these axes, all of them if empty: those before it that would move them are over. With
  /// `latch` none moves until Unlatch().
  void NoteStop(std::uint64_t number, const std::vector<drivers::Axis>& axes, bool latch);
  void Unlatch();
  /// Why a call may not move an axis, or any of them: a stop came after it, or holds.
  std::optional<Error> WhyStopped(std::uint64_t number, std::optional<drivers::Axis> axis) const;

  /// What is planned with is of another zoom or temperature than the lens stands at.
  bool Outdated() const { return worker_ && shown_.status->optics != plans_.optics; }
  /// Plans with what holds now, then goes on with `then`.
  void Replan(std::function<void()> then);

  /// What becomes of a calibration; nothing: it is removed. On the worker's thread.
  using EditCalibration = std::function<Result<std::optional<rig::Calibration>>(rig::Calibration, const rig::Rig&)>;
  /// Puts what `edit` makes of the calibration in force and keeps it. NotKept in `done`: it is in force, but
  /// could not be written.
  void ChangeCalibration(EditCalibration edit, std::function<void(const Result<void>&)> done);

  /// Presets by label. Io, BadData: their file cannot be read.
  const Result<std::vector<rig::Preset>>& presets() const { return kept_.presets; }
  using EditPresets = std::function<Result<void>(std::vector<rig::Preset>&)>;
  /// Changes them, on disk first; one change after the other. Busy, NotKept, or what `edit` says: they stay as they
  /// were.
  void ChangePresets(EditPresets edit, std::function<void(const Result<void>&)> done);

  /// Null: none holds.
  const Lease* lease() const { return users_->lease.now(); }
  LensUsers& users() const { return *users_; }

 private:
  /// What it tells of itself.
  struct Shown {
    std::string info;
    std::string rig;                            ///< LensStatus, serialised, without what is not the rig's
    std::string text;                           ///< LensStatus, serialised
    std::shared_ptr<const rig::Status> status;  ///< what `text` says
    std::string connection;                     ///< a Connection
    std::string told_connection;                ///< the one that was announced last
    std::string published;                      ///< the worker's thread: the state last told of, to see changes
    std::vector<std::string> warnings;          ///< of kept files; while there is a worker they do not change
  };
  struct Plans {
    std::shared_ptr<const Planning> planning;
    std::shared_ptr<const rig::OpticsTable> optics;  ///< what `planning` and Shown::info say
  };
  struct PresetChange {
    EditPresets edit;
    std::function<void(const Result<void>&)> done;
  };
  struct Kept {
    std::string calibration_file;
    Result<std::vector<rig::Preset>> presets;
    std::deque<PresetChange> preset_changes;  ///< the first is under way
  };
  struct Stopping {
    drivers::PerAxis<std::uint64_t> number{};  ///< of the last call that stopped it
    std::atomic<bool> latched = false;         ///< written by the event loop alone
    std::shared_ptr<StopSignal> signal = std::make_shared<StopSignal>();
  };
  enum class Life { Opening, Tried, Ending, Ended };
  struct Opening {
    Life life = Life::Opening;
    std::vector<Task> parked;  ///< until the device was tried
    int failures = 0;          ///< of workers, one after the other
    std::string why_ending;
  };
  /// A rig, and what the user should know of the files it was made from.
  struct Made {
    std::unique_ptr<rig::Rig> rig;
    std::shared_ptr<drivers::Simulation> simulation;
    std::vector<std::string> warnings;
  };
  Result<Made> MakeRig();
  std::unique_ptr<rig::PositionMemory> Memory(const std::string& serial, std::vector<std::string>& warnings) const;
  void OpenAfter(Duration delay);
  bool TryToOpen();
  void TellIfHung();
  void StartRig(Made made, Result<std::vector<rig::Preset>> presets);
  void HomeAtStart();
  void RunParked();
  std::string StatusText(varlink::Json json, std::string_view connection, const rig::Status& status) const;
  void Show(std::shared_ptr<const rig::Status> status, std::string text, std::string_view connection);
  void ShowAbsent(std::string_view connection, std::string problem);
  void TellChange();
  void TellLease(const varlink::Json& change);
  void TellFaults(const rig::Status& before) const;
  void TellCalibration(const Result<void>& kept) const;
  void Published(const rig::Status& status, std::vector<Worker::Task> later);
  void Update(std::shared_ptr<const rig::Status> status, std::string text, bool changed);
  void NextPresetChange();
  void WorkerEnded(std::optional<Error> why);

  const LensConfig config_;
  const LensSurroundings& surroundings_;
  const Open open_;
  Shown shown_;
  Plans plans_;
  Kept kept_;
  const std::unique_ptr<LensUsers> users_;
  Stopping stop_;
  Opening opening_;
  std::shared_ptr<drivers::Simulation> simulation_;
  std::unique_ptr<Worker> worker_;
  std::optional<Retry> retry_;  // until there is a worker
};

template <class Answer>
Reply<Answer>::~Reply() {
  if (!then_) return;
  lens_->surroundings().loop.Post(
      [then = std::move(then_)]() mutable { then(Fail(Code::Cancelled, "the lens was closed")); });
}

template <class Answer>
void Reply<Answer>::operator()(Result<Answer> answer) {
  lens_->Later([then = std::exchange(then_, nullptr), answer = std::move(answer)]() mutable { then(answer); });
}

}  // namespace lensd::daemon
