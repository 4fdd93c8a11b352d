// Finds a LensConnect lens among HID devices, reads its description and opens it. The node stays open as long as the
// device lives.
#include "drivers/lensconnect/driver.h"

#include <utility>

#include "drivers/hotplug/nodes.h"
#include "lensconnect_lens.h"

namespace lensd::drivers::lensconnect {
namespace {

constexpr std::uint16_t kVendor = 0x10C4, kProduct = 0x8D08;
constexpr const char* kWhat = "LensConnect lens";

Duration Milliseconds(std::int64_t count) {
  return std::chrono::milliseconds(count);
}

Config ReadConfig(SettingsReader& read) {
  Config config;
  config.io_timeout = Milliseconds(read.Integer("io_timeout_ms", 500, {50, 10e3}));
  config.start_timeout = Milliseconds(read.Integer("start_timeout_ms", 500, {10, 10e3}));
  config.concurrent_axes = read.Boolean("concurrent_axes", false);
  config.stop_value = static_cast<std::uint16_t>(read.Integer("stop_value", 1, {0, 65535}));
  config.iris_reversed = read.Boolean("iris_reversed", false);
  config.zoom_reversed = read.Boolean("zoom_reversed", false);
  if (read.Any("backlash_cancel") != nullptr) config.backlash_cancel = read.Boolean("backlash_cancel", false);
  for (const Axis axis : {Axis::Focus, Axis::Iris, Axis::Zoom}) {
    const std::string key = std::string(AxisName(axis)) + "_pps";
    if (read.Has(key)) config.speed[axis] = static_cast<std::uint16_t>(read.Integer(key, 1, {1, 65535}));
  }
  return config;
}

Result<std::vector<hotplug::Node>> Lenses() {
  auto nodes = hotplug::ListNodes("hidraw");
  if (!nodes) return nodes;
  std::erase_if(*nodes, [](const hotplug::Node& node) { return node.vendor != kVendor || node.product != kProduct; });
  return nodes;
}

hotplug::Wanted WantedOf(SettingsReader& read) {
  return {read.Text("serial", ""), read.Text("id_path", "")};
}

}  // namespace

Result<void> CheckLensConnect(const Settings& settings) {
  SettingsReader read(settings, "[[lens]]");
  (void)WantedOf(read);
  (void)ReadConfig(read);
  return read.Finish();
}

Result<Device> OpenLensConnect(const Settings& settings, const Clock& clock) {
  SettingsReader read(settings, "[[lens]]");
  const hotplug::Wanted wanted = WantedOf(read);
  const Config config = ReadConfig(read);
  if (auto done = read.Finish(); !done) return PassOn(done);
  const auto nodes = Lenses();
  if (!nodes) return PassOn(nodes);
  const auto node = hotplug::Pick(*nodes, wanted, kWhat);
  if (!node) return PassOn(node);
  auto transport = OpenHidraw(node->path);
  if (!transport) return PassOn(transport);
  Device device;
  auto lens = LensConnectLens::Open(*std::move(transport), config, node->serial, device.findings, clock);
  if (!lens) return PassOn(lens);
  device.lens = *std::move(lens);
  return device;
}

Result<std::vector<FoundDevice>> ProbeLensConnect() {
  const auto nodes = Lenses();
  if (!nodes) return PassOn(nodes);
  std::vector<FoundDevice> found;
  for (const hotplug::Node& node : *nodes) {
    found.push_back({.model = node.name,
                     .serial = node.serial,
                     .node = node.path,
                     .config = hotplug::ConfigLines(node, *nodes),
                     .lens = true,
                     .camera = false,
                     .problem = hotplug::AccessProblem(node.path)});
  }
  return found;
}

}  // namespace lensd::drivers::lensconnect
