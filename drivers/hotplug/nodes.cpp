// Device nodes by serial number or place on the bus, from sysfs through libudev. No device is opened to find it.
#include "drivers/hotplug/nodes.h"

#include <grp.h>
#include <sys/stat.h>
#include <systemd/sd-device.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <memory>

namespace lensd::drivers::hotplug {
namespace {

struct Unref {
  void operator()(sd_device_enumerator* enumerator) const { sd_device_enumerator_unref(enumerator); }
};

std::string Property(sd_device* device, const char* key) {
  const char* value = nullptr;
  return sd_device_get_property_value(device, key, &value) >= 0 ? value : "";
}

std::string Attribute(sd_device* device, const char* key) {
  const char* value = nullptr;
  return sd_device_get_sysattr_value(device, key, &value) >= 0 ? value : "";
}

std::uint16_t Hex(std::string_view text) {
  std::uint32_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value, 16);
  return static_cast<std::uint16_t>(value);
}

/// HID_ID is "BUS:VENDOR:PRODUCT" in hexadecimal. The kernel takes HID_UNIQ from the USB serial number.
bool TakeHidIdentity(sd_device* device, Node& node) {
  sd_device* hid = nullptr;
  if (sd_device_get_parent_with_subsystem_devtype(device, "hid", nullptr, &hid) < 0) return false;
  const std::string id = Property(hid, "HID_ID");
  const auto first = id.find(':'), second = id.find(':', first + 1);
  if (first == std::string::npos || second == std::string::npos) return false;
  node.vendor = Hex(std::string_view(id).substr(first + 1, second - first - 1));
  node.product = Hex(std::string_view(id).substr(second + 1));
  node.name = Property(hid, "HID_NAME");
  node.serial = Property(hid, "HID_UNIQ");
  return true;
}

/// The USB device that this is, or that it is a part of.
sd_device* UsbDeviceOf(sd_device* device) {
  const char* type = nullptr;
  if (sd_device_get_devtype(device, &type) >= 0 && std::string_view(type) == "usb_device") return device;
  sd_device* usb = nullptr;
  return sd_device_get_parent_with_subsystem_devtype(device, "usb", "usb_device", &usb) < 0 ? nullptr : usb;
}

void TakeUsbIdentity(sd_device* device, Node& node) {
  sd_device* usb = UsbDeviceOf(device);
  if (usb == nullptr) return;
  node.vendor = Hex(Attribute(usb, "idVendor"));
  node.product = Hex(Attribute(usb, "idProduct"));
  node.serial = Attribute(usb, "serial");
  const std::string maker = Attribute(usb, "manufacturer");
  node.name = (maker.empty() ? "" : maker + " ") + Attribute(usb, "product");
}

Node NodeOf(sd_device* device) {
  Node node;
  const char* path = nullptr;
  if (sd_device_get_devname(device, &path) >= 0) node.path = path;
  node.id_path = Property(device, "ID_PATH");
  if (!TakeHidIdentity(device, node)) TakeUsbIdentity(device, node);
  return node;
}

/// A TOML basic string.
std::string Quoted(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  }
  return quoted + "\"";
}

/// Which key tells this node from the others: "serial", "id_path" or "".
std::string KeyOf(const Node& node, const std::vector<Node>& all) {
  const auto only = [&](const std::string Node::* key) {
    return !(node.*key).empty() && std::ranges::count(all, node.*key, key) <= 1;
  };
  return only(&Node::serial) ? "serial" : only(&Node::id_path) ? "id_path" : "";
}

std::string Known(const std::vector<Node>& nodes) {
  std::string known;
  for (const Node& node : nodes) {
    const std::string key = KeyOf(node, nodes);
    known += known.empty() ? "" : ", ";
    known += key.empty() ? node.path : key + " " + Quoted(key == "serial" ? node.serial : node.id_path);
  }
  return known;
}

}  // namespace

Result<std::vector<Node>> ListNodes(std::string_view subsystem) {
  sd_device_enumerator* made = nullptr;
  int status = sd_device_enumerator_new(&made);
  const std::unique_ptr<sd_device_enumerator, Unref> enumerator(made);
  if (status >= 0) {
    status = sd_device_enumerator_add_match_subsystem(made, std::string(subsystem).c_str(), 1);
  }
  // Without udev (containers, small systems) nothing is ever marked as initialised.
  if (status >= 0) status = sd_device_enumerator_allow_uninitialized(made);
  if (status < 0) return Fail(Code::Io, std::string("cannot list devices: ") + std::strerror(-status));
  std::vector<Node> nodes;
  for (sd_device* device = sd_device_enumerator_get_device_first(made); device != nullptr;
       device = sd_device_enumerator_get_device_next(made)) {
    Node node = NodeOf(device);
    if (!node.path.empty()) nodes.push_back(std::move(node));
  }
  std::ranges::sort(nodes, {}, &Node::path);
  return nodes;
}

Result<Node> Pick(const std::vector<Node>& nodes, const Wanted& wanted, std::string_view what) {
  std::vector<Node> matching;
  for (const Node& node : nodes) {
    const bool fits = (wanted.serial.empty() || node.serial == wanted.serial) &&
                      (wanted.id_path.empty() || node.id_path == wanted.id_path);
    if (fits) matching.push_back(node);
  }
  const std::string kind(what);
  if (matching.size() == 1) return matching.front();
  if (matching.size() > 1) {
    return Fail(Code::InvalidArgument, std::to_string(matching.size()) + " devices fit (" + Known(matching) +
                                           "); say which " + kind + " with serial or id_path");
  }
  std::string with = wanted.serial.empty() ? "" : " with serial " + Quoted(wanted.serial);
  if (!wanted.id_path.empty()) with += " at " + Quoted(wanted.id_path);
  const std::string others = nodes.empty() ? "" : " (there is " + Known(nodes) + ")";
  return Fail(Code::Disconnected, "no " + kind + with + " is plugged in" + others);
}

std::string ConfigLines(const Node& node, const std::vector<Node>& all) {
  const std::string key = KeyOf(node, all);
  return key.empty() ? "" : key + " = " + Quoted(key == "serial" ? node.serial : node.id_path) + "\n";
}

std::string AccessProblem(const std::string& path) {
  if (access(path.c_str(), R_OK | W_OK) == 0) return "";
  if (errno != EACCES && errno != EPERM) return path + ": " + std::strerror(errno);
  struct stat about{};
  const group* owner = stat(path.c_str(), &about) == 0 ? getgrgid(about.st_gid) : nullptr;
  const bool group_may = (about.st_mode & (S_IRGRP | S_IWGRP)) == (S_IRGRP | S_IWGRP) && about.st_gid != 0;
  const std::string remedy = owner != nullptr && group_may ? "join its group " + std::string(owner->gr_name)
                                                           : "install systemd/udev/60-lensd.rules and plug it in again";
  return "no permission to read and write " + path + "; " + remedy;
}

}  // namespace lensd::drivers::hotplug
