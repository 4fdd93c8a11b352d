// The fault of a focus axis that a device moves by itself.
#pragma once

#include <string_view>

namespace lensd::drivers {

/// Another program has switched on the device's own autofocus, as AxisState::fault has it. The next move to a position
/// switches it off again.
inline constexpr std::string_view kOwnAutofocusOn = "another program has switched on the device's own autofocus";

}  // namespace lensd::drivers
