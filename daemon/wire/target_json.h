// Targets as the interface writes them.
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "rig/rig.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// `target` is a Target of the interface, `path` what the call names it; `from`: where its distance starts.
/// InvalidArgument: not exactly one field.
Result<rig::Target> TargetOf(const varlink::Json& target, std::optional<optics::DistanceFrom> from,
                             const std::string& path);

/// "target.position": what the target named `path` is given by.
std::string TargetPath(const std::string& path, const varlink::Json& target);

}  // namespace lensd::daemon
