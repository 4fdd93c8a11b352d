// The driver's keys of a [[lens]] section as a typed struct; unknown keys are errors with their line.
#include "config.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

namespace lensd::drivers::uvc {
namespace {

Duration Milliseconds(double ms) {
  return Duration(std::llround(ms * 1e6));
}

bool IsProduct(const std::string& text) {
  const auto hex = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) || (c >= 'a' && c <= 'f'); };
  return text.size() == 9 && text[4] == ':' && std::ranges::count_if(text, hex) == 8;
}

LensConfig ReadLens(SettingsReader& read) {
  LensConfig lens;
  lens.feedback = static_cast<Feedback>(
      read.Choice("feedback", {kFeedbackNames.begin(), kFeedbackNames.end()}, static_cast<std::size_t>(lens.feedback)));
  lens.completion_events = read.Boolean("completion_events", lens.completion_events);
  lens.iris_is_f_number = read.Choice("iris_unit", {"f-number", "steps"}, 0) == 0;
  if (const auto ms = read.OptionalNumber("focus_travel_ms", {100, 600'000})) lens.focus_travel = Milliseconds(*ms);
  lens.focus_speed = static_cast<std::uint8_t>(read.Integer("focus_speed", 1, {1, 255}));
  return lens;
}

CameraConfig ReadCamera(SettingsReader& read) {
  CameraConfig camera;
  std::vector<std::string_view> formats = {"auto"};
  for (const PixelFormatInfo& known : PixelFormats()) formats.push_back(known.name);
  const std::size_t format = read.Choice("format", formats, 0);
  if (format != 0) camera.format = PixelFormats()[format - 1].format;
  if (read.Any("width") != nullptr) camera.width = static_cast<int>(read.Integer("width", 0, {1, 65535}));
  if (read.Any("height") != nullptr) camera.height = static_cast<int>(read.Integer("height", 0, {1, 65535}));
  if (camera.width.has_value() != camera.height.has_value()) read.Reject("", "needs width and height together");
  camera.frame_rate_hz = read.OptionalNumber("frame_rate_hz", {0.1, 1000});
  camera.gamma = read.OptionalNumber("gamma", {0.2, 5});
  if (const auto ms = read.OptionalNumber("latency_ms", {0, 10'000})) camera.latency = Milliseconds(*ms);
  camera.frame_timeout = Milliseconds(read.Number("frame_timeout_ms", 5000, {50, 600'000}));
  camera.pixel_um = read.Number("pixel_um", 0, {0, 1000});
  return camera;
}

}  // namespace

Result<UvcConfig> ReadConfig(const Settings& settings) {
  SettingsReader read(settings, "driver \"uvc\"");
  UvcConfig config;
  config.serial = read.Text("serial", "");
  config.id_path = read.Text("id_path", "");
  config.product = read.Text("product", "");
  std::ranges::transform(config.product, config.product.begin(), [](unsigned char c) { return std::tolower(c); });
  if (!config.product.empty() && !IsProduct(config.product)) {
    read.Reject("product", "must be vendor and product as lsusb prints them, \"046d:0825\"");
  }
  if (read.Has("terminal")) config.terminal = static_cast<int>(read.Integer("terminal", 0, {1, 255}));
  const std::size_t use = read.Choice("use", {"both", "lens", "camera"}, 0);
  config.lens = use != 2;
  config.camera = use != 1;
  config.controls.timeout = Milliseconds(read.Number("timeout_ms", 1000, {10, 60'000}));
  config.controls.interval = Milliseconds(read.Number("command_interval_ms", 50, {0, 10'000}));
  config.controls.read_error_code = read.Boolean("read_error_code", true);
  config.lens_config = ReadLens(read);
  config.camera_config = ReadCamera(read);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return config;
}

}  // namespace lensd::drivers::uvc
