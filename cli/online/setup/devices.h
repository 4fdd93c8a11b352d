// What is plugged in.
#pragma once

#include <string>

#include "cli/link/daemon_client.h"

namespace lensd::cli {

/// One line about a FoundDevice: its driver, model, and what it is.
std::string DeviceLine(const varlink::Json& device);

}  // namespace lensd::cli
