// A configuration read past its mistakes, so that all of them can be told.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/settings.h"
#include "daemon/config/config.h"

namespace lensd::daemon {

/// What is wrong with a configuration.
struct ConfigFaults {
  Result<void> first{};              ///< success: nothing is
  std::vector<Location> no_toml{};   ///< lines that are not TOML: nothing else that is told of them counts
  std::vector<Location> lenses{};    ///< [[lens]] tables with a mistake of their own
  std::vector<std::string> files{};  ///< of the configuration, in the order in which they were read
  std::vector<std::string> buses{};  ///< names of [[bus]] tables with a mistake

  /// Tells the thread's SettingsProblems too.
  void Keep(const Error& error, const Location& otherwise = {});
};

/// Reads all that can be read (config.h), past every mistake. A lens with a mistake is among those of the answer,
/// without a driver where nothing more can be told of its device.
Config ReadPastFaults(const std::string& path, ConfigFaults& faults);

/// Keys of [[lens]] that are not the driver's.
std::span<const std::string_view> OwnLensKeys();

/// What to say of a name that no driver has.
std::string WhyNoDriver(const std::string& name);

/// Of the keys of a table whose driver is not known, only those can be judged that may stand for one of `own_keys`.
void LeaveDriversKeys(SettingsReader& read, const Settings& table, std::span<const std::string_view> own_keys);

}  // namespace lensd::daemon
