// The descriptors of the simulated camera (UVC 1.1 section 3; USB 2.0 section 9.6).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/devices/uvc_model.h"

namespace lensd::sim::devices {

std::vector<std::uint8_t> DeviceDescriptor();
/// `controls`: bmControls of the camera terminal.
std::vector<std::uint8_t> ConfigurationDescriptor(const UvcOptions& options, std::uint32_t controls,
                                                  const CameraSettings& camera);
/// A string descriptor; index 0 lists the languages.
std::vector<std::uint8_t> StringDescriptor(int index, const std::string& serial);

/// Little-endian, at the end of `bytes`.
void Append(std::vector<std::uint8_t>& bytes, std::uint32_t value, int length);
/// 100 ns a frame.
std::uint32_t FrameInterval(const CameraSettings& camera);

}  // namespace lensd::sim::devices
