// The interface io.lensd.Lens: every configured lens, served to whoever calls.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "config.h"
#include "event_loop.h"
#include "planning.h"
#include "plug_signal.h"
#include "rig/backlash.h"
#include "rig/presets.h"
#include "rig/rig.h"
#include "router.h"
#include "task_thread.h"
#include "worker.h"

namespace lensd::daemon {

/// Event loop thread only. Reading a state never waits for a device: each worker publishes its rig's state, serialised,
/// after every step.
class LensService final : public Service {
 public:
  /// `loop` and `clock` must outlive the service. `state`: folder for what outlives the daemon; empty: nowhere.
  LensService(EventLoop& loop, const Clock& clock, std::string state = "");
  ~LensService() override;

  /// Starts serving one lens, and homing it where it is to start homed; before the loop runs. InvalidArgument: optics
  /// that make no sense.
  Result<void> AddLens(const LensConfig& config, drivers::Device device);
  /// Starts serving a lens that is not there, `why` says what is missing: it is disconnected until `open` works, which
  /// is tried on a thread of its own.
  void AddAbsentLens(const LensConfig& config, const Error& why, std::function<Result<drivers::Device>()> open);
  /// Raised when something was plugged in: whoever waits for a device looks at once. Outlives every device.
  PlugSignal& plug_signal() { return plug_signal_; }

  const proto::InterfaceDefinition& definition() const override { return definition_; }
  void Serve(std::string_view method, const ExchangePointer& exchange) override;

 private:
  struct Lens;
  void StartRig(Lens& lens, std::unique_ptr<rig::Rig> rig);
  bool TryToOpen(Lens& lens, const std::function<Result<drivers::Device>()>& open);
  using Handler = void (LensService::*)(const ExchangePointer&);
  /// A call that hears of every change: Status with `more`, Monitor, Move with `more`.
  struct Watcher {
    ExchangePointer exchange;
    const Lens* only = nullptr;  ///< null: all lenses
    std::function<void(const Lens&)> changed;
    bool wants_events = false;  ///< also hears of finished moves and autofocus
  };

  std::unique_ptr<rig::PositionMemory> MemoryOf(const std::string& lens, const std::string& serial) const;
  void List(const ExchangePointer& exchange);
  void Devices(const ExchangePointer& exchange);
  std::string DevicesReply(const struct Search& search) const;
  std::optional<std::string> UserOf(std::string_view driver, std::string_view serial) const;
  void Status(const ExchangePointer& exchange);
  void Monitor(const ExchangePointer& exchange);
  void Move(const ExchangePointer& exchange);
  void Home(const ExchangePointer& exchange);
  void HomeAtStart(Lens& lens);
  void Stop(const ExchangePointer& exchange);
  void ResetFaults(const ExchangePointer& exchange);
  void TakeLease(const ExchangePointer& exchange);
  void DropLease(const ExchangePointer& exchange);
  /// False: a lease of somebody else stands against the call, and it has been told.
  bool MayDrive(std::string_view method, const ExchangePointer& exchange);
  bool LeaseHolds(Lens& lens) const;
  void Plan(const ExchangePointer& exchange);
  void Apply(const ExchangePointer& exchange, Lens& lens, optics::PlanRequest request, const LensPlan& plan);
  void Autofocus(const ExchangePointer& exchange);
  void AutofocusBegin(const ExchangePointer& exchange);
  void AutofocusPixels(const ExchangePointer& exchange);
  void AutofocusFrame(const ExchangePointer& exchange);
  void AutofocusScore(const ExchangePointer& exchange);
  void AutofocusEnd(const ExchangePointer& exchange);
  void Snapshot(const ExchangePointer& exchange);

