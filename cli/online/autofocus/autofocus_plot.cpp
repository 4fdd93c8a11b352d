// Frames in the order of position make the curve; their numbers tell the order in which they were taken.
#include "cli/online/autofocus/autofocus_plot.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr const char* kAnswerColour = "#111111";

bool Calibrated(const Json& result) {
  const Json& samples = result["samples"];
  return !samples.empty() &&
         std::ranges::all_of(samples, [](const Json& sample) { return sample["vergenceD"].is_number(); });
}

/// Along the foot of the curve points stand side by side, and their numbers would run into each other.
struct Crowd {
  double width = 0.0, height = 0.0;  ///< of a number, in the units of the axes

  bool Hides(const io::ChartPoint& at, const io::ChartPoints& some, const io::ChartPoints& others) const {
    const auto near = [&](const io::ChartPoints::Labelled& other) {
      return !other.label.empty() && at.y < height && other.at.y < height && std::abs(other.at.x - at.x) < width;
    };
    return std::ranges::any_of(some.points, near) || std::ranges::any_of(others.points, near);
  }
};

Crowd CrowdOf(const Json& result, const char* where) {
  constexpr double kNumberOfWidth = 0.03, kNumberOfHeight = 0.05;
  double low = 0.0, high = 0.0, most = 0.0;
  bool first = true;
  for (const Json& sample : result["samples"]) {
    const double at = sample[where].get<double>();
    low = first ? at : std::min(low, at);
    high = first ? at : std::max(high, at);
    most = std::max(most, sample["score"].get<double>());
    first = false;
  }
  return {kNumberOfWidth * (high - low), kNumberOfHeight * most};
}

/// One region's frames: the curve through those of a lens at rest, rings for the others.
void AddRegion(const Json& result, int region, int regions, const char* where, io::Chart& chart) {
  constexpr std::size_t kMostNumbered = 40;  // more would cover the curve
  const std::string colour = io::PaletteColour(static_cast<std::size_t>(region));
  const std::string name = regions > 1 ? "region " + std::to_string(region + 1) : "";
  io::ChartLine curve{.name = name, .colour = colour, .width = 1.0};
  io::ChartPoints standing{.colour = colour}, others{.colour = colour, .marker = io::Marker::Ring};
  const bool numbered = result["samples"].size() <= kMostNumbered;
  const Crowd crowd = CrowdOf(result, where);
  for (const Json& sample : result["samples"]) {
    if (sample["region"] != region) continue;
    const io::ChartPoint at{sample[where].get<double>(), sample["score"].get<double>()};
    const double sigma = sample["scoreSigma"].get<double>();
    chart.intervals.push_back({.at = at, .low = at.y - sigma, .high = at.y + sigma, .colour = colour});
    const bool stood = sample["state"] == "standing";
    if (stood) curve.points.push_back(at);
    const bool room = numbered && !crowd.Hides(at, standing, others);
    (stood ? standing : others).points.push_back({at, room ? std::to_string(sample["frame"].get<int>()) : ""});
  }
  std::ranges::sort(curve.points, {}, &io::ChartPoint::x);
  chart.lines.push_back(std::move(curve));
  for (io::ChartPoints* points : {&standing, &others}) {
    if (!points->points.empty()) chart.points.push_back(std::move(*points));
  }
}

void AddAnswer(const Json& subject, const std::string& where, io::Chart& chart) {
  const bool vergence = where == "vergenceD";
  const double at = subject[where].get<double>();
  std::string label = "focus: " + NumberText(subject, where.c_str(), 6, vergence ? " D" : "");
  if (vergence && subject["sigmaD"].is_number()) {
    const double sigma = subject["sigmaD"].get<double>();
    label += ", sigma " + NumberText(subject, "sigmaD", 2, " D");
    chart.bars.push_back({.x_low = at - 2.0 * sigma, .x_high = at + 2.0 * sigma, .colour = kAnswerColour});
  }
  chart.rules.push_back({.x = at, .label = label, .colour = kAnswerColour});
}

}  // namespace

io::Chart AutofocusChart(const Json& result) {
  const bool calibrated = Calibrated(result);
  const char* where = calibrated ? "vergenceD" : "position";
  io::Chart chart;
  chart.title = TextOf(result, "lens") + (result.value("focused", false) ? ": focused by " : ": not focused by ") +
                TextOf(result, "method") + " in " + NumberText(result, "frames", 6, " frames");
  const std::string reason = TextOf(result, "reason");
  chart.subtitle = reason.substr(0, reason.find(';'));
  chart.x =
      calibrated ? io::Axis{.label = "vergence in focus", .unit = "D"} : io::Axis{.label = "native focus position"};
  chart.y = {.label = "sharpness", .low = 0.0};
  chart.legend = io::LegendPlace::Below;
  int regions = 1;
  for (const Json& sample : result["samples"]) regions = std::max(regions, sample["region"].get<int>() + 1);
  for (int region = 0; region < regions; ++region) AddRegion(result, region, regions, where, chart);
  const Json& subject = result["subject"];
  if (subject.is_object() && subject[where].is_number()) AddAnswer(subject, where, chart);
  return chart;
}

}  // namespace lensd::cli
