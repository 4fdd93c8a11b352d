// The driver "sim": a lens, its camera and its nominal optics out of a scene file.
#pragma once

#include "drivers/api/device.h"

namespace lensd::sim {

/// Keys of `settings`: `scene`, the scene file's path (required), and `seed`, a whole number for the noise (default 1).
/// BadData: another key, or a scene that cannot be read; Io: no such file.
Result<drivers::Device> OpenSim(const Settings& settings, const Clock& clock);
/// Whether they make sense, the scene included; errors as OpenSim().
Result<void> CheckSim(const Settings& settings);

}  // namespace lensd::sim
