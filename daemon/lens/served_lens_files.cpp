// The files that are kept of a lens: what it is opened with, and what becomes of its calibration and presets. A file
// that is of no use harms this lens alone, and as little of it as can be.
#include <algorithm>
#include <chrono>
#include <deque>
#include <utility>

#include "daemon/events/log.h"
#include "daemon/lens/served_lens.h"
#include "daemon/lens/tenure.h"
#include "daemon/state/lens_state_files.h"
#include "daemon/state/position_store.h"
#include "io/checked_file.h"

namespace lensd::daemon {

namespace {

using KeptCalibration = Kept<std::shared_ptr<const rig::Calibration>>;

std::string SaidUncalibrated(const Error& error) {
  return error.message +
         "; the lens is uncalibrated until the file is corrected (then: lensctl reload) or lensctl calibrate writes "
         "another";
}

/// A file that is of no use leaves the lens without a calibration, and is told of.
KeptCalibration CalibrationIn(const std::string& file, Writer writer, const std::string& lens) {
  auto loaded = LoadCalibration(file, writer);
  if (!loaded) return {.content = nullptr, .warning = SaidUncalibrated(loaded.error())};
  if (!loaded->content && writer == Writer::People) {
    Log(Severity::Warning, Event::CalibrationMissing, file + " is not there yet: uncalibrated until lensctl calibrate",
        lens);
  }
  return *std::move(loaded);
}

}  // namespace

// ---- opening ------------------------------------------------------------------------------------------------------

/// Null: nothing is to be remembered. A file that cannot be read makes every position unknown, and is told of.
std::unique_ptr<rig::PositionMemory> ServedLens::Memory(const std::string& serial, Made& made) const {
  if (surroundings_.state.empty()) return nullptr;
  auto store = std::make_unique<PositionStore>(surroundings_.state, name(), serial, stop_signal_);
  if (auto loaded = store->Load(); !loaded) {
    std::string warning = loaded.error().message + ": no position of this lens is known until it is homed";
    const auto copy = loaded.error().code == Code::BadData ? io::KeepDamaged(store->path()) : Result<std::string>("");
    if (copy && !copy->empty()) warning += "; the file is kept as " + *copy;
    made.notes.warnings.push_back(std::move(warning));
  }
  made.memory.left = store->left();
  return store;
}

Result<drivers::Device> ServedLens::OpenUnder(const std::shared_ptr<Tenure>& tenure) const {
  auto device = open_();
  if (!device) return device;
  if (tenure->over()) return Fail(Code::Cancelled, "given up");
  return Under(tenure, *std::move(device));
}

/// On the thread of Retry.
Result<ServedLens::Made> ServedLens::MakeRig(const std::shared_ptr<Tenure>& tenure) {
  auto device = OpenUnder(tenure);
  if (!device) return PassOn(device);
  const std::string file = CalibrationFile(config_, surroundings_.state, device->lens->capabilities().serial);
  FileMark mark = MarkOf(file);
  auto unwritten = kept_.unwritten.Get();
  if (unwritten && unwritten->file != file) unwritten.reset();  // of another device
  auto kept = unwritten ? KeptCalibration{.content = unwritten->calibration}
                        : CalibrationIn(file, config_.rig.calibration_path ? Writer::People : Writer::Lensd, name());
  auto made = RigOf(*std::move(device), kept.content);
  if (!made && kept.content) {
    const std::string why = file + ": " + made.error().message;
    // Whole, or as a person wrote it: then it is another lens'.
    if (kept.warning.empty()) return Fail(Code::BadData, why);
    kept.warning = SaidUncalibrated(Damaged(file, why));
    device = OpenUnder(tenure);
    if (!device) return PassOn(device);
    made = RigOf(*std::move(device), nullptr);
  }
  if (!made) return made;
  made->notes.of_calibration = kept.warning;
  made->calibration = std::move(mark);
  made->unwritten = std::move(unwritten);
  return made;
}

/// On the thread of Retry.
void ServedLens::LoadLearned(Made& made) const {
  const auto take = [&]<class Content>(Result<daemon::Kept<Content>> kept, Result<Content>& learned) {
    const std::string warning =
        kept ? kept->warning
             : kept.error().message + ": nothing more is saved there until this is corrected and lensd is restarted";
    if (!warning.empty()) made.notes.warnings.push_back(warning);
    learned = kept ? Result<Content>(std::move(kept->content)) : PassOn(kept);
  };
  const std::string& state = surroundings_.state;
  if (config_.rig.refocus) take(LoadFocusDrift(RefocusFile(config_, state)), made.memory.drift);
  if (config_.start_last) {
    Result<std::vector<rig::Preset>> last;
    take(LoadPresets(LastFile(config_, state)), last);
    made.memory.last = LastPlace(last && !last->empty() ? std::optional(std::move(last->front())) : std::nullopt,
                                 made.memory.left, *made.rig);
  }
  take(LoadLearnedSlope(SlopeFile(config_, state, made.rig->lens().serial)), made.memory.slopes);
}

Result<ServedLens::Made> ServedLens::RigOf(drivers::Device device,
                                           std::shared_ptr<const rig::Calibration> calibration) const {
  Made made;
  auto memory = Memory(device.lens->capabilities().serial, made);
  made.simulation = device.simulation;
  rig::RigConfig config = config_.rig;
  config.axes[drivers::Axis::Focus].seen = SeenOf(device.lens->capabilities().serial, made.notes.warnings);
  auto rig = rig::Rig::Create(std::move(config), std::move(device), surroundings_.clock, std::move(calibration),
                              std::move(memory));
  if (!rig) return PassOn(rig);
  made.rig = *std::move(rig);
  made.notes.devices = made.rig->findings();
  return made;
}

/// A file that cannot be read tells nothing, and people are told.
std::optional<drivers::Direction> ServedLens::SeenOf(const std::string& serial,
                                                     std::vector<std::string>& warnings) const {
  if (const auto seen = users_->direction.Get(serial)) return *seen;
  auto kept = LoadSeenDirection(DirectionFile(config_, surroundings_.state, serial));
  const std::string warning =
      kept ? kept->warning : kept.error().message + ": the direction of focus that setup measured is not known";
  if (!warning.empty()) warnings.push_back(warning);
  return kept ? kept->content : std::nullopt;
}

// ---- changes ------------------------------------------------------------------------------------------------------

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
    KeepCalibration(++kept_.calibration_writes, *next, [this, done](const Result<void>& kept) {
      Replan([this, done, kept](const Result<void>&) {
        TellCalibration(kept);
        done(kept);
      });
    });
  });
}

