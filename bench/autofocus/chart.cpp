#include "bench/autofocus/chart.h"

#include <algorithm>

#include "bench/autofocus/summary.h"
#include "io/svg.h"

namespace lensd::bench {
namespace {

constexpr double kSmallestError = 1e-4;  // of a depth of field; less is drawn there

io::Chart ErrorAgainstFrames(const std::vector<MethodRuns>& methods) {
  io::Chart chart;
  chart.title = "Error against frames spent";
  chart.subtitle = "one mark a focused run; whole depths of field, the limit is 0.5";
  chart.x = {.label = "frames", .scale = io::Scale::Log};
  chart.y = {.label = "focus error", .unit = "depths of field", .scale = io::Scale::Log};
  chart.rules.push_back({.y = 0.5, .label = "half a depth of field"});
  for (const auto& [method, runs] : methods) {
    io::ChartPoints marks{.name = method};
    marks.size = 2.0;
    for (const AutofocusRunResult& run : runs) {
      if (run.focused) {
        marks.points.push_back({.at = {static_cast<double>(run.frames), std::max(run.error_dof(), kSmallestError)}});
      }
    }
    chart.points.push_back(std::move(marks));
  }
  return chart;
}

/// One stacked bar a method: within half a depth of field, within twice that, refused, false.
io::Chart Endings(const std::vector<MethodRuns>& methods) {
  struct Part {
    const char* name;
    const char* colour;
  };
  static constexpr Part kParts[] = {{"within half a depth of field", "#2a9d5c"},
                                    {"beyond, by less than that", "#e0b030"},
                                    {"refused", "#9aa0a6"},
                                    {"false focus", "#d1495b"}};
  io::Chart chart;
  chart.title = "How the runs ended";
  chart.x = {.label = "method", .low = 0.0, .high = static_cast<double>(methods.size())};
  chart.y = {.label = "share of runs", .low = 0.0, .high = 1.0};
  chart.legend = io::LegendPlace::Below;
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const AutofocusSummary summary = Summarise(methods[i].first, methods[i].second);
    const double near = 1.0 - summary.within - summary.refused - summary.false_focus;
    const double shares[] = {summary.within, std::max(near, 0.0), summary.refused, summary.false_focus};
    chart.x.ticks.emplace_back(static_cast<double>(i) + 0.5, methods[i].first);
    double from = 0.0;
    for (std::size_t part = 0; part < std::size(kParts); ++part) {
      io::ChartBar bar{.name = i == 0 ? kParts[part].name : "", .colour = kParts[part].colour, .opacity = 0.8};
      bar.x_low = static_cast<double>(i) + 0.15;
      bar.x_high = static_cast<double>(i) + 0.85;
      bar.y_low = from;
      bar.y_high = from += shares[part];
      chart.bars.push_back(std::move(bar));
    }
  }
  return chart;
}

}  // namespace

std::string AutofocusChart(const std::string& scene, const std::vector<MethodRuns>& methods) {
  std::vector<io::Chart> charts = {ErrorAgainstFrames(methods), Endings(methods)};
  charts.front().title += ": " + scene;
  return io::ChartsSvg(charts, 1);
}

}  // namespace lensd::bench
