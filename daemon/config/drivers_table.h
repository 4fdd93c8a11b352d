// Which drivers this build has.
#pragma once

#include <optional>
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

/// Lets drivers run this program anew for what may crash or never end. Before any thread begins. The exit status where
/// these arguments say that this is such a process, which has done its work then.
std::optional<int> BeginDrivers(std::span<char*> arguments);

}  // namespace lensd::daemon
