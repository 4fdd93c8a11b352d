// A plan as a picture: which settings meet every limit, and the blur that the chosen one makes.
#pragma once

#include <string>

#include "optics/planner.h"

namespace lensd::cli {

/// Two charts as one SVG document. Left: the f-numbers and sensor distances that meet every limit, each limit's bounds
/// as lines, the plan as a point. Right: blur against vergence at the plan, limits as hatched bars that the curve must
/// not enter. Without a plan the left shows what each limit allows by itself, and both show the plan that relaxed
/// limits would allow and the limits it breaks.
std::string PlanPlot(const optics::PlanRequest& request, const optics::PlanAnswer& answer);

}  // namespace lensd::cli
