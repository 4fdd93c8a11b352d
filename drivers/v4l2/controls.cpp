// V4L2 controls with their ranges, read back after each write because the kernel clamps silently, and their events.
#include "controls.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "drivers/api/device.h"

namespace lensd::drivers::v4l2 {
namespace {

bool Plain(std::uint32_t type) {
  return type == V4L2_CTRL_TYPE_INTEGER || type == V4L2_CTRL_TYPE_BOOLEAN || type == V4L2_CTRL_TYPE_MENU ||
         type == V4L2_CTRL_TYPE_INTEGER_MENU;
}

/// Extended, since that is what camera-class controls are defined for.
v4l2_ext_controls Around(v4l2_ext_control& control) {
  v4l2_ext_controls all{};
  all.which = V4L2_CTRL_WHICH_CUR_VAL;
  all.count = 1;
  all.controls = &control;
  return all;
}

/// What the driver says of a control; none: it has none.
Result<std::optional<v4l2_query_ext_ctrl>> Query(const Node& node, std::uint32_t id) {
  v4l2_query_ext_ctrl query{};
  query.id = id;
  const int status = node.Ioctl(VIDIOC_QUERY_EXT_CTRL, &query);
  if (status == -EINVAL || status == -ENOTTY) return std::nullopt;
  if (status < 0) return KernelError(-status, node.path() + ", asking for a control");
  return query;
}

std::string NameOf(const v4l2_query_ext_ctrl& query) {
  return {query.name, strnlen(query.name, sizeof query.name)};
}

/// Empty, or why no number can be set with it.
std::string WhyNotSettable(const v4l2_query_ext_ctrl& query) {
  if ((query.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return "is disabled by the device's driver";
  if ((query.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0) return "can be read and not set";
  return Plain(query.type) ? "" : "takes no number";
}

Result<Control> ControlOf(const Node& node, const v4l2_query_ext_ctrl& query) {
  Control control;
  control.id = query.id;
  control.name = NameOf(query);
  control.minimum = query.minimum;
  control.maximum = query.maximum;
  // Values of plain controls have 32 bits: beyond those nothing that is said of them can be so.
  constexpr std::int64_t kLowest = std::numeric_limits<std::int32_t>::min();
  constexpr std::int64_t kHighest = std::numeric_limits<std::int32_t>::max();
  if (control.minimum < kLowest || control.maximum > kHighest || control.minimum > control.maximum) {
    return Fail(Code::Protocol, node.path() + ": its driver says that the control \"" + control.name + "\" goes from " +
                                    std::to_string(query.minimum) + " to " + std::to_string(query.maximum));
  }
  control.step =
      static_cast<std::int64_t>(std::clamp<std::uint64_t>(query.step, 1, static_cast<std::uint64_t>(kHighest)));
  control.readable = (query.flags & V4L2_CTRL_FLAG_WRITE_ONLY) == 0;
  control.live = control.readable && (query.flags & V4L2_CTRL_FLAG_VOLATILE) != 0;
  control.inactive = (query.flags & V4L2_CTRL_FLAG_INACTIVE) != 0;
  return control;
}

}  // namespace

Result<std::optional<Control>> FindControl(const Node& node, std::uint32_t id) {
  const auto query = Query(node, id);
  if (!query) return PassOn(query);
  if (!*query || !WhyNotSettable(**query).empty()) return std::nullopt;
  auto control = ControlOf(node, **query);
  if (!control) return PassOn(control);
  return *std::move(control);
}

Result<std::optional<Control>> FindPart(const Node& node, std::uint32_t id) {
  auto query = Query(node, id);
  if (!query && !drivers::ConcernsAll(query.error())) query = Query(node, id);
  if (!query) return PassOn(query);
  if (!*query) return std::nullopt;
  const std::string what = "the control \"" + NameOf(**query) + "\" ";
  if (const std::string why = WhyNotSettable(**query); !why.empty()) return Fail(Code::Unsupported, what + why);
  auto control = ControlOf(node, **query);
  if (!control) return Fail(Code::Unsupported, control.error().message);
  if (control->minimum == control->maximum) {
    return Fail(Code::Unsupported, what + "is fixed at " + std::to_string(control->minimum));
  }
  if (control->step > control->maximum - control->minimum) {
    return Fail(Code::Unsupported, what + "has steps of " + std::to_string(control->step) + " in a range from " +
                                       std::to_string(control->minimum) + " to " + std::to_string(control->maximum));
  }
  return *std::move(control);
}

Result<void> SetControl(const Node& node, const Control& control, std::int64_t value) {
  v4l2_ext_control one{};
  one.id = control.id;
  one.value = static_cast<std::int32_t>(value);
  v4l2_ext_controls all = Around(one);
  const int status = node.Ioctl(VIDIOC_S_EXT_CTRLS, &all);
  if (status == 0) return {};
  const std::string what = node.path() + ", setting \"" + control.name + "\" to " + std::to_string(value);
  if (status == -EACCES) {
    return Fail(Code::Busy, what + ": the device's own automatism holds it; another program has switched it on");
  }
  return KernelError(-status, what);
}

Result<std::int64_t> GetControl(const Node& node, const Control& control) {
  v4l2_ext_control one{};
  one.id = control.id;
  v4l2_ext_controls all = Around(one);
  const int status = node.Ioctl(VIDIOC_G_EXT_CTRLS, &all);
  if (status < 0) return KernelError(-status, node.path() + ", reading \"" + control.name + "\"");
  return std::int64_t{one.value};
}

Result<std::int64_t> GetControlAtOpening(const Node& node, const Control& control) {
  auto value = GetControl(node, control);
  if (!value && !drivers::ConcernsAll(value.error())) value = GetControl(node, control);
  return value;
}

void Subscribe(const Node& node, std::uint32_t id) {
  v4l2_event_subscription wanted{};
  wanted.type = V4L2_EVENT_CTRL;
  wanted.id = id;
  (void)node.Ioctl(VIDIOC_SUBSCRIBE_EVENT, &wanted);
}

std::vector<ControlEvent> TakeEvents(const Node& node) {
  std::vector<ControlEvent> events;
  // The node was opened not to wait. The bound keeps a driver that invents events from keeping us.
  for (int i = 0; i < 64; ++i) {
    v4l2_event event{};
    if (node.Ioctl(VIDIOC_DQEVENT, &event) < 0) break;
    if (event.type != V4L2_EVENT_CTRL) continue;
    events.push_back({.id = event.id,
                      .value_changed = (event.u.ctrl.changes & V4L2_EVENT_CTRL_CH_VALUE) != 0,
                      .range_changed = (event.u.ctrl.changes & V4L2_EVENT_CTRL_CH_RANGE) != 0,
                      .value = event.u.ctrl.value});
  }
  return events;
}

Result<void> Automatics::Hold(std::uint32_t id, std::int64_t value) {
  const auto control = FindControl(*node_, id);
  if (!control) return PassOn(control);
  if (!*control || !(*control)->readable) return {};
  const auto now = GetControl(*node_, **control);
  if (!now) return PassOn(now);
  if (*now == value) return {};
  if (auto set = SetControl(*node_, **control, value); !set) return set;
  const bool known = std::ranges::find(before_, id, [](const Before& one) { return one.control.id; }) != before_.end();
  if (!known) before_.push_back({**control, *now});
  return {};
}

Automatics::~Automatics() {
  for (const Before& one : before_) (void)SetControl(*node_, one.control, one.value);
}

}  // namespace lensd::drivers::v4l2
