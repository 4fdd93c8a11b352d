// Opening a device on any kernel: the real one, or a test's.
#pragma once

#include "config.h"
#include "drivers/api/device.h"
#include "kernel.h"

namespace lensd::drivers::v4l2 {

Result<drivers::Device> OpenOn(Kernel& kernel, const Config& config, const Clock& clock);

}  // namespace lensd::drivers::v4l2
