// The lens and the camera of a device in a driver process.
#pragma once

#include <memory>

#include "drivers/api/device.h"
#include "remote.h"

namespace lensd::drivers::process {

std::unique_ptr<Lens> MakeLens(std::shared_ptr<Remote> remote, Capabilities can, const Clock& clock);
std::unique_ptr<Camera> MakeCamera(std::shared_ptr<Remote> remote, CameraCapabilities can, const Clock& clock);

}  // namespace lensd::drivers::process
