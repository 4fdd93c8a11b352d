// A device from its descriptor and a transport, the same for libusb, for tests and for fuzzing.
#include "assemble.h"

#include <algorithm>
#include <string>
#include <utility>

#include "descriptors.h"
#include "uvc_camera.h"
#include "uvc_lens.h"
#include "wire.h"

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

namespace {

/// The pictures are of no use, and so are the controls for nothing but them, where the camera lists any.
void LeavePicturesOut(const Session& session, const Error& why, Findings& findings) {
  findings.LeaveOut("camera", why);
  const Error with_them{why.code, "it describes the pictures, which are left out"};
  const CameraTerminal& terminal = session.terminal;
  if (terminal.id != 0 && terminal.Has(kExposureAbsolute.bit)) findings.LeaveOut("exposure", with_them);
  if (UnitWithGain(session.function, terminal) != nullptr) findings.LeaveOut("gain", with_them);
}

}  // namespace

Result<Device> MakeDevice(const std::shared_ptr<Session>& session, const UvcConfig& config) {
  Device device;
  if (config.lens) {
    auto lens = UvcLens::Open(session, config.lens_config, device.findings);
    if (!lens) return PassOn(lens);
    device.lens = *std::move(lens);
  }
  if (config.camera) {
    auto camera = UvcCamera::Open(session, config.camera_config, device.findings);
    const CameraConfig& asked = config.camera_config;
    const bool named = asked.format || asked.width || asked.frame_rate_hz;
    const bool listed = !session->function.streams.empty();
    const bool asked_alone = !listed && !config.lens;
    if (!camera && (ConcernsAll(camera.error()) || named || asked_alone)) return PassOn(camera);
    if (!camera && listed) LeavePicturesOut(*session, camera.error(), device.findings);
    if (camera) device.camera = *std::move(camera);
  }
  if (device.lens || device.camera) return device;
  if (!device.findings.left_out().empty()) return PassOn(device.findings.NothingLeft("this camera"));
  return Fail(Code::Unsupported, session->terminal.id == 0 ? "this camera has no camera terminal, so no lens"
                                                           : "this camera has no focus, iris or zoom");
}

}  // namespace lensd::drivers::uvc