  /// An autofocus whose frames come from a client; see serve_autofocus.cpp.
  struct FrameSession;
  using FrameSessionPointer = std::shared_ptr<FrameSession>;
  FrameSessionPointer FindSession(const ExchangePointer& exchange);
  void Give(const FrameSessionPointer& session, const ExchangePointer& exchange,
            std::move_only_function<void(rig::Rig&, rig::StopCallback)> give);
  void Conclude(const FrameSessionPointer& session, const ExchangePointer& exchange);
  void EndSession(const FrameSessionPointer& session);

  void MoveZoom(const ExchangePointer& exchange, Lens& lens, const rig::Target& target);
  void MoveIris(const ExchangePointer& exchange, Lens& lens, const rig::Target& target);
  void FinishMove(const ExchangePointer& exchange, const Lens& lens, const proto::Json& move);
  void Calibration(const ExchangePointer& exchange);
  void Calibrate(const ExchangePointer& exchange);
  void Backlash(const ExchangePointer& exchange);
  void MeasureBacklash(const ExchangePointer& exchange, Lens& lens);
  void FinishBacklash(const ExchangePointer& exchange, Lens& lens, drivers::Axis axis, rig::BacklashOutcome outcome);
  void PresetSave(const ExchangePointer& exchange);
  void PresetList(const ExchangePointer& exchange);
  void PresetRecall(const ExchangePointer& exchange);
  void PresetRemove(const ExchangePointer& exchange);
  /// What becomes of a calibration; nothing: it is removed. On the worker's thread.
  using EditCalibration = std::function<Result<std::optional<rig::Calibration>>(rig::Calibration, const rig::Rig&)>;
  /// Puts what `edit` makes of the calibration in force and keeps it. `done` runs in the event loop; Code::Io there: it
  /// is in force, but could not be kept.
  void ChangeCalibration(Lens& lens, EditCalibration edit, std::function<void(const Result<void>&)> done);
  void TellCalibration(const ExchangePointer& exchange, Lens& lens);
  Result<void> KeepPresets(Lens& lens, std::vector<rig::Preset> presets);
  /// A rig with the calibration that is kept for it. From any thread.
  Result<std::unique_ptr<rig::Rig>> MakeRig(const LensConfig& config, drivers::Device device) const;
  /// What is planned with is of another zoom or temperature than the lens stands at.
  bool Stale(const Lens& lens) const;
  void Replan(Lens& lens, std::function<void()> then);

  /// The lens the call means, there or not; else answers the call with why not and returns null.
  Lens* FindNamed(const ExchangePointer& exchange);
  /// The same for calls that need the device: its worker is there.
  Lens* FindLens(const ExchangePointer& exchange);
  void Published(Lens& lens, const rig::Status& status, std::vector<Worker::Task> later);
  void Update(Lens& lens, std::shared_ptr<const rig::Status> status, std::string text, bool changed);
  void TellWatchers(const Lens& lens);
  void Watch(Watcher watcher);
  void Unwatch(const Exchange* exchange) { watchers_.erase(exchange); }
  void Announce(const Lens& lens, std::string_view field, const std::string& result);
  void AnnounceMoves(const Lens& lens, const proto::Json& moves);
  void ShowProgress(const ExchangePointer& exchange, const Lens& lens, drivers::Axis axis);
  /// Ends a call with an error of the rig.
  void Refuse(const ExchangePointer& exchange, const Error& error);
  void StreamFrame(const ExchangePointer& exchange, const rig::LensedFrame& frame);

  EventLoop& loop_;
  const Clock& clock_;
  const std::string state_;
  PlugSignal plug_signal_;
  proto::InterfaceDefinition definition_;
  std::map<std::string_view, Handler> handlers_;
  std::map<const Exchange*, Watcher> watchers_;
  std::map<std::int64_t, FrameSessionPointer> sessions_;
  std::int64_t last_session_ = 0;
  std::vector<std::unique_ptr<Lens>> lenses_;
  std::vector<ExchangePointer> searchers_;  // who waits for the search in progress
  TaskThread pictures_;                     // compresses snapshots
  TaskThread searches_;                     // looks for devices
};

}  // namespace lensd::daemon
