// Plans by the daemon, for the lens it drives.
#pragma once

#include <string>

#include "cli/session.h"
#include "proto/json.h"

namespace lensd::cli {

/// The interface's Plan: `request` holds what the user said and leaves out what the lens knows. Returns
/// `{plan, applied}`, `applied` only where asked for and feasible. Control-C stops what it moves.
std::expected<proto::Json, Failure> PlanOnline(Session& session, const std::string& lens, proto::Json request,
                                               bool apply);

/// What the daemon knows of the lens (LensInfo): for distances that do not start at the lens centre.
std::expected<proto::Json, Failure> LensInfoOnline(Session& session, const std::string& lens);

}  // namespace lensd::cli
