// A lens from its configuration to its worker: waiting for the device, starting the rig, and passing on what the rig
// tells to clients that ask or watch.
#include "served_lens.h"

#include <algorithm>

#include "barrier.h"
#include "calibration_store.h"
#include "io/checked_file.h"
#include "lens_json.h"
#include "log.h"
#include "move_group.h"
#include "position_store.h"

namespace lensd::daemon {

using varlink::Json;

namespace {

constexpr Duration kLongOpening = std::chrono::seconds(2);
constexpr Duration kHungOpening = std::chrono::seconds(15);  // longer than any driver takes that keeps its deadlines
constexpr std::string_view kBeingOpened = "its device is being opened";
constexpr std::size_t kMostParked = 64;
constexpr int kMostDoublings = 6;

std::optional<drivers::Axis> FirstNotHomed(const rig::Status& status) {
  const auto* const found = std::ranges::find_if(
      drivers::kAxes, [&](drivers::Axis axis) { return status.axes[axis] && !status.axes[axis]->homed; });
  return found == drivers::kAxes.end() ? std::nullopt : std::optional(*found);
}

/// Whether an error of opening says that the device is not there or not usable yet; else it is not the one configured.
bool MayComeYet(Code code) {
  return code == Code::Disconnected || code == Code::Timeout || code == Code::Busy || code == Code::Protocol ||
         code == Code::Io || code == Code::Cancelled || code == Code::Internal;
}

/// Of a lens whose device was open once.
std::string_view ConnectionOf(const rig::Status& status) {
  return status.connected ? "connected" : status.wrong_device ? "wrongDevice" : "absent";
}

std::shared_ptr<const Planning> SharedPlanning(const rig::Rig& rig, const rig::RigConfig& config) {
  auto planning = PlanningOf(rig, config);
  return planning ? std::make_shared<const Planning>(*std::move(planning)) : nullptr;
}

}  // namespace

ServedLens::ServedLens(LensConfig config, const LensSurroundings& surroundings, Open open)
    : config_(std::move(config)),
      surroundings_(surroundings),
      open_(std::move(open)),
      users_(std::make_unique<LensUsers>(surroundings.loop, surroundings.clock,
                                         [this](const Json& change) { TellLease(change); })) {
  shown_.info = varlink::WriteJson(AbsentInfoJson(config_.name, config_.device.driver->name));
  shown_.told_connection = "connecting";
  ShowAbsent("connecting", std::string(kBeingOpened));
}

std::optional<Error> ServedLens::WhyAbsent() const {
  if (opening_.life >= Life::Ending) return Error{Code::Cancelled, opening_.why_ending};
  if (!worker_) return Error{Code::Disconnected, shown_.status->problem};
  return std::nullopt;
}

bool ServedLens::OnceTried(Task task) {
  if (opening_.life != Life::Opening || opening_.parked.size() >= kMostParked) return false;
  opening_.parked.push_back(std::move(task));
  return true;
}

void ServedLens::RunParked() {
  if (opening_.life == Life::Opening) opening_.life = Life::Tried;
  for (Task& task : std::exchange(opening_.parked, {})) task();
}

void ServedLens::NoteStop(std::uint64_t number, const std::vector<drivers::Axis>& axes, bool latch) {
  for (const drivers::Axis axis : drivers::kAxes) {
    if (axes.empty() || std::ranges::find(axes, axis) != axes.end()) stop_.number[axis] = number;
  }
  if (latch) stop_.latched = true;
}

void ServedLens::Unlatch() {
  stop_.latched = false;
}

std::optional<Error> ServedLens::WhyStopped(std::uint64_t number, std::optional<drivers::Axis> axis) const {
  if (stop_.latched)
    return Error{Code::Cancelled, "lens \"" + name() + "\" was stopped for good: reset its faults first"};
  for (const drivers::Axis each : drivers::kAxes) {
    if ((!axis || each == *axis) && number < stop_.number[each]) return Error{Code::Cancelled, "stopped"};
  }
  return std::nullopt;
}

void ServedLens::Begin() {
  if (opening_.life == Life::Opening && !retry_) OpenAfter({});
}

void ServedLens::End(std::string why) {
  if (opening_.life >= Life::Ending) return;
  opening_.life = Life::Ending;
  opening_.why_ending = std::move(why);
  if (retry_) retry_->End();
  if (worker_) worker_->End();
  if (!worker_) opening_.life = Life::Ended;
  RunParked();
}

bool ServedLens::ended() const {
  return opening_.life == Life::Ended && (!retry_ || retry_->ended());
}

// ---- from a device to a rig ---------------------------------------------------------------------------------------

/// Null: nothing is to be remembered. A file that cannot be read makes every position unknown, and is told of.
std::unique_ptr<rig::PositionMemory> ServedLens::Memory(const std::string& serial,
                                                        std::vector<std::string>& warnings) const {
  if (surroundings_.state.empty()) return nullptr;
  auto store = std::make_unique<PositionStore>(surroundings_.state, name(), serial, stop_.signal);
  if (auto loaded = store->Load(); !loaded) {
    std::string warning = loaded.error().message + ": no position of this lens is known until it is homed";
    const auto copy = loaded.error().code == Code::BadData ? io::KeepDamaged(store->path()) : Result<std::string>("");
    if (copy && !copy->empty()) warning += "; the file is kept as " + *copy;
    warnings.push_back(std::move(warning));
  }
  return store;
}

/// On the thread of Retry.
Result<ServedLens::Made> ServedLens::MakeRig() {
  auto device = open_();
  if (!device) return PassOn(device);
  const std::string serial = device->lens->capabilities().serial;
  const std::string file = CalibrationFile(config_, surroundings_.state, serial);
  const bool configured = config_.rig.calibration_path.has_value();
  auto loaded = LoadCalibration(file, configured ? Writer::People : Writer::Lensd);
  if (!loaded) return PassOn(loaded);
  const auto& calibration = loaded->content;
  if (!calibration && configured) {
    Log(Severity::Warning, Event::CalibrationMissing, file + " is not there yet: uncalibrated until lensctl calibrate",
        name());
  }
  Made made;
  if (!loaded->warning.empty()) made.warnings.push_back(loaded->warning);
  auto memory = Memory(serial, made.warnings);
  made.simulation = device->simulation;
  auto rig = rig::Rig::Create(config_.rig, *std::move(device), surroundings_.clock, calibration, std::move(memory));
  if (!rig && calibration) return Fail(Code::BadData, file + ": " + rig.error().message);
  if (!rig) return PassOn(rig);
  made.rig = *std::move(rig);
  return made;
}

void ServedLens::OpenAfter(Duration delay) {
  retry_.emplace(surroundings_.plugged, [this] { return TryToOpen(); }, delay);
  if (opening_.life != Life::Opening) return;
  surroundings_.loop.After(kLongOpening, [this] { RunParked(); });
  surroundings_.loop.After(kHungOpening, [this] { TellIfHung(); });
}

/// A thread that hangs in a driver cannot be helped; it may yet come back.
void ServedLens::TellIfHung() {
  if (worker_ || opening_.life >= Life::Ending || status().problem != kBeingOpened) return;
  ShowAbsent("hung", "its device has not answered for 15 s while it was being opened; lensd still waits for it");
  Log(Severity::Warning, Event::LensLost, status().problem, name());
  TellChange();
}

/// On the thread of Retry.
bool ServedLens::TryToOpen() {
  Result<Made> rig = Fail(Code::Internal, "");
  if (auto thrown = Guarded("opening", [&] { rig = MakeRig(); })) rig = PassOn(*thrown);
  Result<std::vector<rig::Preset>> presets;
  if (rig) {
    auto kept = LoadPresets(PresetsFile(config_, surroundings_.state));
    const std::string warning = kept ? kept->warning : kept.error().message + ": no presets until that is mended";
    if (!warning.empty()) rig->warnings.push_back(warning);
    presets = kept ? Result<std::vector<rig::Preset>>(std::move(kept->content)) : PassOn(kept);
  }
  const bool opened = rig.has_value();
  surroundings_.loop.Post([this, rig = std::move(rig), presets = std::move(presets)]() mutable {
    if (opening_.life >= Life::Ending) return;
    const bool first = opening_.life == Life::Opening;
    if (rig) {
      retry_.reset();
      StartRig(*std::move(rig), std::move(presets));
      if (!first) Log(Severity::Info, Event::LensReady, "the lens is there", name());
    } else if (shown_.status->problem != rig.error().message) {
      ShowAbsent(MayComeYet(rig.error().code) ? "absent" : "wrongDevice", rig.error().message);
      Log(Severity::Warning, Event::LensLost, rig.error().message, name());
    } else {
      return;
    }
    TellChange();
    TellFaults({});
    RunParked();
  });
  return opened;
}

void ServedLens::StartRig(Made made, Result<std::vector<rig::Preset>> presets) {
  std::unique_ptr<rig::Rig> rig = std::move(made.rig);
  simulation_ = std::move(made.simulation);
  shown_.warnings = std::move(made.warnings);
  for (const std::string& warning : shown_.warnings) Log(Severity::Warning, Event::StateUnreadable, warning, name());
  kept_.calibration_file = CalibrationFile(config_, surroundings_.state, rig->lens().serial);
  kept_.presets = std::move(presets);
  plans_.optics = rig->GetStatus().optics;
  plans_.planning = SharedPlanning(*rig, config_.rig);
  shown_.info = varlink::WriteJson(InfoJson(name(), *rig, config_.rig, plans_.planning.get(), kept_.calibration_file));
  const rig::Status now = rig->GetStatus();
  const std::string_view connection = ConnectionOf(now);
  Show(std::make_shared<const rig::Status>(now), StatusText(StatusJson(name(), now), connection, now), connection);
  Worker::Listener listener;
  listener.published = [this](const rig::Status& status, std::vector<Worker::Task> later) {
    Published(status, std::move(later));
  };
  listener.ended = [this](std::vector<Worker::Task> later, std::optional<Error> why) {
    surroundings_.loop.Post([this, later = std::move(later), why = std::move(why)]() mutable {
      for (Worker::Task& task : later) (void)Guarded(name(), task);
      WorkerEnded(std::move(why));
    });
  };
  worker_ = std::make_unique<Worker>(std::move(rig), surroundings_.clock, stop_.signal, std::move(listener));
  if (config_.home_at_start) HomeAtStart();
}

/// Told to end, or because something threw: then the device is opened anew, the later the more often that happened.
void ServedLens::WorkerEnded(std::optional<Error> why) {
  if (opening_.life == Life::Ending) {
    opening_.life = Life::Ended;
    return;
  }
  const std::string problem = why ? why->message : "its worker ended";
  Log(Severity::Error, Event::LensFailed, problem + "; it is opened again", name());
  worker_.reset();
  simulation_.reset();
  ShowAbsent("absent", problem);
  TellChange();
  OpenAfter(Retry::kFirstPause * (1 << std::min(opening_.failures++, kMostDoublings)));
}

void ServedLens::HomeAtStart() {
  const auto home = [](rig::Rig& rig, MovesCallback done) { HomeAxes(rig, std::nullopt, std::move(done)); };
  Ask<Moves>(home, [this](const Result<Moves>& moves) {
    if (!moves) return Log(Severity::Warning, Event::NotHomed, "not homed: " + moves.error().message, name());
    watchers().AnnounceMoves(*this, MovesJson(name(), *moves));
    for (const rig::MoveOutcome& outcome : *moves) {
      if (!outcome.reached) Log(Severity::Warning, Event::NotHomed, "not homed: " + outcome.reason, name());
    }
  });
}

// ---- what the rig tells -------------------------------------------------------------------------------------------

/// On the worker's thread.
void ServedLens::Published(const rig::Status& status, std::vector<Worker::Task> later) {
  Json json = StatusJson(name(), status);
  std::string without_time = varlink::WriteJson(json);
  const bool changed = without_time != shown_.published;
  shown_.published = std::move(without_time);
  std::string text = StatusText(std::move(json), ConnectionOf(status), status);
  surroundings_.loop.Post([this, copy = std::make_shared<const rig::Status>(status), text = std::move(text), changed,
                           tasks = std::move(later)]() mutable {
    Update(std::move(copy), std::move(text), changed);
    for (Worker::Task& task : tasks) (void)Guarded(name(), task);
  });
}

void ServedLens::Update(std::shared_ptr<const rig::Status> status, std::string text, bool changed) {
  const std::shared_ptr<const rig::Status> before = shown_.status;
  const std::string_view connection = ConnectionOf(*status);
  Show(std::move(status), std::move(text), connection);
  if (shown_.status->connected != before->connected) {
    if (shown_.status->connected) {
      Log(Severity::Info, Event::LensReady, "the lens answers", name());
      if (config_.home_at_start && FirstNotHomed(*shown_.status)) HomeAtStart();
    } else {
      Log(Severity::Warning, Event::LensLost, shown_.status->problem, name());
    }
  }
  if (!changed) return;
  TellChange();
  TellFaults(*before);
}

void ServedLens::Replan(std::function<void()> then) {
  Submit([this, then = std::move(then)](rig::Rig& rig) mutable {
    auto planning = SharedPlanning(rig, config_.rig);
    std::string info = varlink::WriteJson(InfoJson(name(), rig, config_.rig, planning.get(), kept_.calibration_file));
    Later([this, planning = std::move(planning), info = std::move(info), optics = rig.GetStatus().optics,
           then = std::move(then)]() mutable {
      plans_.planning = std::move(planning);
      shown_.info = std::move(info);
      plans_.optics = std::move(optics);
      then();
    });
  });
}

// ---- what is kept -------------------------------------------------------------------------------------------------

void ServedLens::ChangeCalibration(EditCalibration edit, std::function<void(const Result<void>&)> done) {
  using Changed = std::shared_ptr<const rig::Calibration>;
  const auto command = [edit = std::move(edit)](rig::Rig& rig, auto answer) {
    rig::Calibration now = rig.calibration() ? *rig.calibration() : rig::Calibration{};
    if (!rig.calibration()) now.serial = rig.lens().serial;
    auto edited = edit(std::move(now), rig);
    if (!edited) return answer(PassOn(edited));
    Changed next;
    if (*edited) next = std::make_shared<const rig::Calibration>(**std::move(edited));
    rig.SetCalibration(next, [next, answer = std::move(answer)](Result<void> set) mutable {
      answer(set ? Result<Changed>(next) : Result<Changed>(PassOn(set)));
    });
  };
  Ask<Changed>(command, [this, done = std::move(done)](const Result<Changed>& next) {
    if (!next) return done(PassOn(next));
    const bool taken = surroundings_.files.Submit([this, done, file = kept_.calibration_file, next = *next] {
      auto kept = Keep(file, next ? rig::CalibrationText(*next) : "");
      if (!kept) kept = Fail(Code::NotKept, "in force, but not kept: " + kept.error().message);
      surroundings_.loop.Post([this, done, kept] {
        Replan([this, done, kept] {
          TellCalibration(kept);
          done(kept);
        });
      });
    });
    if (taken) return;
    const Result<void> kept = Fail(Code::Busy, "in force, but not kept: too much waits to be written");
    TellCalibration(kept);
    done(kept);
  });
}

void ServedLens::ChangePresets(EditPresets edit, std::function<void(const Result<void>&)> done) {
  if (kept_.preset_changes.size() >= TaskThread::kMostTasks) {
    return done(Fail(Code::Busy, "too many presets wait to be written; try again"));
  }
  kept_.preset_changes.push_back({std::move(edit), std::move(done)});
  if (kept_.preset_changes.size() == 1) NextPresetChange();
}

/// Carries out the first of the changes, then those behind it. A file that cannot be read is never written over.
void ServedLens::NextPresetChange() {
  const auto end = [this](const Result<void>& result) {
    const PresetChange ended = std::move(kept_.preset_changes.front());
    kept_.preset_changes.pop_front();
    ended.done(result);
    if (!kept_.preset_changes.empty()) surroundings_.loop.Post([this] { NextPresetChange(); });
  };
  if (!kept_.presets) return end(Fail(Code::NotKept, "presets cannot be kept: " + kept_.presets.error().message));
  std::vector<rig::Preset> presets = *kept_.presets;
  if (auto edited = kept_.preset_changes.front().edit(presets); !edited) return end(edited);
  std::ranges::sort(presets, {}, &rig::Preset::label);
  const bool taken = surroundings_.files.Submit([this, end, presets = std::move(presets)]() mutable {
    auto kept = Keep(PresetsFile(config_, surroundings_.state), rig::PresetsText(presets));
    surroundings_.loop.Post([this, end, kept = std::move(kept), presets = std::move(presets)]() mutable {
      if (kept) kept_.presets = std::move(presets);
      end(kept ? kept : Fail(Code::NotKept, "the presets could not be written: " + kept.error().message));
    });
  });
  if (!taken) end(Fail(Code::Busy, "too much waits to be written; try again"));
}

}  // namespace lensd::daemon
