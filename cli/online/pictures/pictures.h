// Pictures from the daemon.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/link/daemon_client.h"

namespace lensd::cli {

struct TakenPicture {
  varlink::Json frame;  ///< FrameInfo with `picture`
  std::vector<std::uint8_t> bytes;
};
/// Takes one new frame as `parameters` of Snapshot say.
std::expected<TakenPicture, Failure> TakeSnapshot(DaemonClient& link, varlink::Json parameters);

/// The same, saves it (on stdout where `path` is "-"), and returns the
/// interface's FrameInfo with `file` and `picture`.
std::expected<varlink::Json, Failure> SaveSnapshot(DaemonClient& link, varlink::Json parameters,
                                                   const std::string& path);

}  // namespace lensd::cli
