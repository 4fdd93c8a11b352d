// Which drivers this build has.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/api/device.h"

namespace lensd::daemon {

/// The explicit table.
std::span<const drivers::Driver> Drivers();
/// nullptr: not built.
const drivers::Driver* FindDriver(std::string_view name);
/// What a driver opens beside what its settings name by path.
struct DriverNeeds {
  std::string_view driver;
  std::vector<std::string_view> classes;  ///< of devices, as systemd names them: also of those that settings name
  std::vector<std::string_view> nodes;    ///< how their names in /dev begin, or a folder there
  bool network = false;
};
/// Nothing for a name that is not in the table.
const DriverNeeds& NeedsOf(std::string_view driver);
/// "sim, v4l2": for messages.
std::string DriverNames();

/// Lets drivers run this program anew for what may crash or never end. Before any thread begins. The exit status where
/// these arguments say that this is such a process, which has done its work then.
std::optional<int> BeginDrivers(std::span<char*> arguments);

}  // namespace lensd::daemon
