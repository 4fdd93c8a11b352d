// Opens a node, a lens sub-device or a voice coil by serial number, place or node. The descriptor stays open: closing
// the last one parks some lenses.
#include "drivers/v4l2/driver.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <utility>

#include "actuator.h"
#include "config.h"
#include "drivers/api/own_autofocus.h"
#include "drivers/hotplug/nodes.h"
#include "media.h"
#include "open.h"
#include "v4l2_camera.h"
#include "v4l2_lens.h"

namespace lensd::drivers::v4l2 {
namespace {

using drivers::Axis;

struct AxisControl {
  Axis axis;
  std::uint32_t id;
};
constexpr AxisControl kAxisControls[] = {
    {Axis::Focus, V4L2_CID_FOCUS_ABSOLUTE}, {Axis::Iris, V4L2_CID_IRIS_ABSOLUTE}, {Axis::Zoom, V4L2_CID_ZOOM_ABSOLUTE}};

/// Of a voice coil unless configured: as fast as the kernel's own drivers ramp it (16 codes a millisecond), and the
/// usual time until the coil stands still.
constexpr double kCoilSpeed = 16000.0;
constexpr Duration kCoilSettle = std::chrono::milliseconds(10);

/// Kernel documentation, ext-ctrls-camera.rst, V4L2_CID_FOCUS_ABSOLUTE: "Positive values set the focus closer to the
/// camera, negative values towards infinity."
constexpr drivers::KnownDirection kByV4l2{drivers::Direction::NearPositive, "the V4L2 standard"};
/// The kernel's driver of this chip hands its codes through: more current pulls the lens toward near.
constexpr drivers::KnownDirection kByDw9714{drivers::Direction::NearPositive, "the voice coil driver DW9714"};

/// uvcvideo hands on what the camera means by its focus, which is not what V4L2 means: millimetres of distance by the
/// USB video class, and something else in most cameras.
std::optional<drivers::KnownDirection> DirectionOn(std::string_view kernel_driver) {
  if (kernel_driver == "uvcvideo") return std::nullopt;
  return kByV4l2;
}

/// A node, and what the device is called.
struct Place {
  std::string path;
  std::string serial;
};

class NodeChanges final : public Changes {
 public:
  explicit NodeChanges(std::shared_ptr<const Node> node) : node_(std::move(node)) {
    for (const AxisControl& one : kAxisControls) Subscribe(*node_, one.id);
    Subscribe(*node_, V4L2_CID_FOCUS_AUTO);
  }
  std::vector<Change> Take() override {
    std::vector<Change> changes;
    for (const ControlEvent& event : TakeEvents(*node_)) {
      if (event.id == V4L2_CID_FOCUS_AUTO && event.value_changed && event.value != 0) {
        changes.push_back({Axis::Focus, std::nullopt, std::string(drivers::kOwnAutofocusOn)});
      }
      const auto* found = std::ranges::find(kAxisControls, event.id, &AxisControl::id);
      if (found == std::end(kAxisControls)) continue;
      Change change{found->axis, std::nullopt, ""};
      if (event.value_changed) change.code = event.value;
      if (event.range_changed) change.notice = "its range has changed: the device must be opened again";
      changes.push_back(std::move(change));
    }
    return changes;
  }

