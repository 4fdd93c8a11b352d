// A plan's choice of the focal length: given, free within a range, or by what it shall frame.
#pragma once

#include <stop_token>

#include "base/result.h"
#include "planning/planning.h"
#include "proto/plan_json.h"
#include "rig/rig.h"

namespace lensd::daemon {

/// A lens with its zoom where the request wants it, and the request with the ranges that are the lens' own there.
struct ZoomedPlanning {
  Planning planning;
  optics::PlanRequest request;
};

/// Of a request with focal lengths or a field: of a range the best for its limits is chosen, of equals the one nearest
/// to where the zoom stands. OutOfRange: the lens does not zoom there. On any thread; its time is bounded whatever the
/// number of limits and positions, but may be seconds. Cancelled: `stop` was requested.
Result<ZoomedPlanning> PlanningForZoom(const PlannedLens& lens, const rig::RigConfig& config,
                                       const proto::LensRequest& asked, const rig::Status& now,
                                       const std::stop_token& stop);

/// The lens focused at an extension, without a bound.
optics::FocusPosition StandsAt(const rig::OpticsTable& optics, Metres extension);

/// Where the distances of a request start.
optics::DistanceOrigin OriginOf(const optics::FocusScale& scale, const proto::LensRequest& asked);

}  // namespace lensd::daemon
