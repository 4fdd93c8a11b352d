// Regions are coloured by how far from the common focus they are in focus: one colour for nearer, one for farther,
// fuller the farther off. Rows count downward, as in the picture.
#include "cli/online/autofocus/focus_map_plot.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "cli/online/autofocus/focus_map_text.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

const char* const kInk = "#222222";
const char* const kGrey = "#6b6b6b";

std::string CellLabel(const Json& cell) {
  const Json& at = cell["extensionUm"];
  if (!at.is_number()) return TextOf(cell, "cause");
  return OffsetText(at.get<double>());
}

std::vector<std::pair<double, std::string>> Numbers(int count, double first, double step) {
  std::vector<std::pair<double, std::string>> ticks;
  for (int i = 0; i < count; ++i) ticks.push_back({first + i * step, std::to_string(i + 1)});
  return ticks;
}

/// The rise, and at which edge best focus lies farther out.
std::string TiltLine(const Json& tilt, const char* low, const char* high) {
  const double rise = tilt["riseUm"].get<double>();
  const bool clear = std::abs(rise) >= kClearSigmas * tilt["sigmaUm"].get<double>();
  return RiseText(tilt) + (clear ? std::string(" farther out at the ") + (rise > 0.0 ? high : low) + " edge" : "");
}

void AddCells(const Json& map, io::Chart& chart) {
  constexpr double kFaintest = 0.06, kFullest = 0.7;
  constexpr double kHalfLabel = 0.025;  // of the frame's width
  double most = 0.0;
  // A target as good as square stays pale: full colour starts at one pixel of blur.
  const Json& surface = map["surface"];
  if (surface.is_object() && surface["leftPx"].is_number() && surface["leftPx"].get<double>() > 0.0) {
    most = surface["leftUm"].get<double>() / surface["leftPx"].get<double>();
  }
  for (const Json& cell : map["cells"]) {
    if (cell["extensionUm"].is_number() && !cell["outlier"].get<bool>()) {
      most = std::max(most, std::abs(cell["extensionUm"].get<double>()));
    }
  }
  for (const Json& cell : map["cells"]) {
    const Json& region = cell["region"];
    const double x = region["x"].get<double>(), y = region["y"].get<double>();
    io::ChartBar bar{.x_low = x,
                     .x_high = x + region["w"].get<double>(),
                     .y_low = 1.0 - y - region["h"].get<double>(),
                     .y_high = 1.0 - y,
                     .colour = kGrey};
    bar.hatched = !cell["extensionUm"].is_number() || cell["outlier"].get<bool>();
    if (!bar.hatched) {
      const double at = cell["extensionUm"].get<double>();
      bar.colour = io::PaletteColour(at > 0.0 ? 1 : 0);
      bar.opacity = kFaintest + (kFullest - kFaintest) * (most > 0.0 ? std::abs(at) / most : 0.0);
    }
    chart.bars.push_back(std::move(bar));
    chart.notes.push_back({.at = {cell["x"].get<double>() - kHalfLabel, 1.0 - cell["y"].get<double>()},
                           .text = CellLabel(cell),
                           .colour = kInk});
  }
}

}  // namespace

io::Chart FocusMapChart(const Json& map) {
  const int columns = map["columns"].get<int>(), rows = map["rows"].get<int>();
  io::Chart chart;
  chart.title = TextOf(map, "lens") + (map["mapped"].get<bool>() ? ": best focus over the frame" : ": no focus map");
  chart.subtitle =
      map["mapped"].get<bool>()
          ? "um of extension from where the frame as a whole is least out of focus; + is farther out, focused nearer"
          : TextOf(map, "reason").substr(0, TextOf(map, "reason").find(';'));
  chart.x = {.label = "column, as in the picture",
             .low = 0.0,
             .high = 1.0,
             .ticks = Numbers(columns, 0.5 / columns, 1.0 / columns)};
  chart.y = {.label = "row", .low = 0.0, .high = 1.0, .ticks = Numbers(rows, 1.0 - 0.5 / rows, -1.0 / rows)};
  chart.legend = io::LegendPlace::None;
  AddCells(map, chart);
  const Json& surface = map["surface"];
  if (!surface.is_object()) return chart;
  chart.captions = {"Tilt across: " + TiltLine(surface["across"], "left", "right") +
                        ". Tilt down: " + TiltLine(surface["down"], "upper", "lower") + ".",
                    "Curvature: " + CurvatureText(surface) + ". Hatched: left out."};
  return chart;
}

}  // namespace lensd::cli
