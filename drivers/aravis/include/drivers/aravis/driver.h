// The driver "aravis": any GenICam camera, over GigE Vision or USB3 Vision, and the lens it drives.
#pragma once

#include <string>
#include <vector>

#include "drivers/api/device.h"

namespace lensd::drivers::aravis {

/// Opens the camera named by `serial`, `address` (of the network) or `id` (as Aravis writes it), and its lens where it
/// has motorised axes. The other keys: docs/drivers/aravis.md. BadData: a key that is unknown or wrong. Disconnected:
/// no such camera. Busy: another program controls it. Unsupported: it has no pixel format that can be read, an
/// overridden feature does not exist, or its GenICam file is none that Aravis may evaluate. The camera is served by a
/// thread of the driver's own; when it goes away, calls fail with Disconnected (WrongDevice: another one is in its
/// place) and the thread looks for it again until the device is destroyed, which takes up to 6 s then.
Result<Device> OpenAravis(const Settings& settings, const Clock& clock);
/// Whether settings for OpenAravis() make sense without the device. BadData.
Result<void> CheckAravis(const Settings& settings);
/// Every GenICam camera that answers a search of the networks and buses. Whether it has a lens shows only once it is
/// opened.
Result<std::vector<FoundDevice>> ProbeAravis();

/// From now on every camera on USB is opened by another process first, and refused with the reason where that crashes
/// or does not end: "PROGRAM --try-usb-camera ID", which must call TryUsbCamera(ID) and exit with what it returns.
/// Before any thread begins. Without this such cameras are opened at once.
void TryUsbCamerasBy(std::string program);
inline constexpr const char* kTryUsbCamera = "--try-usb-camera";
/// In that process: opens the camera with that id of Aravis', and closes it.
int TryUsbCamera(const std::string& id);

}  // namespace lensd::drivers::aravis