/// Where the lens was opened with what was not on disk: shows it, and goes on writing it.
void ServedLens::KeepUnwritten(std::optional<UnwrittenCalibration::Content> unwritten) {
  const std::uint64_t number =
      ++kept_.calibration_writes;  // what waits to be tried again is of the rig before this one
  if (unwritten) {
    const auto unheard = [](const Result<void>&) {};
    return KeepCalibration(number, std::move(unwritten->calibration), unheard);
  }
  if (const auto lost = kept_.unwritten.Get()) {
    Log(Severity::Error, Event::CalibrationMissing,
        lost->file + ": could not be written, and another device is there now", name());
    surroundings_.files.Forget(lost->file);
  }
  kept_.unwritten.Put(std::nullopt);
  kept_.calibration_unkept.reset();
}

/// Writes it, and goes on trying until that works or a newer one is there. Busy, NotKept.
void ServedLens::KeepCalibration(std::uint64_t number, std::shared_ptr<const rig::Calibration> next,
                                 std::function<void(const Result<void>&)> then) {
  if (!kept_.calibration.path.empty()) kept_.unwritten.Put(UnwrittenCalibration::Content{kept_.calibration.path, next});
  const KeptFile file{.path = kept_.calibration.path, .lens = name(), .what = "its calibration"};
  std::string text = next ? rig::CalibrationText(*next) : "";
  auto ended = [this, number, next = std::move(next), then = std::move(then)](Result<void> kept, const FileMark& mark) {
    if (kept && number == kept_.calibration_writes) {
      kept_.calibration = mark;
      kept_.unwritten.Put(std::nullopt);
    }
    if (!kept) {
      const Code code = kept.error().code == Code::Busy ? Code::Busy : Code::NotKept;
      kept = Fail(code, "in use, but not saved: " + kept.error().message + "; lensd keeps trying");
    }
    NoteCalibration(number, next, kept);
    then(kept);
  };
  surroundings_.files.Keep(file, std::move(text), std::move(ended));
}

