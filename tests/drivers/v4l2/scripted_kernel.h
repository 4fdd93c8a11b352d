// A kernel of the test's own making, for what no packaged kernel module can exercise: lens sub-devices (dw9714 and its
// kin), media graphs with a lens, I2C buses with plain transfers, drivers that clamp or fail. It follows the kernel's
// documented behaviour of these calls, and is no proof that a real driver does: what a packaged module has (vivid,
// i2c-stub, uvcvideo) is tested in the virtual bench instead.
#pragma once

#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <linux/media.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "kernel.h"

namespace lensd::drivers::v4l2 {

struct ScriptedControl {
  std::string name;
  std::int64_t minimum = 0;
  std::int64_t maximum = 1023;
  std::int64_t step = 1;
  std::uint32_t flags = 0;
  std::int64_t value = 0;
  std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
  /// What the driver makes of a value written; unset: takes it.
  std::function<std::int64_t(std::int64_t)> applied{};
};

struct ScriptedNode {
  std::map<std::uint32_t, ScriptedControl> controls;
  std::deque<v4l2_event> events;
  std::vector<std::pair<std::uint32_t, std::int64_t>> writes;  ///< control and value, in order
  std::map<unsigned long, int> failing;                        ///< request: errno
  bool gone = false;
  bool video = false;  ///< answers VIDIOC_QUERYCAP
  std::string driver = "scripted";
  int opened = 0;
  int closed = 0;

  // A media device.
  std::vector<media_v2_entity> entities;
  std::vector<media_v2_interface> interfaces;
  std::vector<media_v2_link> links;

  // An I2C bus with one chip.
  unsigned long functions = 0;
  long address = -1;  ///< chip present there
  long selected = -1;
  std::vector<std::vector<std::uint8_t>> sent;  ///< bytes of each transfer after the address
  std::vector<std::uint8_t> answer;             ///< of plain reads
};

class ScriptedKernel final : public Kernel {
 public:
  std::map<std::string, ScriptedNode> nodes;
  std::map<std::string, std::string> texts;

  int Open(const std::string& path) override {
    const auto node = nodes.find(path);
    if (node == nodes.end() || node->second.gone) return -ENOENT;
    ++node->second.opened;
    files_[++last_fd_] = path;
    return last_fd_;
  }
  void Close(int fd) override { ++nodes[files_.at(fd)].closed; }

  int Ioctl(int fd, unsigned long request, void* argument) override {
    ScriptedNode& node = nodes[files_.at(fd)];
    if (node.gone) return -ENODEV;
    if (const auto failing = node.failing.find(request); failing != node.failing.end()) return -failing->second;
    switch (request) {
      case VIDIOC_QUERYCAP:
        return QueryCapability(node, static_cast<v4l2_capability*>(argument));
      case VIDIOC_QUERY_EXT_CTRL:
        return QueryControl(node, static_cast<v4l2_query_ext_ctrl*>(argument));
      case VIDIOC_G_EXT_CTRLS:
        return GetControls(node, static_cast<v4l2_ext_controls*>(argument));
      case VIDIOC_S_EXT_CTRLS:
        return SetControls(node, static_cast<v4l2_ext_controls*>(argument));
      case VIDIOC_SUBSCRIBE_EVENT:
        return 0;
      case VIDIOC_DQEVENT:
        return TakeEvent(node, static_cast<v4l2_event*>(argument));
      case MEDIA_IOC_G_TOPOLOGY:
        return Topology(node, static_cast<media_v2_topology*>(argument));
      case I2C_FUNCS:
        *static_cast<unsigned long*>(argument) = node.functions;
        return node.functions == 0 ? -ENOTTY : 0;
      case I2C_SLAVE:
        node.selected = static_cast<long>(reinterpret_cast<std::uintptr_t>(argument));
        return 0;
      case I2C_SMBUS:
        return Smbus(node, static_cast<i2c_smbus_ioctl_data*>(argument));
      default:
        return -ENOTTY;
    }
  }

