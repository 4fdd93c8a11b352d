// Which lens belongs to a sensor, by the kernel's media graph.
#pragma once

#include <string>

#include "base/result.h"
#include "kernel.h"

namespace lensd::drivers::v4l2 {

/// The node of the lens of the sensor whose entity is named `sensor` (or the only one whose name contains it): the lens
/// with an ancillary link to it (kernels since 5.19), else the only lens of its graph. Disconnected: no such sensor, or
/// it has no lens. InvalidArgument: several sensors fit.
Result<std::string> FindLensOfSensor(Kernel& kernel, const std::string& sensor);

}  // namespace lensd::drivers::v4l2
