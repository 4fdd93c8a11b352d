// Device classes for systemd: those that the drivers of a configuration open, and no others.
#pragma once

#include <string>

#include "daemon/config/config.h"

namespace lensd::daemon {

/// A drop-in for lensd.service that takes the place of its DeviceAllow= lines.
std::string UnitDropIn(const Config& config, const std::string& file);

}  // namespace lensd::daemon
