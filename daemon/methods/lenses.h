// From a configuration to the lenses of the service and their devices.
#pragma once

#include "base/clock.h"
#include "base/result.h"
#include "daemon/config/config.h"
#include "daemon/methods/lens_service.h"
#include "daemon/threads/plug_signal.h"

namespace lensd::daemon {

/// Opens one lens' devices. BadData where the configuration is at fault, otherwise the driver's error; every message
/// names the lens and its place in the file. With `signal`, what vanishes is opened anew (replug.h).
Result<drivers::Device> OpenDevice(const LensConfig& config, const Clock& clock, PlugSignal* signal = nullptr);

/// Whether the settings of its drivers make sense, as far as can be told without their devices. BadData: "file:line:
/// what is wrong".
Result<void> CheckSettings(const LensConfig& config);

/// Whether the settings of all of them make sense.
Result<void> CheckAll(const Config& config);

/// What opens a lens of the service.
ServedLens::Open OpenerOf(const LensConfig& lens, const Clock& clock, LensService& service);

/// Hands every lens to the service. BadData: settings that make no sense.
Result<void> AddLenses(const Config& config, const Clock& clock, LensService& service);

}  // namespace lensd::daemon
