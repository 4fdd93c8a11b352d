// Opens a device inside lensd, or in a process of its own, as its configuration says.
#pragma once

#include "base/clock.h"
#include "base/result.h"
#include "daemon/config/config.h"
#include "drivers/api/device.h"

namespace lensd::daemon {

/// Errors of the driver; Disconnected where its process cannot be started. What the process prints goes to the log.
Result<drivers::Device> OpenDriver(const DeviceConfig& config, const Clock& clock);

}  // namespace lensd::daemon
