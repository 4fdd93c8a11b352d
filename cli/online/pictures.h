// Pictures from the daemon.
#pragma once

#include <string>

#include "cli/online/daemon_client.h"

namespace lensd::cli {

/// Saves one new frame as PNG and returns the interface's FrameInfo with `file`.
std::expected<varlink::Json, Failure> SaveSnapshot(DaemonClient& link, const varlink::Json& lens,
                                                   const std::string& path);

}  // namespace lensd::cli
