// A plan as a picture: which settings meet every limit, and the blur that the chosen one makes.
#pragma once

#include <string>

#include "optics/planner.h"

namespace lensd::cli {

/// Two charts as one SVG document. Above: the f-numbers and sensor distances that meet every limit, each limit's bounds
/// as lines, the plan as a point. Below: blur against vergence at the plan, limits as hatched bars that the curve must
/// not enter. Without a plan the upper one shows what each limit allows by itself, and both show the plan that relaxed
/// limits would allow and the limits it breaks. `lens` names the lens in the titles.
std::string PlanPlot(const optics::PlanRequest& request, const optics::PlanAnswer& answer, const std::string& lens);

}  // namespace lensd::cli
