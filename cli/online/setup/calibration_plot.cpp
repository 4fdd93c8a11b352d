// A calibration is read as the file that it is: the interface hands over nothing else of its points.
#include "cli/online/setup/calibration_plot.h"

#include <string>
#include <utility>
#include <vector>

#include "base/quantity_text.h"
#include "cli/text/texts.h"
#include "io/toml.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr const char* kExtension = "extension_mm";
constexpr const char* kVergence = "vergence_d";

struct FocusCurve {
  std::string name;
  double error_um = 0.0;
  std::vector<io::ChartPoint> extension, vergence;
};

std::optional<double> NumberAt(const Settings& table, std::string_view key) {
  const auto* entries = table.AsTable();
  const auto found = entries->find(key);
  return found == entries->end() ? std::nullopt : found->second.AsNumber();
}

FocusCurve CurveOf(const Settings& table) {
  SettingsReader read(table, "[[focus]]");
  FocusCurve curve;
  curve.name = "moving toward " + read.Text("approach", "near");
  for (const auto& [key, unit] : {std::pair("focal_length_mm", " mm"), std::pair("temperature_c", " C")}) {
    if (const auto value = NumberAt(table, key)) curve.name += ", " + Short(*value, 4) + unit;
  }
  curve.error_um = NumberAt(table, "error_um").value_or(0.0);
  for (const Settings* point : read.Tables("points")) {
    const auto position = NumberAt(*point, "steps");
    if (!position) continue;
    if (const auto mm = NumberAt(*point, kExtension)) curve.extension.push_back({*position, *mm});
    const auto dioptres = NumberAt(*point, kVergence);
    if (dioptres) curve.vergence.push_back({*position, *dioptres});
    if (dioptres == 0.0) curve.extension.push_back({*position, 0.0});  // infinity is in focus a focal length away
  }
  return curve;
}

std::vector<FocusCurve> CurvesIn(const Json& info) {
  std::vector<FocusCurve> curves;
  const auto file = io::ParseToml(TextOf(info, "toml"), "the calibration");
  if (!file) return curves;
  SettingsReader read(*file, "the calibration");
  for (const Settings* table : read.Tables("focus")) curves.push_back(CurveOf(*table));
  return curves;
}

}  // namespace

std::expected<io::Chart, Failure> CalibrationChart(const Json& info) {
  const std::vector<FocusCurve> curves = CurvesIn(info);
  std::size_t extensions = 0, vergences = 0;
  for (const FocusCurve& curve : curves) {
    extensions += curve.extension.size();
    vergences += curve.vergence.size();
  }
  const std::string lens = TextOf(info, "lens");
  if (extensions + vergences == 0) {
    return Refuse(Exit::No, lens + " has no measured curve of focus to draw (" + TextOf(info, "grade") +
                                "): lensctl calibrate " + lens + " --at 0.5m --at 1m --at 3m --at inf makes one");
  }
  const bool of_extension = extensions >= vergences;
  io::Chart chart;
  chart.title = lens + ": what its focus positions mean (" + TextOf(info, "grade") + ")";
  if (info["errorUm"].is_number()) chart.subtitle = "extension within " + NumberText(info, "errorUm", 3, " um");
  chart.x = {.label = "native focus position"};
  chart.y = of_extension ? io::Axis{.label = "sensor distance beyond the focal length", .unit = "mm"}
                         : io::Axis{.label = "vergence in focus", .unit = "D"};
  chart.legend = io::LegendPlace::Below;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const std::vector<io::ChartPoint>& points = of_extension ? curves[i].extension : curves[i].vergence;
    const std::string colour = io::PaletteColour(i);
    for (const io::ChartPoint& at : points) {
      const double error_mm = of_extension ? curves[i].error_um * 1e-3 : 0.0;
      if (error_mm > 0.0) {
        chart.intervals.push_back({.at = at, .low = at.y - error_mm, .high = at.y + error_mm, .colour = colour});
      }
    }
    chart.lines.push_back(
        {.name = curves.size() > 1 ? curves[i].name : "", .points = points, .colour = colour, .markers = true});
  }
  return chart;
}

io::Chart BacklashChart(const Json& result) {
  const double size = result["size"].get<double>();
  const double low = result["sizeLow"].is_number() ? result["sizeLow"].get<double>() : size;
  const double high = result["sizeHigh"].is_number() ? result["sizeHigh"].get<double>() : size;
  const double reach = 3.0 * std::max(high, 1e-9), turned = reach - size;
  io::Chart chart;
  chart.title = TextOf(result, "lens") + ": a reversal of " + TextOf(result, "axis") + " loses " + Short(size, 4) +
                " native units";
  chart.subtitle = low < high ? "between " + Short(low, 4) + " and " + Short(high, 4) + " (95 %), measured on " +
                                    NumberText(result, "frames", 6, " frames")
                              : "as stated, not measured";
  chart.x = {.label = "commanded position, native units from the turning point", .low = -1.05 * reach};
  chart.y = {.label = "position of the lens, native units"};
  chart.legend = io::LegendPlace::Below;
  const double start = -reach, end = 0.0;
  if (low < high) {
    chart.areas.push_back(
        {.name = "what the interval leaves open",
         .corners = {{end - low, end}, {start, start + low}, {start, start + high}, {end - high, end}},
         .colour = io::PaletteColour(1)});
  }
  chart.lines.push_back({.name = "outward", .points = {{start, start}, {end, end}}, .colour = io::PaletteColour(0)});
  chart.lines.push_back(
      {.name = "back", .points = {{end, end}, {end - size, end}, {start, -turned}}, .colour = io::PaletteColour(1)});
  return chart;
}

}  // namespace lensd::cli
