// From a configuration to open devices behind the service.
#pragma once

#include "base/clock.h"
#include "base/result.h"
#include "config.h"
#include "lens_service.h"

namespace lensd::daemon {

/// Opens one lens' devices. BadData where the configuration is at fault, otherwise the driver's error; every message
/// names the lens and its place in the file.
Result<drivers::Device> OpenDevice(const LensConfig& config, const Clock& clock);

/// Opens every lens and hands it to the service.
Result<void> OpenLenses(const Config& config, const Clock& clock, LensService& service);

}  // namespace lensd::daemon
