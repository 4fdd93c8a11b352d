// The driver's keys of a [[lens]] section as a typed struct; unknown keys are errors with their line.
#include "config.h"

#include <utility>
#include <vector>

namespace lensd::drivers::v4l2 {
namespace {

using drivers::Axis;

Duration Milliseconds(double ms) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(ms));
}

/// "focus_unit", "focus_scale", "focus_speed", "focus_settle_ms", and the same of the other axes.
AxisConfig ReadAxis(SettingsReader& read, Axis axis) {
  static const std::vector<std::string_view> kUnits = {"steps", "dioptres", "f-number", "millimetres", "position"};
  const std::string name(drivers::AxisName(axis));
  AxisConfig config;
  config.unit = static_cast<drivers::NativeUnit>(read.Choice(name + "_unit", kUnits, 0));
  config.scale = read.Number(name + "_scale", 1.0, kPositive);
  config.speed = read.OptionalNumber(name + "_speed", kNonNegative);
  if (const auto ms = read.OptionalNumber(name + "_settle_ms", {0.0, 60e3})) config.settle = Milliseconds(*ms);
  return config;
}

void ReadPlace(SettingsReader& read, Config& config) {
  config.device = read.OptionalPath("device").value_or("");
  config.serial = read.Text("serial", "");
  config.id_path = read.Text("id_path", "");
  config.sensor = read.Text("sensor", "");
  if (const Settings* bus = read.Any("i2c_bus")) {
    if (const auto number = bus->AsNumber()) {
      config.i2c_bus = "/dev/i2c-" + std::to_string(static_cast<int>(*number));
    } else {
      config.i2c_bus = read.Text("i2c_bus", "");
    }
  }
  const bool by_identity = !config.serial.empty() || !config.id_path.empty();
  const int ways = (config.device.empty() ? 0 : 1) + (by_identity ? 1 : 0) + (config.sensor.empty() ? 0 : 1) +
                   (config.i2c_bus.empty() ? 0 : 1);
  if (ways > 1) read.Reject("", "says twice which device it is: keep one of device, serial/id_path, sensor, i2c_bus");
  config.i2c_address = static_cast<std::uint16_t>(read.Integer("i2c_address", 0x0c, {0x03, 0x77}));
  config.chip = read.Text("chip", "");
  if (config.i2c_bus.empty()) {
    if (read.Has("chip")) read.Reject("chip", "belongs to i2c_bus, which is missing");
    if (read.Has("i2c_address")) read.Reject("i2c_address", "belongs to i2c_bus, which is missing");
  } else if (config.chip != "dw9714") {
    read.Reject("chip", "must say which chip the voice coil has; this version knows \"dw9714\"");
  }
}

}  // namespace

Result<Config> ReadConfig(const Settings& settings) {
  SettingsReader read(settings, "driver \"v4l2\"");
  Config config;
  ReadPlace(read, config);
  config.parts = static_cast<Parts>(read.Choice("parts", {"both", "lens", "camera"}, 0));
  for (const Axis axis : {Axis::Focus, Axis::Iris, Axis::Zoom}) config.axes[axis] = ReadAxis(read, axis);
  config.format = read.Text("format", "");
  if (config.format.size() > 4) read.Reject("format", "is a code of four letters, such as \"YUYV\"");
  config.width = static_cast<int>(read.Integer("width", 0, {1, 65536}));
  config.height = static_cast<int>(read.Integer("height", 0, {1, 65536}));
  if (read.Has("width") != read.Has("height")) read.Reject("width", "needs its height, and the other way round");
  config.frame_rate_hz = read.Number("frame_rate_hz", 0.0, kPositive);
  config.pixel_um = read.Number("pixel_um", 0.0, kPositive);
  config.gamma = read.OptionalNumber("gamma", kPositive);
  config.range = static_cast<VideoRange>(read.Choice("range", {"auto", "full", "limited"}, 0));
  if (const auto ms = read.OptionalNumber("latency_ms", {0.0, 10e3})) config.latency = Milliseconds(*ms);
  config.buffers = static_cast<int>(read.Integer("buffers", 4, {2, 32}));
  if (auto done = read.Finish(); !done) return PassOn(done);
  return config;
}

}  // namespace lensd::drivers::v4l2
