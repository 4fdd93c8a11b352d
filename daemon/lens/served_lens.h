// One lens as the daemon serves it: there or not, with what it last told of itself.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/events/watchers.h"
#include "daemon/lens/driving_calls.h"
#include "daemon/lens/lens_holds.h"
#include "daemon/lens/lens_lease.h"
#include "daemon/lens/lens_slope.h"
#include "daemon/lens/lens_work.h"
#include "daemon/lens/refocus.h"
#include "daemon/lens/seen_direction.h"
#include "daemon/lens/state_history.h"
#include "daemon/lens/stay.h"
#include "daemon/lens/stop_latch.h"
#include "daemon/lens/tenure.h"
#include "daemon/lens/worker.h"
#include "daemon/state/kept_files.h"
#include "daemon/state/unwritten_calibration.h"
#include "daemon/threads/plug_signal.h"
#include "daemon/threads/retry.h"
#include "daemon/threads/stop_signal.h"
#include "daemon/threads/task_thread.h"
#include "daemon/threads/waiter.h"
#include "loop/event_loop.h"
#include "planning/planning.h"
#include "rig/calibration.h"
#include "rig/presets.h"
#include "rig/rig.h"

namespace lensd::daemon {

/// What the lenses share; all of it outlives them.
struct LensSurroundings {
  EventLoop& loop;
  const Clock& clock;
  Watchers& watchers;
  PlugSignal& plugged;
  KeptFiles& files;   ///< writes what is kept: no disk is waited for in the event loop
  TaskThread& plans;  ///< solves what may take longer than the event loop can spare
  std::string state;  ///< folder for what outlives the daemon; empty: nowhere
  Instant began{};    ///< when lensd did
};

/// What an autofocus has found, for FocusAtAdd: one makes one sample.
struct FocusFound {
  Native position;
  std::optional<Dioptres> sigma;
  rig::FocusAtConditions under;
};

/// Who drives a lens, and who alone may; who may no longer, who waits, and how much they ask of it.
struct LensUsers {
  LensUsers(std::string lens, EventLoop& loop, const Clock& clock, LensLease::Told told)
      : lease(loop, clock, std::move(told)), stops(std::move(lens)) {}
  LensLease lease;
  LensHolds holds{};
  DrivingCalls driving;
  StopLatch stops;
  Waiters waiters;  ///< for its worker
  LensWork work{};
  StateHistory history{};
  std::optional<FocusFound> found{};  ///< by the newest autofocus that was sure; event loop thread
  std::unique_ptr<LensRefocus> refocus{};
  std::unique_ptr<LensSlope> slope{};
  std::unique_ptr<LensStay> stay{};
  SeenDirection direction{};
};

/// What is to be known of the files that are kept of a lens, and of its devices.
struct FileNotes {
  std::string of_calibration;         ///< empty: it was read without a word, or has been written since
  std::vector<std::string> warnings;  ///< of the others
  drivers::Findings devices;          ///< parts of its devices that were left out
  std::optional<rig::Unkept> calibration_unkept;
};

/// What was kept of a lens, beside its calibration and its presets.
struct LensMemory {
  Result<std::vector<rig::DriftSample>> drift{};
  Result<std::vector<rig::SlopeRun>> slopes{};
  drivers::PerAxis<std::optional<Native>> left{};  ///< where commands have left axes, as the positions' file has it
  std::optional<rig::Preset> last{};               ///< where the lens was left
};

class ServedLens;

/// Where an answer from the rig goes. Event loop thread only.
template <class Answer>
class Awaited final : public Waiter {
 public:
  using Then = std::move_only_function<void(const Result<Answer>&)>;
  explicit Awaited(Then then) : then_(std::move(then)) {}
  /// The first of these calls is the answer.
  void Take(const Result<Answer>& answer) {
    if (auto then = std::exchange(then_, nullptr)) then(answer);
  }
  void GiveUp(const Error& why) override { Take(PassOn(why)); }

