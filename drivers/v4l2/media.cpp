// The media graph: which lens belongs to which sensor. Graphs may change between two questions, so they are asked again
// a few times.
#include "media.h"

#include <linux/media.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <vector>

namespace lensd::drivers::v4l2 {
namespace {

/// One media device: its entities, the nodes that stand for them, and who is linked with whom.
struct Graph {
  std::vector<media_v2_entity> entities;
  std::vector<media_v2_interface> interfaces;
  std::vector<media_v2_link> links;
};

std::string NameOf(const media_v2_entity& entity) {
  return {entity.name, strnlen(entity.name, sizeof entity.name)};
}

/// The kernel is asked twice: how much there is, then for all of it. It may have grown between, so a few times.
Result<Graph> ReadGraph(const Node& node) {
  for (int attempt = 0; attempt < 5; ++attempt) {
    media_v2_topology topology{};
    int status = node.Ioctl(MEDIA_IOC_G_TOPOLOGY, &topology);
    if (status < 0) return KernelError(-status, node.path() + ", reading the media graph");
    Graph graph;
    graph.entities.resize(topology.num_entities);
    graph.interfaces.resize(topology.num_interfaces);
    graph.links.resize(topology.num_links);
    topology.num_pads = 0;
    topology.ptr_entities = reinterpret_cast<std::uintptr_t>(graph.entities.data());
    topology.ptr_interfaces = reinterpret_cast<std::uintptr_t>(graph.interfaces.data());
    topology.ptr_links = reinterpret_cast<std::uintptr_t>(graph.links.data());
    status = node.Ioctl(MEDIA_IOC_G_TOPOLOGY, &topology);
    if (status == -ENOSPC) continue;
    if (status < 0) return KernelError(-status, node.path() + ", reading the media graph");
    return graph;
  }
  return Fail(Code::Busy, node.path() + ": the media graph keeps changing");
}

std::vector<const media_v2_entity*> EntitiesOf(const Graph& graph, std::uint32_t function) {
  std::vector<const media_v2_entity*> found;
  for (const auto& entity : graph.entities) {
    if (entity.function == function) found.push_back(&entity);
  }
  return found;
}

const media_v2_entity* LensOf(const Graph& graph, const media_v2_entity& sensor) {
  const auto lenses = EntitiesOf(graph, MEDIA_ENT_F_LENS);
  for (const auto& link : graph.links) {
    if ((link.flags & MEDIA_LNK_FL_LINK_TYPE) != MEDIA_LNK_FL_ANCILLARY_LINK) continue;
    for (const auto* lens : lenses) {
      const bool joins = (link.source_id == sensor.id && link.sink_id == lens->id) ||
                         (link.source_id == lens->id && link.sink_id == sensor.id);
      if (joins) return lens;
    }
  }
  const bool alone = lenses.size() == 1 && EntitiesOf(graph, MEDIA_ENT_F_CAM_SENSOR).size() == 1;
  return alone ? lenses.front() : nullptr;
}

/// "/dev/v4l-subdev3", by the numbers of its interface.
std::optional<std::string> NodeOf(Kernel& kernel, const Graph& graph, const media_v2_entity& lens) {
  for (const auto& link : graph.links) {
    if ((link.flags & MEDIA_LNK_FL_LINK_TYPE) != MEDIA_LNK_FL_INTERFACE_LINK || link.sink_id != lens.id) continue;
    const auto interface = std::ranges::find(graph.interfaces, link.source_id, [](const auto& i) { return i.id; });
    if (interface == graph.interfaces.end() || interface->intf_type != MEDIA_INTF_T_V4L_SUBDEV) continue;
    const std::string place = "/sys/dev/char/" + std::to_string(interface->devnode.major) + ":" +
                              std::to_string(interface->devnode.minor) + "/uevent";
    const std::string text = "\n" + kernel.Text(place);
    const std::string key = "\nDEVNAME=";
    const auto begin = text.find(key);
    if (begin == std::string::npos) continue;
    const auto name = begin + key.size();
    return "/dev/" + text.substr(name, text.find('\n', name) - name);
  }
  return std::nullopt;
}

struct Match {
  Graph graph;
  media_v2_entity sensor;
};

}  // namespace

Result<std::string> FindLensOfSensor(Kernel& kernel, const std::string& sensor) {
  std::vector<Match> exact, partial;
  std::string known;
  for (const std::string& path : kernel.List("/dev", "media")) {
    const auto node = Node::Open(kernel, path);
    if (!node) return PassOn(node);
    const auto graph = ReadGraph(*node);
    if (!graph) return PassOn(graph);
    for (const auto* entity : EntitiesOf(*graph, MEDIA_ENT_F_CAM_SENSOR)) {
      const std::string name = NameOf(*entity);
      known += (known.empty() ? "" : ", ") + ("\"" + name + "\"");
      if (name == sensor) exact.push_back({*graph, *entity});
      if (name.find(sensor) != std::string::npos) partial.push_back({*graph, *entity});
    }
  }
  const auto& matches = exact.empty() ? partial : exact;
  const std::string there_are = known.empty() ? "; the media graphs have no sensor" : "; there are " + known;
  if (matches.empty()) return Fail(Code::Disconnected, "no sensor \"" + sensor + "\"" + there_are);
  if (matches.size() > 1) {
    return Fail(Code::InvalidArgument, "several sensors are named like \"" + sensor + "\"" + there_are);
  }
  const Match& match = matches.front();
  const media_v2_entity* lens = LensOf(match.graph, match.sensor);
  if (lens == nullptr) {
    return Fail(Code::Disconnected, "the kernel knows no lens of the sensor \"" + NameOf(match.sensor) +
                                        "\"; name its node with device = \"/dev/v4l-subdevN\", or use i2c_bus");
  }
  const auto found = NodeOf(kernel, match.graph, *lens);
  if (!found) return Fail(Code::Disconnected, "the lens \"" + NameOf(*lens) + "\" has no device node");
  return *found;
}

}  // namespace lensd::drivers::v4l2
