// The simulated USB camera plugged into this machine's own USB stack over USB/IP (module vhci_hcd): the kernel, its
// uvcvideo and libusb see a device like any other. Needs root.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "base/clock.h"
#include "base/result.h"
#include "sim/devices/uvc_model.h"
#include "sim/devices/uvc_stream.h"

namespace lensd::sim::devices {

/// Runs on a thread of its own. Calls from any thread.
class UvcCamera {
 public:
  /// Not plugged in yet. `clock` must outlive it. Errors as UvcModel::Create().
  static Result<std::unique_ptr<UvcCamera>> Create(std::shared_ptr<const Scene> scene, const Clock& clock,
                                                   const UvcOptions& options);
  ~UvcCamera();

  /// Plugs it in and returns once the kernel has taken the connection; its driver needs a moment more. Harmless when
  /// plugged in. Io: no vhci_hcd, no free port, not permitted. Timeout: the kernel has not let go of the last one.
  Result<void> Plug();
  /// Pulls the plug, whatever is under way. Harmless when not plugged in.
  void Unplug();

  /// Sets what goes wrong from now on.
  void SetFaults(const UvcFaults& faults);
  void SetFaults(const StreamFaults& faults);
  /// Looks at the model between two requests.
  void Look(const std::function<void(UvcModel&)>& at);
  const std::shared_ptr<const Truth>& truth() const;

 private:
  class Server;
  explicit UvcCamera(std::unique_ptr<Server> server);
  std::unique_ptr<Server> server_;
};

}  // namespace lensd::sim::devices
