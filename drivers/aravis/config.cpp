// The driver's keys of a [[lens]] section as a typed struct; unknown keys are errors with their line.
#include "config.h"

#include <cmath>

#include "pixel_format.h"

namespace lensd::drivers::aravis {
namespace {

std::optional<std::array<int, 4>> ReadRegion(SettingsReader& read) {
  const auto numbers = read.OptionalNumbers("region_px", 4, {0.0, 65535.0});
  if (!numbers) return std::nullopt;
  std::array<int, 4> region{};
  for (std::size_t i = 0; i < region.size(); ++i) {
    const double number = (*numbers)[i];
    if (number != std::floor(number)) read.Reject("region_px", "must be whole pixels: [x, y, width, height]");
    region[i] = static_cast<int>(number);
  }
  if (region[2] == 0 || region[3] == 0) read.Reject("region_px", "must not be empty: [x, y, width, height]");
  return region;
}

CameraConfig ReadCamera(SettingsReader& read) {
  CameraConfig camera;
  camera.pixel_um = read.Number("pixel_um", 0.0, kNonNegative);
  camera.pixel_format = read.Text("pixel_format", "");
  if (!camera.pixel_format.empty() && FindPixelFormat(camera.pixel_format) == nullptr) {
    read.Reject(
        "pixel_format",
        "must be one of Mono8/10/12/14/16, Mono10p, Mono12p, Mono10Packed, Mono12Packed, BayerXX8 to BayerXX16, "
        "RGB8, BGR8");
  }
  camera.exposure_ms = read.OptionalNumber("exposure_ms", kPositive);
  camera.gain = read.OptionalNumber("gain");
  camera.frame_rate_hz = read.OptionalNumber("frame_rate_hz", kPositive);
  camera.trigger = read.Text("trigger", "");
  camera.region = ReadRegion(read);
  camera.packet_size = static_cast<int>(read.Integer("packet_size", camera.packet_size, {576, 16260}));
  camera.packet_delay_us = read.OptionalNumber("packet_delay_us", {0.0, 1e6});
  camera.resend = read.Boolean("resend", true);
  camera.buffers = static_cast<int>(read.Integer("buffers", camera.buffers, {2, 64}));
  camera.gamma = read.Number("gamma", 1.0, {0.1, 10.0});
  camera.stamp = static_cast<StampMeaning>(read.Choice("timestamp", {"exposure-start", "exposure-end", "none"}, 0));
  return camera;
}

LensNames ReadLens(SettingsReader& read) {
  LensNames names;
  for (const Axis axis : kAxes) names.feature[axis] = read.Text(std::string(AxisName(axis)) + "_feature", "");
  names.status = read.Text("status_feature", "");
  names.initialize = read.Text("initialize_feature", "");
  names.abort = read.Text("abort_feature", "");
  names.controller = read.Text("optic_controller", "");
  if (read.Any("feedback") != nullptr) {
    names.feedback = static_cast<Feedback>(read.Choice("feedback", {kFeedbackNames.begin(), kFeedbackNames.end()}, 0));
  }
  return names;
}

}  // namespace

std::string DriverConfig::Named() const {
  if (!serial.empty()) return "serial \"" + serial + "\"";
  if (!address.empty()) return "address " + address;
  return "id \"" + id + "\"";
}

Result<DriverConfig> ReadDriverConfig(const Settings& settings) {
  SettingsReader read(settings, "driver \"aravis\"");
  DriverConfig config;
  config.serial = read.Text("serial", "");
  config.address = read.Text("address", "");
  config.id = read.Text("id", "");
  if (config.serial.empty() + config.address.empty() + config.id.empty() != 2) {
    read.Reject("", "needs exactly one of serial, address and id (arv-tool-0.8 lists them)");
  }
  const double deadline_ms = read.Number("io_timeout_ms", 1000.0, {100.0, 60e3});
  config.deadline = std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(deadline_ms));
  config.camera = ReadCamera(read);
  config.lens = ReadLens(read);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return config;
}

}  // namespace lensd::drivers::aravis
