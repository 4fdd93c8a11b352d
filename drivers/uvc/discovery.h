// Finding USB cameras: identity and descriptors out of sysfs, without opening any device, let alone asking it.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "drivers/api/device.h"
#include "drivers/hotplug/nodes.h"

namespace lensd::drivers::uvc {

struct UsbCamera {
  hotplug::Node node;
  std::vector<std::uint8_t> configuration;  ///< the active one's descriptor with all that belongs to it
};

/// All devices with a video control interface. Io.
Result<std::vector<UsbCamera>> ListCameras();

/// Out of a device descriptor followed by every configuration, as sysfs has them: the one whose bConfigurationValue
/// reads `active`. Empty: there is none.
std::vector<std::uint8_t> ActiveConfiguration(std::span<const std::uint8_t> all, std::string_view active);

}  // namespace lensd::drivers::uvc
