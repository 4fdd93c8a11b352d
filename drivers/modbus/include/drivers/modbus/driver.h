// The driver "modbus": lens rings turned by stepper and servo drives on Modbus RTU and TCP buses.
#pragma once

#include <string_view>
#include <vector>

#include "drivers/api/device.h"

namespace lensd::drivers::modbus {

/// Opens a lens whose axes are drives on one bus. Keys of `settings`: `bus`, the table of the [[bus]] it hangs on (with
/// its `name`), and `drives`, a table by axis, each with `unit`, `range` and `profile`, the profile's own table.
/// docs/drivers/modbus.md has every key. Lenses that name the same bus share its connection and its thread. BadData:
/// settings, as file:line. Disconnected: a drive does not answer. Protocol: it answers, but not as its profile says.
Result<drivers::Device> OpenModbus(const Settings& settings, const Clock& clock);
/// Whether settings for OpenModbus() make sense without the device. BadData.
Result<void> CheckModbus(const Settings& settings);
/// The serial ports on which a bus may be. Nothing is sent: a question could be taken for one of another protocol.
Result<std::vector<drivers::FoundDevice>> ProbeModbus();

/// Whether a [[bus]] table, its `name` included, makes sense: BadData, as file:line.
Result<void> CheckBus(const Settings& bus);

/// The text (TOML) of a profile that ships with the driver; empty: there is none of that name.
std::string_view ShippedProfile(std::string_view name);
/// "oriental-az, moons": for messages.
std::string_view ShippedProfileNames();
inline constexpr drivers::Profiles kProfiles{ShippedProfile, ShippedProfileNames};

}  // namespace lensd::drivers::modbus
