// Which drivers this build has.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "drivers/api/device.h"

namespace lensd::daemon {

/// The explicit table.
std::span<const drivers::Driver> Drivers();
/// nullptr: not built.
const drivers::Driver* FindDriver(std::string_view name);
/// "sim, v4l2": for messages.
std::string DriverNames();

}  // namespace lensd::daemon
