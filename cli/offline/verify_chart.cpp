#include "cli/offline/verify_chart.h"

#include <algorithm>
#include <utility>

#include "base/quantity_text.h"

namespace lensd::cli {
namespace {

constexpr const char* kLimitColour = "#b22222";

/// Where the blur must not be; it ends with the farthest slice, since a limit may reach to infinity.
io::ChartBar ForbiddenArea(const verify::BlurLimit& limit, double farthest_m) {
  const bool sharp = limit.kind == verify::BlurLimit::Kind::Sharp;
  io::ChartBar bar{.x_low = limit.near_m,
                   .x_high = std::min(limit.far_m, farthest_m),
                   .colour = kLimitColour,
                   .label = (sharp ? "at most " : "at least ") + Short(limit.limit_px) + " px",
                   .hatched = true};
  (sharp ? bar.y_low : bar.y_high) = limit.limit_px;
  return bar;
}

}  // namespace

io::Chart VerifyChart(const VerifyPlot& plot) {
  io::Chart chart;
  chart.title = plot.planned.empty() ? "Blur against distance, measured from the frames"
                                     : "Blur against distance: planned, and measured from the frames";
  chart.subtitle =
      "measured by blurring a small-aperture frame until it looks like the picture; bars: 95 % where one depth fills a "
      "slice";
  chart.x = {.label = "distance from the lens centre", .unit = "m"};
  chart.y = {.label = "blur diameter", .unit = "px", .low = 0.0};
  if (!plot.planned.empty()) chart.lines.push_back({.name = "planned (thin lens)", .points = plot.planned});
  io::ChartPoints points{.name = "measured", .colour = io::PaletteColour(1)};
  io::ChartPoints limits{.name = "measured: at most", .colour = io::PaletteColour(1), .marker = io::Marker::Ring};
  double farthest_m = 0.0;
  for (const verify::SliceBlur& slice : plot.slices) {
    if (slice.pixels < verify::kFewestPixels || slice.open) continue;
    farthest_m = std::max(farthest_m, slice.far_m);
    const double shown = slice.at_most() ? slice.high_px : slice.diameter_px;
    (slice.at_most() ? limits : points).points.push_back({{slice.mean_m, shown}, ""});
    chart.intervals.push_back({{slice.mean_m, shown}, slice.low_px, slice.high_px, io::PaletteColour(1)});
  }
  for (auto* shown : {&points, &limits}) {
    if (!shown->points.empty()) chart.points.push_back(std::move(*shown));
  }
  for (const verify::Verdict& verdict : plot.verdicts) {
    if (verdict.limit.near_m < farthest_m) chart.bars.push_back(ForbiddenArea(verdict.limit, farthest_m));
  }
  return chart;
}

}  // namespace lensd::cli
