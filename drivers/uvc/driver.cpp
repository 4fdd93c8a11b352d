// Opens a USB camera through libusb: lens by its camera terminal, pictures by its streams. The kernel's driver lets go
// of the interfaces meanwhile.
#include "drivers/uvc/driver.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "assemble.h"
#include "config.h"
#include "discovery.h"
#include "stream_choice.h"
#include "usb_link.h"

namespace lensd::drivers::uvc {
namespace {

/// "046d:0825", as lsusb prints it.
std::string ProductOf(const hotplug::Node& node) {
  char text[16];
  std::snprintf(text, sizeof text, "%04x:%04x", node.vendor, node.product);
  return text;
}

std::string ModelOf(const hotplug::Node& node) {
  return node.name.empty() ? ProductOf(node) : node.name;
}

Result<UsbCamera> Find(const UvcConfig& config) {
  auto all = ListCameras();
  if (!all) return PassOn(all);
  std::vector<hotplug::Node> nodes;
  for (const UsbCamera& camera : *all) {
    if (config.product.empty() || ProductOf(camera.node) == config.product) nodes.push_back(camera.node);
  }
  const std::string what = config.product.empty() ? "USB camera" : "USB camera " + config.product;
  auto node = hotplug::Pick(nodes, {config.serial, config.id_path}, what);
  if (!node) return PassOn(node);
  return *std::ranges::find(*all, node->path, [](const UsbCamera& camera) { return camera.node.path; });
}

LinkOptions LinkTo(const UsbCamera& device, const VideoFunction& function, bool camera) {
  LinkOptions options;
  options.node = device.node.path;
  options.interfaces = {function.interface};
  if (camera) {
    for (const StreamInterface& stream : function.streams) options.interfaces.push_back(stream.number);
  }
  options.status_endpoint = function.status_endpoint;
  options.status_bytes = function.status_bytes;
  return options;
}

bool HasLens(const CameraTerminal& terminal) {
  return terminal.Has(kFocusAbsolute.bit) || terminal.Has(kFocusRelative.bit) || terminal.Has(kIrisAbsolute.bit) ||
         terminal.Has(kZoomAbsolute.bit);
}

}  // namespace

Result<void> CheckUvc(const Settings& settings) {
  const auto config = ReadConfig(settings);
  if (!config) return PassOn(config);
  return {};
}

Result<Device> OpenUvc(const Settings& settings, const Clock& clock) {
  auto config = ReadConfig(settings);
  if (!config) return PassOn(config);
  auto device = Find(*config);
  if (!device) return PassOn(device);
  auto selection = Select(device->configuration, *config);
  if (!selection) return PassOn(selection);
  auto link = OpenLink(LinkTo(*device, selection->function, config->camera));
  if (!link) return PassOn(link);
  const auto session =
      std::make_shared<Session>(*std::move(link), clock, std::move(selection->function), selection->terminal,
                                Identity{ModelOf(device->node), device->node.serial}, config->controls);
  return MakeDevice(session, *config);
}

Result<std::vector<FoundDevice>> ProbeUvc() {
  auto all = ListCameras();
  if (!all) return PassOn(all);
  std::vector<hotplug::Node> nodes;
  for (const UsbCamera& camera : *all) nodes.push_back(camera.node);
  std::vector<FoundDevice> found;
  for (const UsbCamera& camera : *all) {
    FoundDevice one;
    one.model = ModelOf(camera.node);
    one.serial = camera.node.serial;
    one.node = camera.node.path;
    one.config = hotplug::ConfigLines(camera.node, nodes);
    if (one.config.empty()) one.config = "product = \"" + ProductOf(camera.node) + "\"\n";
    const auto selection = Select(camera.configuration, {});
    one.lens = selection && HasLens(selection->terminal);
    one.camera = selection && Choose(selection->function, {}).has_value();
    one.problem = selection ? hotplug::AccessProblem(camera.node.path) : selection.error().message;
    found.push_back(std::move(one));
  }
  return found;
}

}  // namespace lensd::drivers::uvc