  void* Map(int, std::size_t, std::int64_t) override { return nullptr; }
  void Unmap(void*, std::size_t) override {}
  int Read(int fd, void* into, std::size_t length) override {
    const ScriptedNode& node = nodes[files_.at(fd)];
    if (node.gone || node.selected != node.address) return -ENXIO;
    const std::size_t count = std::min(length, node.answer.size());
    std::copy_n(node.answer.begin(), count, static_cast<std::uint8_t*>(into));
    return static_cast<int>(count);
  }
  std::vector<std::string> List(const std::string& folder, const std::string& prefix) override {
    std::vector<std::string> found;
    const std::string begin = folder + "/" + prefix;
    for (const auto& [path, node] : nodes) {
      if (path.starts_with(begin)) found.push_back(path);
    }
    return found;
  }
  std::string Text(const std::string& path) override {
    const auto text = texts.find(path);
    return text == texts.end() ? "" : text->second;
  }

 private:
  static int QueryCapability(const ScriptedNode& node, v4l2_capability* about) {
    if (!node.video) return -ENOTTY;
    std::snprintf(reinterpret_cast<char*>(about->driver), sizeof about->driver, "%s", node.driver.c_str());
    std::snprintf(reinterpret_cast<char*>(about->card), sizeof about->card, "Scripted Camera");
    about->capabilities = V4L2_CAP_STREAMING;
    return 0;
  }
  static int QueryControl(const ScriptedNode& node, v4l2_query_ext_ctrl* query) {
    const auto found = node.controls.find(query->id);
    if (found == node.controls.end()) return -EINVAL;
    const ScriptedControl& control = found->second;
    query->type = control.type;
    std::strncpy(query->name, control.name.c_str(), sizeof query->name - 1);
    query->minimum = control.minimum;
    query->maximum = control.maximum;
    query->step = static_cast<__u64>(control.step);
    query->flags = control.flags;
    return 0;
  }
  static int GetControls(const ScriptedNode& node, v4l2_ext_controls* all) {
    const auto found = node.controls.find(all->controls[0].id);
    if (found == node.controls.end()) return -EINVAL;
    if ((found->second.flags & V4L2_CTRL_FLAG_WRITE_ONLY) != 0) return -EACCES;
    all->controls[0].value = static_cast<__s32>(found->second.value);
    return 0;
  }
  static int SetControls(ScriptedNode& node, v4l2_ext_controls* all) {
    const auto found = node.controls.find(all->controls[0].id);
    if (found == node.controls.end()) return -EINVAL;
    ScriptedControl& control = found->second;
    const std::int64_t asked = all->controls[0].value;
    node.writes.emplace_back(found->first, asked);
    // The control framework clamps without a word.
    const std::int64_t clamped = std::clamp(asked, control.minimum, control.maximum);
    control.value = control.applied ? control.applied(clamped) : clamped;
    return 0;
  }
  static int TakeEvent(ScriptedNode& node, v4l2_event* event) {
    if (node.events.empty()) return -ENOENT;
    *event = node.events.front();
    node.events.pop_front();
    return 0;
  }
  static int Topology(const ScriptedNode& node, media_v2_topology* topology) {
    if (node.entities.empty()) return -ENOTTY;
    const auto fill = [](auto address, auto& count, const auto& from) {
      if (address != 0) {
        if (count < from.size()) return false;
        // NOLINTNEXTLINE(performance-no-int-to-ptr): media_v2_topology holds pointers as numbers.
        std::memcpy(reinterpret_cast<void*>(address), from.data(), from.size() * sizeof from[0]);
      }
      count = static_cast<__u32>(from.size());
      return true;
    };
    __u32 entities = topology->num_entities, interfaces = topology->num_interfaces, links = topology->num_links;
    const bool fits = fill(topology->ptr_entities, entities, node.entities) &&
                      fill(topology->ptr_interfaces, interfaces, node.interfaces) &&
                      fill(topology->ptr_links, links, node.links);
    topology->num_entities = entities;
    topology->num_interfaces = interfaces;
    topology->num_links = links;
    return fits ? 0 : -ENOSPC;
  }
  static int Smbus(ScriptedNode& node, i2c_smbus_ioctl_data* request) {
    if (node.selected != node.address) return -ENXIO;
    if (request->size == I2C_SMBUS_BYTE && request->read_write == I2C_SMBUS_READ) {
      request->data->byte = 0;
      return 0;
    }
    if (request->size != I2C_SMBUS_BYTE_DATA || request->read_write != I2C_SMBUS_WRITE) return -EOPNOTSUPP;
    node.sent.push_back({request->command, request->data->byte});
    return 0;
  }

  std::map<int, std::string> files_;
  int last_fd_ = 100;
};

}  // namespace lensd::drivers::v4l2
