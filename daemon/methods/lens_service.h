// The interface io.lensd.Lens: every configured lens, served to every client.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "daemon/config/config.h"
#include "daemon/events/watchers.h"
#include "daemon/lens/served_lens.h"
#include "daemon/server/router.h"
#include "daemon/threads/plug_signal.h"
#include "loop/event_loop.h"

namespace lensd::daemon {

/// Event loop thread only.
class LensService final : public Service {
 public:
  /// `loop` and `clock` must outlive the service. `state`: folder for what outlives the daemon; empty: nowhere.
  LensService(EventLoop& loop, const Clock& clock, std::string state = "");
  ~LensService() override;

  /// Serves a lens; its device is opened on a thread of its own once Begin() is called.
  void AddLens(const LensConfig& config, ServedLens::Open open, const ServedLens* before = nullptr);
  void Begin();
  /// What became of the lenses, by name.
  struct Replaced {
    std::vector<std::string> added, removed, reopened, unchanged;
    std::vector<std::string> changed_files;  ///< for which lenses of the same configuration were opened anew
  };
  using OpenerOf = std::function<ServedLens::Open(const LensConfig&)>;
  /// Serves these lenses in place of those there are. One whose configuration is another one comes to its end and is
  /// opened anew after that; one whose configuration is the same goes on undisturbed, unless its calibration is not the
  /// file any more that is in `calibrations`, or a part of it was left out that may work by now. Busy: that was done
  /// too often, or lensd is stopping.
  Result<Replaced> Replace(const std::vector<LensConfig>& configs, const OpenerOf& opener,
                           const std::vector<FileMark>& calibrations = {});
  /// Where the calibrations of the lenses are kept.
  std::vector<std::string> CalibrationFiles() const;
  using Reload = std::function<void(std::function<void(const Result<Replaced>&)> then)>;
  /// How to read the configuration again, for the method Reload.
  void OnReload(Reload reload) { reload_ = std::move(reload); }
  const Reload& reload() const { return reload_; }
  KeptFiles& files() { return files_; }
  varlink::Json OwnMetrics();  ///< DaemonMetrics of the interface
  /// Stops what moves and answers every caller. No lens takes commands from now on. With `parks` what is to park goes
  /// there first, until this is called again. The answer is how long that may take at most.
  Duration End(ServedLens::Parks parks);
  /// Gives up calls of drivers that do not come back. To be called several times a second.
  void LookAfter();
  /// The lenses whose threads have not ended: the destructor would wait for them.
  std::vector<const ServedLens*> StillEnding() const;
  /// Raised when something was plugged in: a lens that waits for its device looks at once. Outlives every device.
  PlugSignal& plug_signal() { return plug_signal_; }

  const varlink::InterfaceDefinition& definition() const override { return definition_; }
  const MethodTable& methods() const override { return methods_; }
  bool Admit(const Method& method, const ExchangePointer& exchange) override;

  const std::vector<std::unique_ptr<ServedLens>>& lenses() const { return lenses_; }
  Watchers& watchers() { return watchers_; }
  EventLoop& loop() { return surroundings_.loop; }
  const Clock& clock() const { return surroundings_.clock; }
  /// The lens the call means, there or not; null: there is none.
  ServedLens* Named(const ExchangePointer& exchange) const;
  /// The same; else answers the call with why not and returns null.
  ServedLens* Find(const ExchangePointer& exchange);
  /// The same for calls that need it to take commands.
  ServedLens* FindPresent(const ExchangePointer& exchange, ServedLens::For what = ServedLens::For::Motion);
  /// Serves calls once the device of their lens has been tried.
  std::function<void(const ExchangePointer&)> ForPresent(std::function<void(const ExchangePointer&)> serve);
  /// The same for the calls for which FindPresent() finds a lens then.
  std::function<void(const ExchangePointer&)> ForLens(void (*serve)(ServedLens&, const ExchangePointer&));

 private:
  PlugSignal plug_signal_;
  Watchers watchers_;
  KeptFiles files_;
  TaskThread plans_;
  const LensSurroundings surroundings_;
  varlink::InterfaceDefinition definition_;
  void BeginAfter(ServedLens& lens, const ServedLens& before);
  void TellListed(const ServedLens& lens, std::string_view change, const std::string& reason);

  std::vector<std::unique_ptr<ServedLens>> lenses_;
  std::vector<std::unique_ptr<ServedLens>> retired_;  ///< calls under way may yet name them
  Reload reload_;
  MethodTable methods_;
};

}  // namespace lensd::daemon
