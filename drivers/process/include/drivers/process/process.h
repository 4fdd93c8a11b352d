// Devices whose driver is a process of its own: one more drivers::Lens and drivers::Camera, whose calls go to the
// process over io.lensd.Driver.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "base/settings.h"
#include "drivers/api/device.h"

namespace lensd::drivers::process {

/// How a driver is run.
struct Program {
  std::vector<std::string> command;  ///< an absolute path and its arguments
  std::string driver;                ///< how the configuration calls it
  /// Devices with the same text share one process, as those on one bus must; empty: a process of its own.
  std::string shares = {};
  /// Gets each line that the process prints, without its end, from a thread of its own, at most 100 a second.
  std::function<void(std::string_view line)> log = {};
  /// Gets the number of the process in which a device is opened (true), and which it leaves (false). Any thread.
  std::function<void(int process, bool opened)> runs = {};
  Duration call_at_most = std::chrono::seconds(8);   ///< then the process is ended
  Duration open_at_most = std::chrono::seconds(14);  ///< the same of opening a device
};

/// Starts the program, unless one that is shared runs already, and opens a device in it. Each call of the device then
/// ends within call_at_most. A process that ended, was ended, or broke the rules is Disconnected, with signal or exit
/// status, the call under way and the last ten lines that it printed; its devices must be destroyed and opened anew.
/// Destroying a device closes it in the process; the last one ends the process, by SIGKILL where it takes longer than 3
/// s. Only the machine's clock will do, since instants come from the process. Errors of the driver, and Disconnected.
Result<Device> OpenInProcess(const Program& program, const Settings& settings, const Clock& clock);

}  // namespace lensd::drivers::process
