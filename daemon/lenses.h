// From a configuration to open devices behind the service.
#pragma once

#include "base/clock.h"
#include "base/result.h"
#include "config.h"
#include "lens_service.h"
#include "plug_signal.h"

namespace lensd::daemon {

/// Opens one lens' devices. BadData where the configuration is at fault, otherwise the driver's error; every message
/// names the lens and its place in the file. With `signal`, what vanishes is opened anew (replug.h).
Result<drivers::Device> OpenDevice(const LensConfig& config, const Clock& clock, PlugSignal* signal = nullptr);

/// Whether an error of OpenDevice() says that the device is not there or not usable yet, the configuration being fine.
bool MayComeYet(Code code);

/// Opens every lens and hands it to the service; one that is not there is served as disconnected until it comes.
Result<void> OpenLenses(const Config& config, const Clock& clock, LensService& service);

}  // namespace lensd::daemon
