// Which device nodes the kernel offers, and whose they are: devices are known by serial number or place, never by node.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace lensd::drivers::hotplug {

/// One device node. Identity comes from the HID or USB device it belongs to; 0 and empty where there is none.
struct Node {
  std::string path;     ///< "/dev/hidraw0"
  std::string name;     ///< as the device names itself
  std::string serial;   ///< serial number
  std::string id_path;  ///< udev's ID_PATH: where it is plugged in
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
};

/// Every node of a kernel subsystem ("hidraw", "video4linux", "tty"), in the order of their paths. Reads sysfs only.
/// Code::Io.
Result<std::vector<Node>> ListNodes(std::string_view subsystem);

/// What a configuration says of the device it means. Both empty: the only one there is.
struct Wanted {
  std::string serial;
  std::string id_path;
};
/// The one node that is meant. `what` names the kind in messages ("LensConnect lens"). Disconnected: none such.
/// InvalidArgument: several, and nothing says which.
Result<Node> Pick(const std::vector<Node>& nodes, const Wanted& wanted, std::string_view what);

/// The configuration lines that select this node and no other of `all`: by serial number, else (devices that share one,
/// or have none) by place, else nothing.
std::string ConfigLines(const Node& node, const std::vector<Node>& all);

/// Empty, or why this process may not read and write the node, and what to do.
std::string AccessProblem(const std::string& path);

}  // namespace lensd::drivers::hotplug