 private:
  Then then_;
};

/// The way of one answer from the rig to the event loop. Dropped unanswered, it says that the lens came to its end.
template <class Answer>
class Reply {
 public:
  Reply(ServedLens& lens, std::shared_ptr<Awaited<Answer>> awaited) : lens_(&lens), awaited_(std::move(awaited)) {}
  Reply(Reply&&) noexcept = default;
  Reply& operator=(Reply&&) = delete;
  ~Reply();
  /// On the worker's thread; once.
  void operator()(Result<Answer> answer);

 private:
  ServedLens* lens_;
  std::shared_ptr<Awaited<Answer>> awaited_;
};

/// Event loop thread only, where nothing else is said. Reading its state never waits for a device: its worker publishes
/// it, serialised, after every step. What its worker or its driver throws ends this lens alone, which is opened again.
class ServedLens {
 public:
  using Open = std::function<Result<drivers::Device>()>;

  static constexpr Duration kParkAtMost = std::chrono::seconds(10);

  /// Not there yet: `open` is tried on a thread of its own, from Begin() on until it works. What `before`, the same
  /// lens under another configuration, could not write it has and goes on writing; null: there was none.
  ServedLens(LensConfig config, const LensSurroundings& surroundings, Open open, const ServedLens* before = nullptr);
  ServedLens(const ServedLens&) = delete;
  ServedLens& operator=(const ServedLens&) = delete;

  /// Unless it has come to its end already.
  void Begin();
  enum class Parks { No, First };
  /// Begins to end: what moves is stopped, and every caller answered; from now on it says `why` it takes no commands.
  /// Axes that are to park and can go there first; a second call ends that. The answer is how long it may take more.
  Duration End(std::string why, Parks parks = Parks::No);
  /// What its end waits for. Nothing: its device is not used any more, but by calls that hang. Disk: the device has
  /// come to rest, and where is being written.
  enum class Left { Nothing, Disk, Device };
  Left left() const;
  /// Calls that hang in its driver, each with a thread: the destructor would wait for them.
  std::size_t stuck() const { return opening_.stuck.size(); }
  /// Gives up a call that does not come back, and opens the device anew. To be called several times a second.
  void LookAfter();

  const LensConfig& config() const { return config_; }
  const std::string& name() const { return config_.name; }
  enum class For { Motion, Stop };
  /// Why it takes no commands now; nothing: it does.
  std::optional<Error> WhyAbsent(For what = For::Motion) const;
  /// Its device is being opened for the first time: runs `task` when that has worked or not, or takes long. False:
  /// it is past that.
  bool OnceTried(Task task);
  std::string info() const;                                ///< LensInfo, serialised
  const std::string& text() const { return shown_.text; }  ///< LensStatus, serialised
  const rig::Status& status() const { return *shown_.status; }
  const std::shared_ptr<const rig::Status>& shared_status() const { return shown_.status; }
  /// Null: the optics are not known.
  const std::shared_ptr<const Planning>& planning() const { return plans_.planning; }
  /// Null: real hardware, or not there.
  const std::shared_ptr<drivers::Simulation>& simulation() const { return simulation_; }
  const FileMark& calibration_mark() const { return kept_.calibration; }  ///< as it is in force; no path: nowhere
  Watchers& watchers() const { return surroundings_.watchers; }
  const LensSurroundings& surroundings() const { return surroundings_; }

  /// Gives the rig a command and hears its answer in the event loop, where the state is new already. On the worker's
  /// thread `command(rig, reply)` has the rig call `reply` with a Result<Answer>, once. Busy: too many commands wait.
  template <class Answer, class Command>
  void Ask(Command command, typename Awaited<Answer>::Then then) {
    if (auto why = WhyAbsent()) return then(PassOn(*why));
    if (worker_->full()) return then(Fail(Code::Busy, "too many commands wait for this lens"));
    (void)worker_->Submit(Answered<Answer>(std::move(command), std::move(then)));
  }
  /// The same for what stops something: never refused, and nothing that the worker waits for comes before it. Timeout:
  /// the worker hangs in a call, and stops once that comes back.
  template <class Answer, class Command>
  void AskToStop(Command command, typename Awaited<Answer>::Then then) {
    if (auto why = WhyAbsent(For::Stop)) return then(PassOn(*why));
    worker_->SubmitStop(Answered<Answer>(std::move(command), std::move(then), kStopAtMost));
    GiveUpStops();
  }

