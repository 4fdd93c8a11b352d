// One absolute control of the camera terminal as an axis: its range, and whether it has arrived.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "controls.h"

namespace lensd::drivers::uvc {

/// What a control says of itself (GET_INFO, GET_MIN, ...), in its own units.
struct ControlRange {
  bool asynchronous = false;  ///< GET_INFO D4: a setting returns at once and its end comes over the status endpoint
  std::int64_t minimum = 0;
  std::int64_t maximum = 0;
  std::int64_t resolution = 1;
  std::int64_t current = 0;

  /// The nearest value the control takes.
  std::int64_t Nearest(double value) const;
};

/// Asks an unsigned control of up to 4 bytes for its range. A device that refuses to tell the resolution gets 1, as the
/// class text has it. What failed once is asked once more; a control that does not answer is not asked further.
/// Unsupported: it cannot be used, since it says no range, an impossible one or a single value, or cannot be set.
/// Errors of the transfer.
Result<ControlRange> ReadRange(Controls& controls, ControlAddress at, const UnitControl& control,
                               const std::string& what);

/// A status packet of a control (UVC 1.1 section 2.4.2.2).
struct StatusEvent {
  enum class Attribute : std::uint8_t { Value = 0, Info = 1, Failure = 2 };
  std::uint8_t entity = 0;
  std::uint8_t selector = 0;
  Attribute attribute = Attribute::Value;
  std::vector<std::uint8_t> value;  ///< the control's new one, as far as the packet has it
};
/// nullopt: about something else, or damaged.
std::optional<StatusEvent> ParseStatus(std::span<const std::uint8_t> packet);

}  // namespace lensd::drivers::uvc
