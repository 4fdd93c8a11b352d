// The driver "v4l2": what the kernel drives as a video device, a lens sub-device, or a voice coil on an I2C bus.
#pragma once

#include "drivers/api/device.h"

namespace lensd::drivers::v4l2 {

/// Keys: docs/drivers/v4l2.md. The lens outlives the call that opened it with its node held open, since closing the
/// last handle lets a voice coil fall back. BadData: a wrong key; Disconnected: no such device; Busy: another program
/// has it; Unsupported: a node with neither a lens control nor a picture format that is known.
Result<drivers::Device> OpenV4l2(const Settings& settings, const Clock& clock);
/// Whether settings for OpenV4l2() make sense without the device. BadData.
Result<void> CheckV4l2(const Settings& settings);
/// Video nodes that have a lens control or a picture.
Result<std::vector<drivers::FoundDevice>> ProbeV4l2();

}  // namespace lensd::drivers::v4l2
