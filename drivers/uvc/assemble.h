// From a configuration descriptor and an open transport to a device: what does not depend on how the bytes travel.
#pragma once

#include <memory>

#include "config.h"
#include "drivers/api/device.h"
#include "session.h"

namespace lensd::drivers::uvc {

/// A video function of a device and the camera terminal meant by the configuration (id 0: it has none).
struct Selection {
  VideoFunction function;
  CameraTerminal terminal;
};

/// Unsupported: no such terminal, or no video function at all. Protocol: descriptors that cannot be read.
Result<Selection> Select(std::span<const std::uint8_t> configuration, const UvcConfig& config);

/// Lens and camera as far as the device and the configuration have them. Unsupported: neither.
Result<Device> MakeDevice(const std::shared_ptr<Session>& session, const UvcConfig& config);

}  // namespace lensd::drivers::uvc
