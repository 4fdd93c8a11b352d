// Which lens of the daemon is meant.
#pragma once

#include <optional>
#include <string>

#include "cli/link/daemon_client.h"

namespace lensd::cli {

/// LensInfo of the lens of that name, or of the only one where the name is empty.
std::expected<varlink::Json, Failure> FindInfo(DaemonClient& link, const std::string& lens);
/// Whether the daemon has a lens of this name; false where it is not there.
bool IsLens(const Session& session, const std::string& name);

/// Why nothing can be planned for it: a hole without a lens, or a lens whose optics were not stated.
std::optional<Failure> NothingToPlan(const varlink::Json& info);

}  // namespace lensd::cli
