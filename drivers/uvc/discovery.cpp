// USB cameras out of sysfs, without opening any: identity, place, descriptors.
#include "discovery.h"

#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>

#include "drivers/uvc/driver.h"
#include "wire.h"

namespace lensd::drivers::uvc {
namespace {

constexpr std::size_t kDeviceDescriptor = 18;

/// The device's folder in sysfs, with a slash behind it; empty where the node is gone.
std::string SysfsFolder(const std::string& node) {
  struct stat about{};
  if (stat(node.c_str(), &about) != 0 || !S_ISCHR(about.st_mode)) return "";
  return "/sys/dev/char/" + std::to_string(major(about.st_rdev)) + ":" + std::to_string(minor(about.st_rdev)) + "/";
}

std::vector<std::uint8_t> ConfigurationOf(const std::string& node) {
  const std::string folder = SysfsFolder(node);
  if (folder.empty()) return {};
  std::ifstream file(folder + "descriptors", std::ios::binary);
  const std::vector<std::uint8_t> all{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  std::ifstream value(folder + "bConfigurationValue");
  std::string active;
  std::getline(value, active);
  return ActiveConfiguration(all, active);
}

/// The cheapest look at what a device is: an interface of class 0E, subclass 01.
bool HasVideoControl(std::span<const std::uint8_t> bytes) {
  while (bytes.size() >= 2 && bytes[0] >= 2 && bytes[0] <= bytes.size()) {
    if (bytes[1] == 0x04 && bytes[0] >= 9 && bytes[5] == 0x0E && bytes[6] == 0x01) return true;
    bytes = bytes.subspan(bytes[0]);
  }
  return false;
}

}  // namespace

std::vector<std::uint8_t> ActiveConfiguration(std::span<const std::uint8_t> all, std::string_view active) {
  auto rest = all.subspan(std::min(all.size(), kDeviceDescriptor));
  while (rest.size() >= 9) {
    const std::size_t total = FromLittle(rest.subspan(2, 2));
    if (total < 9 || total > rest.size()) break;
    if (std::to_string(rest[5]) == active) return {rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(total)};
    rest = rest.subspan(total);
  }
  return {};
}

Result<std::vector<UsbCamera>> ListCameras() {
  auto nodes = hotplug::ListNodes("usb");
  if (!nodes) return PassOn(nodes);
  std::vector<UsbCamera> found;
  for (hotplug::Node& node : *nodes) {
    auto configuration = ConfigurationOf(node.path);
    if (HasVideoControl(configuration)) found.push_back({std::move(node), std::move(configuration)});
  }
  return found;
}

}  // namespace lensd::drivers::uvc
