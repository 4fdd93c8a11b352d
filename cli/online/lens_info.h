// What the daemon knows of a lens, for planning.
#pragma once

#include <optional>
#include <string>

#include "cli/online/link.h"
#include "cli/plan/options.h"

namespace lensd::cli {

/// LensInfo of the lens of that name, or of the only one where the name is empty.
std::expected<proto::Json, Failure> FindInfo(Link& link, const std::string& lens);

/// What the lens answers for options that are not given.
PlanDefaults DefaultsOf(const proto::Json& info);

/// --from, else where the lens' configuration says that distances start.
std::optional<From> OriginOf(const Session& session, const proto::Json& info);

/// The tolerances its motors keep, where the lens states them.
void AddTolerances(const proto::Json& info, optics::PlanRequest& request);

}  // namespace lensd::cli
