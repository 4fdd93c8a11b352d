// Driver "lensconnect": Computar LensConnect lenses over USB.
#pragma once

#include "drivers/api/device.h"

namespace lensd::drivers::lensconnect {

/// Opens the lens that `serial` or `id_path` names, else the only one that is plugged in. The keys are those of
/// docs/drivers/lensconnect.md.
Result<Device> OpenLensConnect(const Settings& settings, const Clock& clock);
/// Whether settings for OpenLensConnect() make sense without the device. BadData.
Result<void> CheckLensConnect(const Settings& settings);
/// The lenses that are plugged in, by what the kernel knows of them.
Result<std::vector<FoundDevice>> ProbeLensConnect();

}  // namespace lensd::drivers::lensconnect
