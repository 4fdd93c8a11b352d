// The families of drives, each in its own file.
#pragma once

#include <memory>

#include "sim/devices/modbus_drive.h"

namespace lensd::sim {

/// As MakeModbusDrive().
std::unique_ptr<ModbusDrive> MakeOrientalAz(double counts);
std::unique_ptr<ModbusDrive> MakeMoons(double counts);
std::unique_ptr<ModbusDrive> MakeLeadshineRs(double counts);
std::unique_ptr<ModbusDrive> MakeGeneric(double counts);

}  // namespace lensd::sim
