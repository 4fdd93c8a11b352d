// A device from its descriptor and a transport, the same for libusb, for tests and for fuzzing.
#include "assemble.h"

#include <algorithm>
#include <string>
#include <utility>

#include "uvc_camera.h"
#include "uvc_lens.h"

namespace lensd::drivers::uvc {

Result<Selection> Select(std::span<const std::uint8_t> configuration, const UvcConfig& config) {
  auto functions = ParseConfiguration(configuration);
  if (!functions) return PassOn(functions);
  for (const VideoFunction& function : *functions) {
    for (const CameraTerminal& terminal : function.terminals) {
      if (!config.terminal || *config.terminal == terminal.id) return Selection{function, terminal};
    }
  }
  if (config.terminal) {
    return Fail(Code::Unsupported, "the camera has no camera terminal " + std::to_string(*config.terminal));
  }
  if (functions->empty()) return Fail(Code::Unsupported, "the device has no video function");
  return Selection{functions->front(), {}};
}

Result<Device> MakeDevice(const std::shared_ptr<Session>& session, const UvcConfig& config) {
  Device device;
  if (config.lens) {
    auto lens = UvcLens::Open(session, config.lens_config);
    // A camera without a lens is a camera, unless the lens is what was asked for.
    if (!lens && (lens.error().code != Code::Unsupported || !config.camera)) return PassOn(lens);
    if (lens) device.lens = *std::move(lens);
  }
  if (config.camera) {
    auto camera = UvcCamera::Open(session, config.camera_config);
    const CameraConfig& asked = config.camera_config;
    const bool wanted = asked.format || asked.width || !device.lens;
    if (!camera && (camera.error().code != Code::Unsupported || wanted)) return PassOn(camera);
    if (camera) device.camera = *std::move(camera);
  }
  return device;
}

}  // namespace lensd::drivers::uvc