/// What became of an attempt to write the calibration that is in force.
void ServedLens::NoteCalibration(std::uint64_t number, const std::shared_ptr<const rig::Calibration>& next,
                                 const Result<void>& kept) {
  constexpr Duration kTryAgainAfter = std::chrono::seconds(1);
  if (number != kept_.calibration_writes || opening_.life >= Life::Ending) return;
  auto& unkept = kept_.calibration_unkept;
  const bool failed_before = unkept.has_value();
  if (kept) {
    unkept.reset();
  } else {
    unkept = rig::Unkept{failed_before ? unkept->since : surroundings_.clock.Now(), kept.error().message};
    surroundings_.loop.After(kTryAgainAfter, [this, number, next] {
      if (number == kept_.calibration_writes) KeepCalibration(number, next, [](const Result<void>&) {});
    });
  }
  if (failed_before != unkept.has_value()) TellKept("its calibration", unkept);
  if (!worker_) return;
  (void)worker_->Submit([this, unkept, tenure = opening_.tenure](rig::Rig&) {
    if (tenure->over()) return;  // it hung meanwhile, and another one tells of this lens
    shown_.notes.calibration_unkept = unkept;
    if (!unkept) shown_.notes.of_calibration.clear();
  });
}

void ServedLens::ChangePresets(EditPresets edit, std::function<void(const Result<void>&)> done) {
  if (kept_.preset_changes.size() >= TaskThread::kMostTasks) {
    return done(Fail(Code::Busy, "too many presets wait to be written; try again"));
  }
  kept_.preset_changes.push_back({std::move(edit), std::move(done)});
  if (!kept_.presets_under_way) WritePresets();
}

/// Carries out the changes that wait, one after the other, and writes the file once for all of them: on a slow disk
/// they would pile up otherwise. A file that cannot be read is never written over.
void ServedLens::WritePresets() {
  auto waiting = std::exchange(kept_.preset_changes, {});
  if (!kept_.presets) {
    const auto why = Fail(Code::NotKept, "presets cannot be kept: " + kept_.presets.error().message);
    for (PresetChange& change : waiting) change.done(why);
    return;
  }
  std::vector<rig::Preset> presets = *kept_.presets;
  std::vector<std::function<void(const Result<void>&)>> made;
  kept_.presets_under_way = true;
  for (PresetChange& change : waiting) {
    std::vector<rig::Preset> changed = presets;
    if (auto edited = change.edit(changed); !edited) {
      change.done(edited);
      continue;
    }
    presets = std::move(changed);
    made.push_back(std::move(change.done));
  }
  std::ranges::sort(presets, {}, &rig::Preset::label);
  const auto end = [this, presets, made](const Result<void>& kept) {
    if (kept) kept_.presets = presets;
    kept_.presets_under_way = false;
    for (const auto& done : made) done(kept);
    if (!kept_.presets_under_way && !kept_.preset_changes.empty()) WritePresets();
  };
  if (made.empty()) return end({});
  const KeptFile file{.path = PresetsFile(config_, surroundings_.state),
                      .lens = name(),
                      .what = "its presets",
                      .otherwise = KeptFile::Otherwise::Undone};
  surroundings_.files.Keep(file, rig::PresetsText(presets), [end](const Result<void>& kept, const FileMark&) {
    if (kept) return end({});
    if (kept.error().code == Code::Busy) return end(Fail(Code::Busy, kept.error().message + "; try again"));
    end(Fail(Code::NotKept, "the presets could not be written: " + kept.error().message));
  });
}

}  // namespace lensd::daemon
