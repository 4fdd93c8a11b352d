// The lens is taken from the plane in focus and the sensor, so that one whose power changes needs no case of its own.
#include "cli/plan/rays.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "cli/charts/chart_file.h"
#include "io/svg.h"

namespace lensd::cli {

std::optional<RaySystem> PlanRays(const optics::PlanRequest& request, const optics::PlanAnswer& answer,
                                  const std::string& lens, Metres principal_gap) {
  constexpr std::size_t kMost = 3;
  if (!answer.feasible && !(answer.relax && answer.f_number.value > 0.0)) return std::nullopt;
  const double at_rest = request.focal_length.value;
  const double sensor = at_rest + (request.liquid ? 0.0 : answer.extension.value);
  RaySystem system{.title = lens + (answer.feasible ? ": the way of the light at the plan"
                                                    : ": the way of the light at the plan that relaxed limits allow"),
                   .focal_length = Metres{1.0 / (answer.focal_plane.value + 1.0 / sensor)},
                   .diameter = Metres{at_rest / answer.f_number.value},
                   .sensor_distance = Metres{sensor},
                   .principal_gap = principal_gap,
                   .points = {}};
  std::vector<const optics::LimitAnswer*> limits;
  for (const optics::LimitAnswer& limit : answer.limits) limits.push_back(&limit);
  std::ranges::sort(limits,
                    [](const auto* a, const auto* b) { return a->ratio != b->ratio ? a->ratio > b->ratio : a < b; });
  limits.resize(std::min(limits.size(), kMost));
  for (const optics::LimitAnswer* limit : limits) {
    system.points.push_back({.name = request.limits.at(static_cast<std::size_t>(limit - answer.limits.data())).name,
                             .vergence = limit->at,
                             .blur = limit->worst});
  }
  const bool real_focus = answer.focal_plane.value >= 0.0;
  if (system.points.empty() && real_focus)
    system.points.push_back({.name = "in focus", .vergence = answer.focal_plane});
  return system;
}

std::expected<void, Failure> CheckPlanPlots(const PlanText& text) {
  if (text.stack && text.rays.wanted()) {
    return Refuse(Exit::Usage,
                  "--rays draws one setting of the lens, a stack has several; leave out --stack or --rays");
  }
  return CheckPlots(text.plot, text.rays);
}

std::expected<void, Failure> WriteRays(const PlanText& text, const std::optional<RaySystem>& rays) {
  if (!rays) return {};
  return WritePlot(RaysInTheme(text.plot, text.rays), io::ChartSvg(RayDiagram(*rays)));
}

}  // namespace lensd::cli
