// V4L2 controls of one node.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernel.h"

namespace lensd::drivers::v4l2 {

/// One integer, menu or switch control as the driver describes it.
struct Control {
  std::uint32_t id = 0;
  std::string name;
  std::int64_t minimum = 0;
  std::int64_t maximum = 0;
  std::int64_t step = 1;
  bool readable = true;
  bool live = false;      ///< read from the device each time, not from what was written
  bool inactive = false;  ///< has no effect now: some automatism is on
};

/// What happened to a control since the last look.
struct ControlEvent {
  std::uint32_t id = 0;
  bool value_changed = false;
  bool range_changed = false;
  std::int64_t value = 0;
};

/// The control, or none where the node has none that can be written. Disconnected and the like: from the device.
Result<std::optional<Control>> FindControl(const Node& node, std::uint32_t id);
/// The control as a part of the device, or none where the node lists none. Unsupported: it is listed and cannot be
/// used, since it cannot be set, has an impossible range, or nothing to choose from. Otherwise as FindControl().
Result<std::optional<Control>> FindPart(const Node& node, std::uint32_t id);
/// EACCES here means that an automatism of the device holds the control: Busy.
Result<void> SetControl(const Node& node, const Control& control, std::int64_t value);
Result<std::int64_t> GetControl(const Node& node, const Control& control);
/// The same while the device is opened: what failed once is asked once more.
Result<std::int64_t> GetControlAtOpening(const Node& node, const Control& control);
/// Asks to be told of changes that others make. Drivers without events are none the worse.
void Subscribe(const Node& node, std::uint32_t id);
/// All events waiting.
std::vector<ControlEvent> TakeEvents(const Node& node);

/// The device's own automatisms, switched off for the life of this object and back as they were at its end. A lens and
/// a camera of one node share it, so that neither brings back what the other has set.
class Automatics {
 public:
  explicit Automatics(std::shared_ptr<const Node> node) : node_(std::move(node)) {}
  Automatics(const Automatics&) = delete;
  Automatics& operator=(const Automatics&) = delete;
  ~Automatics();

  /// Sets the control to `value`, where the node has it and it is not so already.
  Result<void> Hold(std::uint32_t id, std::int64_t value);

 private:
  struct Before {
    Control control;
    std::int64_t value = 0;
  };

  const std::shared_ptr<const Node> node_;
  std::vector<Before> before_;
};

}  // namespace lensd::drivers::v4l2
