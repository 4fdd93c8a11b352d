// A lens from its configuration to its worker: waiting for the device, starting the rig, and passing on what the rig
// tells to clients that ask or watch.
#include "daemon/lens/served_lens.h"

#include <algorithm>

#include "base/guarded.h"
#include "daemon/events/log.h"
#include "daemon/lens/move_group.h"
#include "daemon/state/lens_state_files.h"
#include "daemon/state/position_store.h"
#include "daemon/wire/lens_json.h"
#include "io/checked_file.h"

namespace lensd::daemon {

using varlink::Json;

namespace {

constexpr Duration kLongOpening = std::chrono::seconds(2);
constexpr std::string_view kBeingOpened = "its device is being opened";
constexpr std::size_t kMostParked = 64;
constexpr int kMostDoublings = 6;

/// Of those that homing helps.
std::optional<drivers::Axis> FirstUnhomed(const rig::Status& status) {
  const auto* const found = std::ranges::find_if(drivers::kAxes, [&](drivers::Axis axis) {
    return status.axes[axis] && !status.axes[axis]->homed && !status.axes[axis]->lost;
  });
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

ServedLens::ServedLens(LensConfig config, const LensSurroundings& surroundings, Open open, const ServedLens* before)
    : config_(std::move(config)),
      surroundings_(surroundings),
      open_(std::move(open)),
      users_(std::make_unique<LensUsers>(config_.name, surroundings.loop, surroundings.clock,
                                         [this](const Json& change) { TellLease(change); })) {
  users_->refocus = std::make_unique<LensRefocus>(*this);
  users_->slope = std::make_unique<LensSlope>(*this);
  users_->stay = std::make_unique<LensStay>(*this);
  shown_.info = varlink::WriteJson(AbsentInfoJson(config_.name, config_.device.driver->name));
  shown_.told_connection = "connecting";
  if (before != nullptr) {
    kept_.unwritten.Put(before->kept_.unwritten.Get());
    kept_.calibration_unkept = before->kept_.calibration_unkept;
    users_->direction.TakeOver(before->users_->direction);
  }
  ShowAbsent("connecting", std::string(kBeingOpened));
}

std::optional<Error> ServedLens::WhyAbsent(For what) const {
  if (opening_.life >= (what == For::Stop ? Life::Ending : Life::Parking))
    return Error{Code::Cancelled, opening_.why_ending};
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

void ServedLens::Begin() {
  if (opening_.life == Life::Opening && !retry_) OpenAfter({});
}

Duration ServedLens::End(std::string why, Parks parks) {
  if (opening_.life >= Life::Ending) return {};
  opening_.why_ending = std::move(why);
  if (parks == Parks::First && GoToPark()) return kParkAtMost;
  opening_.life = Life::Ending;
  if (retry_) retry_->End();
  if (worker_) worker_->End();
  if (!worker_) opening_.life = Life::Ended;
  RunParked();
  return {};
}

/// Where it stands is not on disk yet, and it is at that.
bool ServedLens::WritesPositions() const {
  return worker_ && (PositionsWait(*shown_.status) || stop_signal_->IsWriting());
}

ServedLens::Left ServedLens::left() const {
  if (opening_.life == Life::Ended && (!retry_ || retry_->ended())) return Left::Nothing;
  return WritesPositions() ? Left::Disk : Left::Device;
}

// ---- from a device to a rig ---------------------------------------------------------------------------------------

void ServedLens::OpenAfter(Duration delay) {
  opening_.tenure = std::make_shared<Tenure>();
  retry_ = std::make_unique<Retry>(
      surroundings_.plugged, [this, tenure = opening_.tenure] { return TryToOpen(tenure); }, delay);
  if (opening_.life == Life::Opening) surroundings_.loop.After(kLongOpening, [this] { RunParked(); });
}

/// On the thread of Retry.
bool ServedLens::TryToOpen(const std::shared_ptr<Tenure>& tenure) {
  tenure->OpeningSince(surroundings_.clock.Now());
  Result<Made> rig = Fail(Code::Internal, "");
  if (auto thrown = Guarded("opening", [&] { rig = MakeRig(tenure); })) rig = PassOn(*thrown);
  Result<std::vector<rig::Preset>> presets;
  if (rig) {
    auto kept = LoadPresets(PresetsFile(config_, surroundings_.state));
    const std::string warning =
        kept ? kept->warning : kept.error().message + ": no presets until the file is corrected";
    if (!warning.empty()) rig->notes.warnings.push_back(warning);
    presets = kept ? Result<std::vector<rig::Preset>>(std::move(kept->content)) : PassOn(kept);
  }
  if (rig) LoadLearned(*rig);
  tenure->NotOpening();
  if (tenure->over()) return true;  // another thread has the device: what was opened here is closed here
  const bool opened = rig.has_value();
  surroundings_.loop.Post([this, tenure, rig = std::move(rig), presets = std::move(presets)]() mutable {
    TakeOpened(*tenure, std::move(rig), std::move(presets));
  });
  return opened;
}

void ServedLens::TakeOpened(const Tenure& tenure, Result<Made> rig, Result<std::vector<rig::Preset>> presets) {
  if (opening_.life >= Life::Ending || tenure.over()) return;
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
}

void ServedLens::StartRig(Made made, Result<std::vector<rig::Preset>> presets) {
  std::unique_ptr<rig::Rig> rig = std::move(made.rig);
  simulation_ = std::move(made.simulation);
  shown_.notes = std::move(made.notes);
  FileNotes& notes = shown_.notes;
  if (!notes.of_calibration.empty()) Log(Severity::Warning, Event::StateUnreadable, notes.of_calibration, name());
  if (config_.rig.axes[drivers::Axis::Focus].keep) {
    if (std::string why = rig::WhyFocusIsNotKept(rig->lens()); !why.empty()) notes.warnings.push_back(std::move(why));
  }
  for (const std::string& warning : notes.warnings) Log(Severity::Warning, Event::StateUnreadable, warning, name());
  if ((config_.start_last || !config_.start_preset.empty()) && surroundings_.state.empty()) {
    Log(Severity::Warning, Event::StateNotKept,
        "start: lensd forgets at its end where the lens is to stand, since it runs without a state folder: start it "
        "with "
        "lensd --state DIR",
        name());
  }
  TellLeftOut();
  kept_.calibration = std::move(made.calibration);
  kept_.presets = std::move(presets);
  plans_.optics = rig->GetStatus().optics;
  plans_.limits_set = rig->GetStatus().limits_set;
  plans_.planning = SharedPlanning(*rig, config_.rig);
  shown_.info = varlink::WriteJson(InfoJson(name(), *rig, config_.rig, plans_.planning.get(), kept_.calibration.path));
  const rig::Status now = rig->GetStatus();
  const drivers::Capabilities lens = rig->lens();
  const std::string_view connection = ConnectionOf(now);
  Show(std::make_shared<const rig::Status>(now), StatusText(StateJson(now), connection, now), connection);
  opening_.left_moving = false;
  Worker::Listener listener;
  const std::shared_ptr<Tenure> tenure = opening_.tenure;
  listener.published = [this, tenure](const rig::Status& status, std::vector<Worker::Task> later) {
    Published(tenure, status, std::move(later));
  };
  listener.ended = [this, tenure](std::vector<Worker::Task> later, std::optional<Error> why) {
    surroundings_.loop.Post([this, tenure, later = std::move(later), why = std::move(why)]() mutable {
      if (tenure->over()) return;
      for (Worker::Task& task : later) (void)Guarded(name(), task);
      WorkerEnded(std::move(why));
    });
  };
  worker_ = std::make_unique<Worker>(std::move(rig), surroundings_.clock, stop_signal_, std::move(listener));
  ++users_->work.openings;
  users_->holds = {};
  users_->refocus->Opened(std::move(made.memory.drift));
  users_->slope->Opened(std::move(made.memory.slopes), SlopeFile(config_, surroundings_.state, lens.serial));
  KeepUnwritten(std::move(made.unwritten));
  if (config_.home_at_start) HomeAtStart();
  users_->stay->Opened(std::move(made.memory.last), lens);
}

/// Told to end, or because something threw: then the device is opened anew, the later the more often that happened.
void ServedLens::WorkerEnded(std::optional<Error> why) {
  if (opening_.life >= Life::Parking) {
    if (why) Log(Severity::Error, Event::LensFailed, why->message, name());
    if (PositionsWait(*shown_.status)) {
      const auto& unkept = shown_.status->unkept;
      Log(Severity::Error, Event::StateNotKept,
          "its positions are not on disk, and lensd tries no more: " +
              (unkept ? unkept->reason : "an axis did not come to rest, and is not known at the next start"),
          name());
    }
    opening_.life = Life::Ended;
    return;
  }
  ++users_->work.failures;
  const std::string problem = why ? why->message : "its worker ended";
  Log(Severity::Error, Event::LensFailed, problem + "; it is opened again", name());
  worker_.reset();
  simulation_.reset();
  ShowAbsent("absent", problem);
  TellChange();
  OpenAfter(PauseAfterFailure());
}

/// The longer the more often workers have failed.
Duration ServedLens::PauseAfterFailure() {
  return Retry::kFirstPause * (1 << std::min(opening_.failures++, kMostDoublings));
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
void ServedLens::Published(const std::shared_ptr<Tenure>& tenure, const rig::Status& status,
                           std::vector<Worker::Task> later) {
  Json json = StateJson(status);
  std::string without_time = varlink::WriteJson(json);
  const bool changed = without_time != shown_.published;
  shown_.published = std::move(without_time);
  std::string text = StatusText(std::move(json), ConnectionOf(status), status);
  surroundings_.loop.Post([this, tenure, copy = std::make_shared<const rig::Status>(status), text = std::move(text),
                           changed, tasks = std::move(later)]() mutable {
    if (tenure->over()) return;
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
      if (config_.home_at_start && FirstUnhomed(*shown_.status)) HomeAtStart();
      users_->stay->Back();
    } else {
      Log(Severity::Warning, Event::LensLost, shown_.status->problem, name());
    }
  }
  // So short without power that only its references are gone.
  const bool idle = shown_.status->activity.kind == rig::Activity::Kind::Idle;
  if (idle && before->connected && shown_.status->connected && !FirstUnhomed(*before) && FirstUnhomed(*shown_.status)) {
    users_->stay->Back();
  }
  users_->refocus->Look();
  users_->stay->Look();
  if (before->unkept.has_value() != shown_.status->unkept.has_value()) TellKept("its positions", shown_.status->unkept);
  if (!changed) return;
  TellChange();
  TellFaults(*before);
}

void ServedLens::Replan(std::function<void(const Result<void>&)> then) {
  struct Replanned {
    std::shared_ptr<const Planning> planning;
    std::string info;
    std::shared_ptr<const rig::OpticsTable> optics;
    int limits_set = 0;
  };
  const auto replan = [this, file = kept_.calibration.path](rig::Rig& rig, auto answer) {
    auto planning = SharedPlanning(rig, config_.rig);
    std::string info = varlink::WriteJson(InfoJson(name(), rig, config_.rig, planning.get(), file));
    const rig::Status now = rig.GetStatus();
    answer(Replanned{std::move(planning), std::move(info), now.optics, now.limits_set});
  };
  Ask<Replanned>(replan, [this, then = std::move(then)](const Result<Replanned>& now) {
    if (!now) return then(PassOn(now));
    plans_ = {now->planning, now->optics, now->limits_set};
    shown_.info = now->info;
    then({});
  });
}

}  // namespace lensd::daemon
