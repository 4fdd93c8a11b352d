// One absolute UVC control as an axis: GET_MIN, MAX, RES and CUR, and what an interrupt status says of it.
#include "axis_control.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/api/device.h"

namespace lensd::drivers::uvc {
namespace {

/// nullopt: the device would not say.
Result<std::optional<std::int64_t>> Ask(Controls& controls, std::uint8_t request, ControlAddress at,
                                        std::uint16_t length, const std::string& what) {
  auto bytes = controls.TryGet(request, at, length, what);
  if (!bytes && !ConcernsAll(bytes.error())) bytes = controls.TryGet(request, at, length, what);
  if (!bytes) return PassOn(bytes);
  if (!*bytes) return std::nullopt;
  return FromLittle(**bytes);
}

}  // namespace

std::int64_t ControlRange::Nearest(double value) const {
  const auto steps = std::llround((value - static_cast<double>(minimum)) / static_cast<double>(resolution));
  const std::int64_t most = (maximum - minimum) / resolution;
  return minimum + std::clamp<std::int64_t>(steps, 0, most) * resolution;
}

Result<ControlRange> ReadRange(Controls& controls, ControlAddress at, const UnitControl& control,
                               const std::string& what) {
  constexpr std::uint8_t kRequests[] = {kGetInfo, kGetMin, kGetMax, kGetRes, kGetCur};
  std::optional<std::int64_t> answers[std::size(kRequests)];
  for (std::size_t i = 0; i < std::size(kRequests); ++i) {
    const auto length = kRequests[i] == kGetInfo ? std::uint16_t{1} : control.length;
    auto answer = Ask(controls, kRequests[i], at, length, what);
    if (!answer) return PassOn(answer);
    answers[i] = *answer;
  }
  const auto& [info, minimum, maximum, resolution, current] = answers;
  if (!minimum || !maximum || !current) {
    return Fail(Code::Unsupported, what + ": the camera lists the control but does not report its range");
  }
  if (info && (*info & 0x02) == 0) return Fail(Code::Unsupported, what + ": the control can be read and not set");
  ControlRange range;
  range.asynchronous = info && (*info & 0x10) != 0;
  range.minimum = *minimum;
  range.maximum = *maximum;
  range.resolution = std::max<std::int64_t>(1, resolution.value_or(1));
  range.current = *current;
  const std::string from_to = std::to_string(range.minimum) + " to " + std::to_string(range.maximum);
  if (range.minimum == range.maximum) {
    return Fail(Code::Unsupported, what + ": the control is fixed at " + std::to_string(range.minimum));
  }
  if (range.minimum > range.maximum) {
    return Fail(Code::Unsupported, what + ": the camera says that the control goes from " + from_to);
  }
  if (range.resolution > range.maximum - range.minimum) {
    return Fail(Code::Unsupported, what + ": the camera says that the control has steps of " +
                                       std::to_string(range.resolution) + " in a range from " + from_to);
  }
  return range;
}

std::optional<StatusEvent> ParseStatus(std::span<const std::uint8_t> packet) {
  constexpr std::uint8_t kFromControl = 1, kControlChange = 0;
  if (packet.size() < 5 || (packet[0] & 0x0F) != kFromControl || packet[2] != kControlChange) return std::nullopt;
  if (packet[4] > 2) return std::nullopt;
  StatusEvent event;
  event.entity = packet[1];
  event.selector = packet[3];
  event.attribute = static_cast<StatusEvent::Attribute>(packet[4]);
  event.value.assign(packet.begin() + 5, packet.end());
  return event;
}

}  // namespace lensd::drivers::uvc
