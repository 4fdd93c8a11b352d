// The program of all built-in drivers lies beside lensd in a build folder, and in lib/lensd/drivers where it is
// installed.
#include "daemon/methods/open_driver.h"

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

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

/// Each absolute path that a driver's settings name.
void AddPaths(const Settings& settings, std::vector<std::string>& paths) {
  if (const auto* table = settings.AsTable()) {
    for (const auto& [key, value] : *table) AddPaths(value, paths);
  } else if (const auto* array = settings.AsArray()) {
    for (const Settings& value : *array) AddPaths(value, paths);
  } else if (const auto* text = std::get_if<std::string>(&settings.value());
             text != nullptr && text->starts_with('/')) {
    paths.push_back(*text);
  }
}

}  // namespace

Result<drivers::Device> OpenDriver(const DeviceConfig& config, const Clock& clock) {
  if (!config.process) return config.driver->open(config.settings, clock);
  const std::string name(config.driver->name);
  const auto log = [lens = config.lens, name](std::string_view line) {
    Log(Severity::Info, Event::DriverPrinted, "driver " + name + ": " + std::string(line), lens);
  };
  const auto runs = [process = config.process](int number, bool opened) {
    if (opened) *process = number;
    if (!opened) process->compare_exchange_strong(number, 0);  // another one may have been opened before this one left
  };
  std::vector<std::string> command = {DriverProgram(), name};
  AddPaths(config.settings, command);
  return drivers::process::OpenInProcess(
      {.command = std::move(command), .driver = name, .shares = config.shares, .log = log, .runs = runs},
      config.settings, clock);
}

}  // namespace lensd::daemon