  /// What is planned with is of another zoom or temperature than the lens stands at, or of other limits than it has.
  bool Outdated() const {
    return worker_ && (shown_.status->optics != plans_.optics ||
                       (shown_.status->limits_set != plans_.limits_set && shown_.status->connected));
  }
  /// Plans with what holds now, then goes on with `then`; it hears where that cannot be: Busy, or why it is absent.
  void Replan(std::function<void(const Result<void>&)> then);

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

  LensUsers& users() const { return *users_; }

 private:
  static constexpr Duration kStopAtMost = std::chrono::seconds(3);  ///< longer than a stop takes that comes to an end
  template <class Answer>
  Reply<Answer> ReplyTo(typename Awaited<Answer>::Then then, std::optional<Duration> at_most = std::nullopt) {
    auto awaited = std::make_shared<Awaited<Answer>>(std::move(then));
    users_->waiters.Add(awaited, at_most ? std::optional(surroundings_.clock.Now() + *at_most) : std::nullopt);
    return Reply<Answer>(*this, std::move(awaited));
  }

  /// What it tells of itself.
  struct Shown {
    std::string info;
    std::string rig;                            ///< LensStatus, serialised, without what is not the rig's
    std::string text;                           ///< LensStatus, serialised
    std::shared_ptr<const rig::Status> status;  ///< what `text` says
    std::string connection;                     ///< a Connection
    std::string told_connection;                ///< the one that was announced last
    std::string published;                      ///< the worker's thread: the state last told of, to see changes
    FileNotes notes;                            ///< while there is a worker, its thread's
  };
  struct Plans {
    std::shared_ptr<const Planning> planning;
    std::shared_ptr<const rig::OpticsTable> optics;  ///< what `planning` and Shown::info say
    int limits_set = 0;                              ///< likewise
  };
  struct PresetChange {
    EditPresets edit;
    std::function<void(const Result<void>&)> done;
  };
  struct Kept {
    FileMark calibration;
    std::uint64_t calibration_writes = 0;           ///< asked for; the newest counts
    std::optional<rig::Unkept> calibration_unkept;  ///< as FileNotes has it
    UnwrittenCalibration unwritten;
    Result<std::vector<rig::Preset>> presets;
    std::deque<PresetChange> preset_changes;  ///< that wait
    bool presets_under_way = false;           ///< those before them are being written
  };
  enum class Life { Opening, Tried, Parking, Ending, Ended };
  /// A thread that does not come back from a call; one of the two.
  struct Stuck {
    std::shared_ptr<Tenure> tenure;
    std::unique_ptr<Worker> worker;
    std::unique_ptr<Retry> retry;
  };
  struct Opening {
    Life life = Life::Opening;
    std::vector<Task> parked;  ///< until the device was tried
    int failures = 0;          ///< of workers, one after the other
    std::string why_ending;
    std::shared_ptr<Tenure> tenure{};  ///< of the worker, or of the attempts to open
    std::vector<Stuck> stuck{};
    bool left_moving = false;  ///< the worker that hung last may have left a motor running
  };
  /// A rig, and what the user should know of the files it was made from.
  struct Made {
    std::unique_ptr<rig::Rig> rig;
    std::shared_ptr<drivers::Simulation> simulation;
    FileNotes notes;
    FileMark calibration;  ///< as it was before it was read
    LensMemory memory{};
    std::optional<UnwrittenCalibration::Content> unwritten;  ///< in force, whatever the file says
  };
  /// The command that has the rig answer.
  template <class Answer, class Command>
  Worker::Command Answered(Command command, typename Awaited<Answer>::Then then,
                           std::optional<Duration> at_most = std::nullopt) {
    return [this, command = std::move(command), reply = ReplyTo<Answer>(std::move(then), at_most),
            queued = std::optional<Queued>(users_->work), asked = surroundings_.clock.Now()](rig::Rig& rig) mutable {
      queued.reset();
      users_->work.waits.Add(surroundings_.clock.Now() - asked);
      users_->history.Note(rig);
      command(rig, std::move(reply));
    };
  }
  Result<drivers::Device> OpenUnder(const std::shared_ptr<Tenure>& tenure) const;
  Result<Made> MakeRig(const std::shared_ptr<Tenure>& tenure);
  void LoadLearned(Made& made) const;
  Result<Made> RigOf(drivers::Device device, std::shared_ptr<const rig::Calibration> calibration) const;
  std::optional<drivers::Direction> SeenOf(const std::string& serial, std::vector<std::string>& warnings) const;
  std::unique_ptr<rig::PositionMemory> Memory(const std::string& serial, Made& made) const;
  void OpenAfter(Duration delay);
  bool TryToOpen(const std::shared_ptr<Tenure>& tenure);
  void TakeOpened(const Tenure& tenure, Result<Made> rig, Result<std::vector<rig::Preset>> presets);
  void GiveUp(Duration after, std::string_view what);
  void GiveUpStops();
  bool WritesPositions() const;
  void ForgetStuck();
  void StartRig(Made made, Result<std::vector<rig::Preset>> presets);
  void HomeAtStart();
  bool GoToPark();
  void Park(const std::vector<drivers::Axis>& axes);
  void RunParked();
  varlink::Json StateJson(const rig::Status& status) const;
  std::string StatusText(varlink::Json json, std::string_view connection, const rig::Status& status) const;
  std::string ProcessesText() const;
  void Show(std::shared_ptr<const rig::Status> status, std::string text, std::string_view connection);
  void ShowAbsent(std::string_view connection, std::string problem);
  void TellChange();
  void TellLease(const varlink::Json& change);
  void TellFaults(const rig::Status& before) const;
  void TellLeftOut() const;
  void TellKept(std::string_view what, const std::optional<rig::Unkept>& unkept) const;
  void TellCalibration(const Result<void>& kept) const;
  void Published(const std::shared_ptr<Tenure>& tenure, const rig::Status& status, std::vector<Worker::Task> later);
  void Update(std::shared_ptr<const rig::Status> status, std::string text, bool changed);
  void KeepUnwritten(std::optional<UnwrittenCalibration::Content> unwritten);
  void KeepCalibration(std::uint64_t number, std::shared_ptr<const rig::Calibration> next,
                       std::function<void(const Result<void>&)> then);
  void NoteCalibration(std::uint64_t number, const std::shared_ptr<const rig::Calibration>& next,
                       const Result<void>& kept);
  void WritePresets();
  void WorkerEnded(std::optional<Error> why);
  Duration PauseAfterFailure();

  const LensConfig config_;
  const LensSurroundings& surroundings_;
  const Open open_;
  Shown shown_;
  Plans plans_;
  Kept kept_;
  const std::unique_ptr<LensUsers> users_;
  std::shared_ptr<StopSignal> stop_signal_ = std::make_shared<StopSignal>();  // of the worker
  Opening opening_;
  std::shared_ptr<drivers::Simulation> simulation_;
  std::unique_ptr<Worker> worker_;
  std::unique_ptr<Retry> retry_;  // until there is a worker
};

template <class Answer>
Reply<Answer>::~Reply() {
  if (!awaited_) return;
  lens_->surroundings().loop.Post(
      [awaited = std::move(awaited_)] { awaited->GiveUp({Code::Cancelled, "the lens was closed"}); });
}

template <class Answer>
void Reply<Answer>::operator()(Result<Answer> answer) {
  Worker::Later([awaited = std::exchange(awaited_, nullptr), answer = std::move(answer)] { awaited->Take(answer); });
}

}  // namespace lensd::daemon