 private:
  const std::shared_ptr<const Node> node_;
};

/// Automatic exposure moves the iris, or refuses that others do, but for the modes that set only the exposure time.
Result<void> HoldIris(const Node& node, Automatics& automatics) {
  const auto control = FindControl(node, V4L2_CID_EXPOSURE_AUTO);
  if (!control) return PassOn(control);
  if (!*control || !(*control)->readable) return {};
  const auto mode = GetControl(node, **control);
  if (!mode) return PassOn(mode);
  if (*mode == V4L2_EXPOSURE_MANUAL || *mode == V4L2_EXPOSURE_APERTURE_PRIORITY) return {};
  auto held = automatics.Hold(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY);
  if (held || held.error().code == Code::Disconnected) return held;
  return automatics.Hold(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL);
}

/// The device goes on with an automatism that could not be switched off, which may set back what is set by hand.
Result<void> DoubtOnly(const Result<void>& held, const std::string& what, drivers::Findings& findings) {
  if (held || drivers::ConcernsAll(held.error())) return held;
  findings.Doubt(what + " could not be switched off and may move it: " + held.error().message);
  return {};
}

/// Null where the node has no control of a lens that can be used.
Result<std::unique_ptr<drivers::Lens>> LensOn(std::shared_ptr<const Node> node, std::shared_ptr<Automatics> automatics,
                                              drivers::Capabilities who, bool coil,
                                              std::optional<drivers::KnownDirection> direction, const Config& config,
                                              drivers::Findings& findings, const Clock& clock) {
  std::vector<AxisParts> axes;
  for (const AxisControl& one : kAxisControls) {
    auto control = FindPart(*node, one.id);
    if (!control && drivers::ConcernsAll(control.error())) return PassOn(control);
    if (!control) findings.LeaveOut(drivers::AxisName(one.axis), control.error());
    if (!control || !*control) continue;
    AxisConfig axis = config.axes[one.axis];
    if (coil && !axis.speed) axis.speed = kCoilSpeed * axis.scale;
    if (coil && !axis.settle) axis.settle = kCoilSettle;
    AxisParts parts{one.axis, std::make_unique<ControlActuator>(node, **control), axis};
    if (one.axis == Axis::Focus) {
      parts.direction = direction;
      parts.take = [automatics] { return automatics->Hold(V4L2_CID_FOCUS_AUTO, 0); };
    }
    axes.push_back(std::move(parts));
  }
  if (axes.empty()) return std::unique_ptr<drivers::Lens>();
  // Before anything is written: while the device focuses by itself it refuses or ignores what it is told.
  const auto has = [&](Axis axis) { return std::ranges::find(axes, axis, &AxisParts::axis) != axes.end(); };
  Result<void> held;
  if (has(Axis::Focus)) {
    held = DoubtOnly(automatics->Hold(V4L2_CID_FOCUS_AUTO, 0), "focus: the device's own autofocus", findings);
  }
  if (held && has(Axis::Iris)) {
    held = DoubtOnly(HoldIris(*node, *automatics), "iris: the device's automatic exposure", findings);
  }
  if (!held) return PassOn(held);
  return CodeLens::Make(std::move(who), std::move(axes), std::move(automatics),
                        std::make_unique<NodeChanges>(std::move(node)), findings, clock);
}

Result<drivers::Device> OpenCoil(Kernel& kernel, const Config& config, const Clock& clock) {
  auto chip = OpenDw9714(kernel, config.i2c_bus, config.i2c_address);
  if (!chip) return PassOn(chip);
  std::vector<AxisParts> axes;
  AxisConfig axis = config.axes[Axis::Focus];
  if (!axis.speed) axis.speed = kCoilSpeed * axis.scale;
  if (!axis.settle) axis.settle = kCoilSettle;
  axes.push_back({Axis::Focus, std::move(*chip), axis, kByDw9714});
  drivers::Capabilities who{
      .driver = "v4l2", .model = "DW9714 voice coil on " + config.i2c_bus, .serial = "", .axes = {}};
  drivers::Device device;
  auto lens = CodeLens::Make(std::move(who), std::move(axes), nullptr, nullptr, device.findings, clock);
  if (!lens) return PassOn(lens);
  if (!*lens) return PassOn(device.findings.NothingLeft(config.i2c_bus));
  device.lens = std::move(*lens);
  return device;
}

/// The video nodes that show pictures: a USB camera has others beside, for metadata.
Result<std::vector<drivers::hotplug::Node>> PictureNodes(Kernel& kernel) {
  auto nodes = drivers::hotplug::ListNodes("video4linux");
  if (!nodes) return nodes;
  std::erase_if(*nodes, [&](const drivers::hotplug::Node& node) {
    const std::string name = node.path.substr(node.path.rfind('/') + 1);
    return !name.starts_with("video") || !kernel.Text("/sys/class/video4linux/" + name + "/index").starts_with("0");
  });
  return nodes;
}

Result<Place> FindPlace(Kernel& kernel, const Config& config) {
  if (!config.device.empty()) return Place{config.device, ""};
  if (!config.sensor.empty()) {
    const auto path = FindLensOfSensor(kernel, config.sensor);
    if (!path) return PassOn(path);
    return Place{*path, ""};
  }
  const auto nodes = PictureNodes(kernel);
  if (!nodes) return PassOn(nodes);
  const auto node = drivers::hotplug::Pick(*nodes, {config.serial, config.id_path}, "video device");
  if (!node) return PassOn(node);
  return Place{node->path, node->serial};
}

/// The pictures are of no use, and so are the controls for nothing but them, where the node has any.
Result<void> LeavePicturesOut(const Node& node, const Error& why, drivers::Findings& findings) {
  findings.LeaveOut("camera", why);
  struct Light {
    const char* part;
    std::uint32_t id;
  };
  for (const auto& [part, id] : {Light{"exposure", V4L2_CID_EXPOSURE_ABSOLUTE}, Light{"gain", V4L2_CID_GAIN},
                                 Light{"gain", V4L2_CID_ANALOGUE_GAIN}}) {
    const auto control = FindPart(node, id);
    if (!control && drivers::ConcernsAll(control.error())) return PassOn(control);
    if (!control) findings.LeaveOut(part, control.error());
    if (control && *control) findings.LeaveOut(part, {why.code, "it describes the pictures, which are left out"});
  }
  return {};
}

/// Null where its pictures are of no use.
Result<std::unique_ptr<drivers::Camera>> CameraOn(const std::shared_ptr<const Node>& node,
                                                  std::shared_ptr<Automatics> automatics, const NodeInfo& info,
                                                  const std::string& serial, const Config& config,
                                                  drivers::Findings& findings, const Clock& clock) {
  auto camera = StreamCamera::Make(node, std::move(automatics), info, serial, config, findings, clock);
  if (camera || config.names_pictures() || drivers::ConcernsAll(camera.error())) return camera;
  if (auto left = LeavePicturesOut(*node, camera.error(), findings); !left) return PassOn(left);
  return std::unique_ptr<drivers::Camera>();
}

}  // namespace

Result<drivers::Device> OpenOn(Kernel& kernel, const Config& config, const Clock& clock) {
  if (!config.i2c_bus.empty()) return OpenCoil(kernel, config, clock);
  const auto place = FindPlace(kernel, config);
  if (!place) return PassOn(place);
  auto opened = Node::Open(kernel, place->path);
  if (!opened) return PassOn(opened);
  const auto node = std::make_shared<const Node>(std::move(*opened));
  auto info = AskNode(*node);
  if (!info && info.error().code != Code::Unsupported && !drivers::ConcernsAll(info.error())) info = AskNode(*node);
  if (!info && drivers::ConcernsAll(info.error())) return PassOn(info);
  const bool coil = !info && info.error().code == Code::Unsupported;  // a sub-device: nothing but controls
  const auto automatics = std::make_shared<Automatics>(node);
  drivers::Device device;
  if (config.parts != Parts::Camera) {
    const std::string model = info   ? info->card + " (" + info->driver + ")"
                              : coil ? "lens sub-device " + place->path
                                     : "video device " + place->path;
    // Of a video device that does not say whose it is nothing is known.
    const auto direction = info ? DirectionOn(info->driver) : coil ? std::optional(kByV4l2) : std::nullopt;
    auto lens = LensOn(node, automatics, {.driver = "v4l2", .model = model, .serial = place->serial, .axes = {}}, coil,
                       direction, config, device.findings, clock);
    if (!lens) return PassOn(lens);
    device.lens = std::move(*lens);
  }
  const bool pictures = config.parts != Parts::Lens;
  if (pictures && !info && !coil) {
    if (auto left = LeavePicturesOut(*node, info.error(), device.findings); !left) return PassOn(left);
  }
  if (pictures && info && info->capture) {
    auto camera = CameraOn(node, automatics, *info, place->serial, config, device.findings, clock);
    if (!camera) return PassOn(camera);
    device.camera = std::move(*camera);
  }
  if (!device.lens && !device.camera && !device.findings.left_out().empty()) {
    return PassOn(device.findings.NothingLeft(place->path));
  }
  if (!device.lens && !device.camera) {
    const char* lacks = config.parts == Parts::Camera ? "no picture"
                        : config.parts == Parts::Lens ? "no control of focus, iris or zoom"
                                                      : "neither a picture nor a control of focus, iris or zoom";
    return Fail(Code::Unsupported, place->path + " has " + lacks);
  }
  return device;
}

Result<void> CheckV4l2(const Settings& settings) {
  const auto config = ReadConfig(settings);
  if (!config) return PassOn(config);
  return {};
}

Result<drivers::Device> OpenV4l2(const Settings& settings, const Clock& clock) {
  const auto config = ReadConfig(settings);
  if (!config) return PassOn(config);
  return OpenOn(RealKernel(), *config, clock);
}

Result<std::vector<drivers::FoundDevice>> ProbeV4l2() {
  Kernel& kernel = RealKernel();
  const auto nodes = PictureNodes(kernel);
  if (!nodes) return PassOn(nodes);
  std::vector<drivers::FoundDevice> found;
  for (const drivers::hotplug::Node& node : *nodes) {
    drivers::FoundDevice device;
    device.model = node.name;
    device.serial = node.serial;
    device.node = node.path;
    // One device may have several nodes of pictures, and then neither serial number nor place tells them apart.
    device.config = ConfigLines(node, *nodes);
    if (device.config.empty()) device.config = "device = \"" + node.path + "\"\n";
    device.problem = drivers::hotplug::AccessProblem(node.path);
    // Asking a video node what it can do disturbs no stream.
    if (const auto opened = Node::Open(kernel, node.path); opened) {
      const auto info = AskNode(*opened);
      if (!info) continue;
      device.camera = info->capture;
      if (device.model.empty()) device.model = info->card;
      for (const AxisControl& one : kAxisControls) {
        const auto control = FindControl(*opened, one.id);
        device.lens = device.lens || (control && *control);
      }
      if (!device.camera && !device.lens) continue;
    }
    found.push_back(std::move(device));
  }
  return found;
}

}  // namespace lensd::drivers::v4l2
