// Pictures from the daemon.
#pragma once

#include <string>

#include "cli/online/link.h"

namespace lensd::cli {

/// Saves one new frame as PNG and returns the interface's FrameInfo with `file`.
std::expected<proto::Json, Failure> SaveSnapshot(Link& link, const proto::Json& lens, const std::string& path);

}  // namespace lensd::cli
