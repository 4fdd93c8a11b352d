// Whether a lens can do what a plan asks for at all.
#pragma once

#include "base/result.h"
#include "optics/lens_positions.h"
#include "optics/plan_request.h"

namespace lensd::daemon {

/// Whether the focal length may still change: then diameters do not tell f-numbers yet.
enum class Zoomed { No, Yes };

/// OutOfRange, with what there is: apertures or extensions are asked for of which the lens has none. What is left out
/// of a request is the lens' own, so what lies outside was asked for.
Result<void> CheckReach(const optics::PlanRequest& asked, const optics::LensPositions& lens, Zoomed zoomed);

}  // namespace lensd::daemon
