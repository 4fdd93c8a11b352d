// Pictures from the daemon.
#pragma once

#include <string>

#include "cli/online/daemon_client.h"

namespace lensd::cli {

/// Takes one new frame as `parameters` of Snapshot say, saves it (on stdout where `path` is "-"), and returns the
/// interface's FrameInfo with `file` and `picture`.
std::expected<varlink::Json, Failure> SaveSnapshot(DaemonClient& link, varlink::Json parameters,
                                                   const std::string& path);

}  // namespace lensd::cli
