// A device that may be unplugged: its lens and camera answer Disconnected while it is gone, and go on when it is back.
#pragma once

#include <functional>

#include "base/result.h"
#include "daemon/threads/plug_signal.h"
#include "drivers/api/device.h"

namespace lensd::daemon {

/// What comes back where a device comes back.
struct ComesBack {
  /// Its driver's process, perhaps alone: it is started with growing pauses, and what the one before left moving is
  /// stopped.
  bool process = false;
  /// What it knows of its reference: an axis is homed if the device says so.
  bool reference = false;
};

/// Wraps an open device. Once one of its calls fails with Disconnected it is closed, and `open` is tried on a thread of
/// its own until the same device is there again (same model, serial number, axes and ranges); another one stays
/// Disconnected, with the reason. After that, unless its reference comes back, every axis that can home counts as not
/// homed until it is, and one that needs to be homed refuses absolute moves: what happened meanwhile is not known. A
/// camera that was streaming streams again. `open` must be callable from any thread, one call at a time; `signal` must
/// outlive the device.
drivers::Device SurviveUnplugging(drivers::Device device, std::function<Result<drivers::Device>()> open,
                                  PlugSignal& signal, ComesBack comes_back = {});

}  // namespace lensd::daemon
