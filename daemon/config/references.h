// What the settings of a device refer to by name: profiles that ship with its driver or lie in files, and buses.
#pragma once

#include <map>
#include <string>

#include "base/result.h"
#include "base/settings.h"
#include "drivers/api/device.h"

namespace lensd::daemon {

/// One [[bus]].
struct BusEntry {
  const drivers::Driver* driver = nullptr;
  Settings settings;  ///< the whole table
};
using Buses = std::map<std::string, BusEntry, std::less<>>;

/// Reads a [[bus]] table and adds it. BadData: "file:line: what is wrong".
Result<void> AddBus(const Settings& table, Buses& buses);

/// `settings` of a device of `driver`, where every `profile = "NAME"` or `profile = "FILE.toml"` has become the
/// profile's own table. BadData: no such profile, or one that cannot be read.
Result<Settings> WithProfiles(const Settings& settings, const drivers::Driver& driver);

/// `settings` with the table of the bus that `name` names under the key "bus". BadData: there is none, or it is another
/// driver's.
Result<Settings> WithBus(const Settings& settings, const Settings& name, const drivers::Driver& driver,
                         const Buses& buses);

}  // namespace lensd::daemon
