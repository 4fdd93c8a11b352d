// The program of all built-in drivers lies beside lensd in a build folder, and in lib/lensd/drivers where it is
// installed.
#include "daemon/methods/open_driver.h"

#include <filesystem>
#include <string>
#include <string_view>

#include "daemon/events/log.h"
#include "drivers/process/process.h"

namespace lensd::daemon {
namespace {

std::string DriverProgram() {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  const std::filesystem::path beside = folder / "lensd-driver";
  if (std::filesystem::exists(beside, error)) return beside.string();
  return (folder.parent_path() / "lib" / "lensd" / "drivers" / "lensd-driver").string();
}

}  // namespace

Result<drivers::Device> OpenDriver(const DeviceConfig& config, const Clock& clock) {
  if (!config.own_process) return config.driver->open(config.settings, clock);
  const std::string name(config.driver->name);
  const auto log = [lens = config.lens, name](std::string_view line) {
    Log(Severity::Info, Event::DriverPrinted, "driver " + name + ": " + std::string(line), lens);
  };
  return drivers::process::OpenInProcess(
      {.command = {DriverProgram(), name}, .driver = name, .shares = config.shares, .log = log}, config.settings,
      clock);
}

}  // namespace lensd::daemon
