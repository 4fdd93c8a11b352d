// The driver "uvc": the lens behind a USB camera's camera terminal, and the camera itself, through libusb. For what the
// kernel's uvcvideo does not map, or where it is absent; wherever another program uses it, the driver "v4l2" is
// the right one, since claiming the interfaces takes /dev/video* away.
#pragma once

#include "drivers/api/device.h"

namespace lensd::drivers::uvc {

/// Opens the camera that `settings` (docs/drivers/uvc.md) names by `serial`, `id_path` or `product`; where none is
/// named the only one there is. Takes its interfaces from the kernel's driver until the device is destroyed, switches
/// its automatic focus and iris off and restores them then. `clock` must outlive the device. BadData: keys that make no
/// sense. Disconnected: no such camera. Busy: held by another program. Unsupported: it has neither a lens nor a picture
/// that this driver knows. Timeout, Protocol: from the device.
Result<Device> OpenUvc(const Settings& settings, const Clock& clock);
/// Whether settings for OpenUvc() make sense without the device. BadData.
Result<void> CheckUvc(const Settings& settings);
/// The USB cameras that are plugged in, by their descriptors: nothing is opened or asked.
Result<std::vector<FoundDevice>> ProbeUvc();

}  // namespace lensd::drivers::uvc
