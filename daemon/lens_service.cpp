#include "lens_service.h"

#include <algorithm>
#include <utility>

#include "calibration_store.h"
#include "lens_entry.h"
#include "lens_json.h"
#include "log.h"
#include "position_store.h"
#include "proto/interfaces.h"

namespace lensd::daemon {

using proto::Json;

namespace {

void AddTime(Json& json, const rig::Status& status) {
  json["readAtMs"] = std::chrono::duration<double, std::milli>(status.sampled_at.time_since_epoch()).count();
}

/// LensStatus, serialised.
std::string StatusText(const std::string& name, const rig::Status& status) {
  Json json = StatusJson(name, status);
  AddTime(json, status);
  return proto::WriteJson(json);
}

std::shared_ptr<const rig::Status> AbsentStatus(std::string problem) {
  auto status = std::make_shared<rig::Status>();
  status->problem = std::move(problem);
  return status;
}

bool AllHomed(const rig::Status& status) {
  return std::ranges::all_of(drivers::kAxes,
                             [&](drivers::Axis axis) { return !status.axes[axis] || status.axes[axis]->homed; });
}

}  // namespace

LensService::LensService(EventLoop& loop, const Clock& clock, std::string state)
    : loop_(loop), clock_(clock), state_(std::move(state)), definition_(BuiltInDefinition(proto::LensInterfaceText())) {
  handlers_ = {{"List", &LensService::List},
               {"Devices", &LensService::Devices},
               {"Status", &LensService::Status},
               {"Monitor", &LensService::Monitor},
               {"Move", &LensService::Move},
               {"Home", &LensService::Home},
               {"Stop", &LensService::Stop},
               {"ResetFaults", &LensService::ResetFaults},
               {"TakeLease", &LensService::TakeLease},
               {"DropLease", &LensService::DropLease},
               {"Plan", &LensService::Plan},
               {"Autofocus", &LensService::Autofocus},
               {"Snapshot", &LensService::Snapshot},
               {"AutofocusBegin", &LensService::AutofocusBegin},
               {"AutofocusPixels", &LensService::AutofocusPixels},
               {"AutofocusFrame", &LensService::AutofocusFrame},
               {"AutofocusScore", &LensService::AutofocusScore},
               {"AutofocusEnd", &LensService::AutofocusEnd},
               {"Calibration", &LensService::Calibration},
               {"Calibrate", &LensService::Calibrate},
               {"Backlash", &LensService::Backlash},
               {"PresetSave", &LensService::PresetSave},
               {"PresetList", &LensService::PresetList},
               {"PresetRecall", &LensService::PresetRecall},
               {"PresetRemove", &LensService::PresetRemove}};
}

LensService::~LensService() = default;

/// Null: nothing is to be remembered. A file that cannot be read makes every position unknown, and is told of.
std::unique_ptr<rig::PositionMemory> LensService::MemoryOf(const std::string& lens, const std::string& serial) const {
  if (state_.empty()) return nullptr;
  auto store = std::make_unique<PositionStore>(state_, lens, serial);
  if (auto loaded = store->Load(); !loaded) {
    Log(Severity::Warning, Event::LensLost,
        loaded.error().message + ": no position of this lens is known until it is homed", lens);
  }
  return store;
}

Result<void> LensService::AddLens(const LensConfig& config, drivers::Device device) {
  auto rig = MakeRig(config, std::move(device));
  if (!rig) return PassOn(std::move(rig));
  lenses_.push_back(std::make_unique<Lens>());
  lenses_.back()->config = config;
  lenses_.back()->name = config.name;
  StartRig(*lenses_.back(), *std::move(rig));
  return {};
}

void LensService::StartRig(Lens& lens, std::unique_ptr<rig::Rig> rig) {
  lens.calibration_file = CalibrationFile(lens.config, state_, rig->lens().serial);
  lens.presets_file = PresetsFile(lens.config, state_);
  if (auto presets = LoadPresets(lens.presets_file); presets) {
    lens.presets = *std::move(presets);
  } else {
    Log(Severity::Warning, Event::LensLost, presets.error().message + ": no presets until that is mended", lens.name);
    lens.presets_broken = presets.error().message;
  }
  lens.planned_for = rig->GetStatus().optics;
  lens.planning = PlanningOf(*rig, lens.config.rig);
  lens.info = proto::WriteJson(InfoJson(lens.name, *rig, lens.config.rig, lens.planning, lens.calibration_file));
  lens.status = std::make_shared<const rig::Status>(rig->GetStatus());
  lens.text = StatusText(lens.name, *lens.status);
  lens.worker = std::make_unique<Worker>(std::move(rig), clock_,
                                         [this, &lens](const rig::Status& now, std::vector<Worker::Task> later) {
                                           Published(lens, now, std::move(later));
                                         });
  if (lens.config.home_at_start) HomeAtStart(lens);
}

void LensService::AddAbsentLens(const LensConfig& config, const Error& why,
                                std::function<Result<drivers::Device>()> open) {
  lenses_.push_back(std::make_unique<Lens>());
  Lens& lens = *lenses_.back();
  lens.config = config;
  lens.name = config.name;
  lens.info = proto::WriteJson(AbsentInfoJson(config.name, config.device.driver->name));
  lens.status = AbsentStatus(why.message);
  lens.text = StatusText(lens.name, *lens.status);
  Log(Severity::Warning, Event::LensLost, why.message, lens.name);
  lens.retry.emplace(plug_signal_, [this, &lens, open = std::move(open)] { return TryToOpen(lens, open); });
}

/// On the thread of the lens' Retry.
bool LensService::TryToOpen(Lens& lens, const std::function<Result<drivers::Device>()>& open) {
  auto device = open();
  auto rig = device ? MakeRig(lens.config, *std::move(device))
                    : Result<std::unique_ptr<rig::Rig>>(std::unexpected(device.error()));
  const bool opened = rig.has_value();
  loop_.Post([this, &lens, rig = std::move(rig)]() mutable {
    if (rig) {
      lens.retry.reset();
      StartRig(lens, *std::move(rig));
      Log(Severity::Info, Event::LensReady, "the lens is there", lens.name);
    } else if (lens.status->problem == rig.error().message) {
      return;
    } else {
      lens.status = AbsentStatus(rig.error().message);
      lens.text = StatusText(lens.name, *lens.status);
    }
    TellWatchers(lens);
  });
  return opened;
}

Result<std::unique_ptr<rig::Rig>> LensService::MakeRig(const LensConfig& config, drivers::Device device) const {
  const std::string serial = device.lens->capabilities().serial;
  const std::string file = CalibrationFile(config, state_, serial);
  auto calibration = LoadCalibration(file);
  if (!calibration) return PassOn(std::move(calibration));
  if (!*calibration && config.rig.calibration_path) {
    Log(Severity::Warning, Event::LensLost, file + " is not there yet: uncalibrated until lensctl calibrate",
        config.name);
  }
  auto rig = rig::Rig::Create(config.rig, std::move(device), clock_, *calibration, MemoryOf(config.name, serial));
  if (!rig && *calibration) return Fail(Code::BadData, file + ": " + rig.error().message);
  return rig;
}

bool LensService::Stale(const Lens& lens) const {
  return lens.worker && lens.status->optics != lens.planned_for &&
         lens.status->activity.kind == rig::Activity::Kind::Idle;
}

void LensService::Replan(Lens& lens, std::function<void()> then) {
  lens.worker->Submit([&lens, then = std::move(then)](rig::Rig& rig) mutable {
    auto planning = PlanningOf(rig, lens.config.rig);
    std::string info = proto::WriteJson(InfoJson(lens.name, rig, lens.config.rig, planning, lens.calibration_file));
    lens.worker->Later([&lens, planning = std::move(planning), info = std::move(info), optics = rig.GetStatus().optics,
                        then = std::move(then)]() mutable {
      lens.planning = std::move(planning);
      lens.info = std::move(info);
      lens.planned_for = std::move(optics);
      then();
    });
  });
}

/// On the worker's thread.
void LensService::Published(Lens& lens, const rig::Status& status, std::vector<Worker::Task> later) {
  Json json = StatusJson(lens.name, status);
  std::string without_time = proto::WriteJson(json);
  const bool changed = without_time != lens.published;
  lens.published = std::move(without_time);
  AddTime(json, status);
  loop_.Post([this, &lens, copy = std::make_shared<const rig::Status>(status), text = proto::WriteJson(json), changed,
              tasks = std::move(later)]() mutable {
    Update(lens, std::move(copy), std::move(text), changed);
    for (Worker::Task& task : tasks) task();
  });
}

void LensService::Update(Lens& lens, std::shared_ptr<const rig::Status> status, std::string text, bool changed) {
  const bool was_connected = lens.status->connected;
  lens.status = std::move(status);
  lens.text = std::move(text);
  if (lens.status->connected != was_connected) {
    if (lens.status->connected) {
      Log(Severity::Info, Event::LensReady, "the lens answers", lens.name);
      if (lens.config.home_at_start && !AllHomed(*lens.status)) HomeAtStart(lens);
    } else {
      Log(Severity::Warning, Event::LensLost, lens.status->problem, lens.name);
    }
  }
  if (changed) TellWatchers(lens);
}

void LensService::TellWatchers(const Lens& lens) {
  for (auto& [key, watcher] : watchers_) {
    if (watcher.only == nullptr || watcher.only == &lens) watcher.changed(lens);
  }
}

void LensService::Serve(std::string_view method, const ExchangePointer& exchange) {
  if (MayDrive(method, exchange)) (this->*handlers_.at(method))(exchange);
}

LensService::Lens* LensService::FindLens(const ExchangePointer& exchange) {
  Lens* const lens = FindNamed(exchange);
  if (lens == nullptr || lens->worker) return lens;
  Refuse(exchange, {Code::Disconnected, lens->status->problem});
  return nullptr;
}

LensService::Lens* LensService::FindNamed(const ExchangePointer& exchange) {
  const auto name = exchange->view().Given("lens");
  if (!name && lenses_.size() == 1) return lenses_.front().get();
  std::string names;
  for (const auto& lens : lenses_) {
    if (name && name->text() == lens->name) return lens.get();
    names += (names.empty() ? "" : ", ") + lens->name;
  }
  if (!name && !lenses_.empty()) {
    Refuse(exchange, {Code::InvalidArgument, "say which lens: there is " + names});
    return nullptr;
  }
  const std::string what = name ? "there is no lens \"" + std::string(name->text()) + "\"; " : "";
  const std::string message = what + (lenses_.empty() ? "no lens is configured" : "there is " + names);
  exchange->Refuse("io.lensd.Lens.LensNotFound", {{"message", message}});
  return nullptr;
}

void LensService::Watch(Watcher watcher) {
  const Exchange* const key = watcher.exchange.get();
  watcher.exchange->OnGone([this, key] { loop_.Post([this, key] { Unwatch(key); }); });
  watchers_.emplace(key, std::move(watcher));
}

void LensService::Announce(const Lens& lens, std::string_view field, const std::string& result) {
  const std::string event = "{\"event\":{\"" + std::string(field) + "\":" + result + "}}";
  for (auto& [key, watcher] : watchers_) {
    if (watcher.wants_events && (watcher.only == nullptr || watcher.only == &lens)) watcher.exchange->Continue(event);
  }
}

void LensService::AnnounceMoves(const Lens& lens, const Json& moves) {
  for (const Json& move : moves) Announce(lens, "move", proto::WriteJson(move));
}

void LensService::Refuse(const ExchangePointer& exchange, const Error& error) {
  exchange->Refuse(ErrorName(error.code), {{"message", error.message}});
}

}  // namespace lensd::daemon
