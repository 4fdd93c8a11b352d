// The charts of autofocus runs: frames and time against error, success against start, refused against false.
#include "bench/autofocus/chart.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "bench/autofocus/summary.h"
#include "io/svg.h"

namespace lensd::bench {
namespace {

constexpr double kSmallestPx = 1e-3;  // of blur; less is drawn there
constexpr std::size_t kColours = 8;   // of the palette: lines beyond are dashed

/// All runs of one method, whatever the scene.
std::vector<AutofocusRunResult> AllRuns(const std::vector<SceneRuns>& scenes, std::size_t method) {
  std::vector<AutofocusRunResult> all;
  for (const SceneRuns& scene : scenes) {
    const auto& runs = scene.methods[method].second;
    all.insert(all.end(), runs.begin(), runs.end());
  }
  return all;
}

double Within(const std::vector<AutofocusRunResult>& runs) {
  return static_cast<double>(std::ranges::count_if(runs, &AutofocusRunResult::within)) /
         std::max(1.0, static_cast<double>(runs.size()));
}

/// The floors of all focused runs, root mean square, px of blur: the light's and the motor's.
std::pair<double, double> Floors(const std::vector<SceneRuns>& scenes, std::size_t method) {
  double light2 = 0.0, motor2 = 0.0;
  int counted = 0;
  for (const SceneRuns& scene : scenes) {
    if (!scene.floor) continue;
    for (const AutofocusRunResult& run : scene.methods[method].second) {
      const double bound = scene.floor->BoundPx(run.blurs_px);
      if (!run.within() || !std::isfinite(bound)) continue;
      light2 += bound * bound;
      motor2 += scene.floor->quantisation_px() * scene.floor->quantisation_px();
      ++counted;
    }
  }
  return {std::sqrt(light2 / std::max(counted, 1)), std::sqrt(motor2 / std::max(counted, 1))};
}

/// One mark a method, at the median of cost and blur left, with a bar to the 95th percentile; refused runs have no
/// error and show as the share in the label.
template <class Cost>
io::Chart ErrorAgainst(const std::vector<SceneRuns>& scenes, const char* what, const char* unit, const Cost& cost) {
  io::Chart chart;
  chart.title = std::string("Blur left against ") + what;
  chart.subtitle =
      "median of the focused runs, bars to the 95th percentile; in brackets the share within half a depth of "
      "field";
  chart.x = {.label = what, .unit = unit, .scale = io::Scale::Log};
  chart.y = {.label = "blur left", .unit = "px", .scale = io::Scale::Log, .low = 3e-3};
  chart.legend = io::LegendPlace::None;
  std::vector<io::ChartPoint> marks;
  for (std::size_t m = 0; m < scenes.front().methods.size(); ++m) {
    std::vector<double> costs, errors;
    const auto runs = AllRuns(scenes, m);
    for (const AutofocusRunResult& run : runs) {
      costs.push_back(cost(run));
      if (run.focused) errors.push_back(std::max(run.error_px(), kSmallestPx));
    }
    if (errors.empty()) continue;
    const io::ChartPoint at{Percentile(costs, 0.5), Percentile(errors, 0.5)};
    marks.push_back(at);
    char share[32];
    std::snprintf(share, sizeof share, " (%.1f %%)", 100 * Within(runs));
    chart.points.push_back({.points = {{at, scenes.front().methods[m].first + share}}, .colour = io::PaletteColour(m)});
    chart.intervals.push_back(
        {.at = at, .low = at.y, .high = Percentile(errors, 0.95), .colour = io::PaletteColour(m)});
  }
  std::ranges::sort(marks, [](const auto& a, const auto& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  io::ChartLine front{.name = "nothing is both cheaper and sharper", .colour = "#999999", .dashed = true};
  for (const io::ChartPoint& mark : marks) {
    if (front.points.empty() || mark.y < front.points.back().y) front.points.push_back(mark);
  }
  front.label = "Pareto front";
  chart.lines.push_back(std::move(front));
  chart.rules.push_back({.y = 2.0, .label = "half a depth of field"});
  const auto [light, motor] = Floors(scenes, 0);
  if (light > 0)
    chart.rules.push_back({.y = light, .label = "Cramér-Rao for the frames of " + scenes[0].methods[0].first});
  if (motor > 0) chart.rules.push_back({.y = motor, .label = "one step of the motor"});
  return chart;
}

io::Chart SuccessAgainstStart(const std::vector<SceneRuns>& scenes) {
  constexpr double kBin = 24.0;  // px
  io::Chart chart;
  chart.title = "Success against where the run began";
  chart.subtitle =
      "share of runs within half a depth of field, by the blur of the first frame, in bins of 24 px; equal lines hide "
      "each other";
  chart.x = {.label = "blur of the first frame", .unit = "px", .low = 0.0};
  chart.y = {.label = "share of runs", .low = 0.0, .high = 1.0};
  for (std::size_t m = 0; m < scenes.front().methods.size(); ++m) {
    std::vector<std::pair<int, int>> bins;  // within, all
    for (const AutofocusRunResult& run : AllRuns(scenes, m)) {
      if (run.blurs_px.empty()) continue;
      const auto bin = static_cast<std::size_t>(std::abs(run.blurs_px.front()) / kBin);
      if (bin >= bins.size()) bins.resize(bin + 1);
      bins[bin].first += run.within() ? 1 : 0;
      ++bins[bin].second;
    }
    io::ChartLine line{.name = scenes.front().methods[m].first, .dashed = m >= kColours, .markers = true};
    for (std::size_t i = 0; i < bins.size(); ++i) {
      if (bins[i].second < 3) continue;
      line.points.push_back({(static_cast<double>(i) + 0.5) * kBin,
                             static_cast<double>(bins[i].first) / static_cast<double>(bins[i].second)});
    }
    chart.lines.push_back(std::move(line));
  }
  return chart;
}

/// One mark a scene and method.
template <class Coordinate>
io::Chart SuccessAgainst(const std::vector<SceneRuns>& scenes, const char* what, const Coordinate& coordinate) {
  io::Chart chart;
  chart.title = std::string("Success against ") + what;
  chart.subtitle = "one mark a scene with one subject; equal lines hide each other";
  chart.x = {.label = what, .scale = io::Scale::Log};
  chart.y = {.label = "share within half a depth of field", .low = 0.0, .high = 1.0};
  for (std::size_t m = 0; m < scenes.front().methods.size(); ++m) {
    io::ChartLine line{.name = scenes.front().methods[m].first, .dashed = m >= kColours, .markers = true};
    for (const SceneRuns& scene : scenes) {
      if (scene.floor) line.points.push_back({coordinate(*scene.floor), Within(scene.methods[m].second)});
    }
    std::ranges::sort(line.points, {}, &io::ChartPoint::x);
    chart.lines.push_back(std::move(line));
  }
  return chart;
}

io::Chart RefusedAgainstFalse(const std::vector<SceneRuns>& scenes) {
  io::Chart chart;
  chart.title = "Refusals against false focus";
  chart.subtitle = "of all runs; false: focused, and more than a whole depth of field off";
  // Methods that end alike share a mark.
  std::map<std::pair<double, double>, std::vector<std::size_t>> places;
  double most = 5.0;
  for (std::size_t m = 0; m < scenes.front().methods.size(); ++m) {
    const AutofocusSummary summary = Summarise("", AllRuns(scenes, m));
    places[{100 * summary.refused, 100 * summary.false_focus}].push_back(m);
    most = std::max({most, 105 * summary.refused, 105 * summary.false_focus});
  }
  chart.x = {.label = "refused", .unit = "%", .low = 0.0, .high = most};
  chart.y = {.label = "false focus", .unit = "%", .low = 0.0, .high = most};
  chart.legend = io::LegendPlace::None;
  for (const auto& [at, methods] : places) {
    constexpr std::size_t kNamed = 3;
    std::string label;
    for (std::size_t i = 0; i < std::min(methods.size(), kNamed); ++i) {
      label += (i > 0 ? ", " : "") + scenes.front().methods[methods[i]].first;
    }
    if (methods.size() > kNamed) label += " and " + std::to_string(methods.size() - kNamed) + " more";
    chart.points.push_back({.points = {{{at.first, at.second}, label}}, .colour = io::PaletteColour(methods.front())});
  }
  return chart;
}

/// One stacked bar a method: within half a depth of field, within twice that, refused, false.
io::Chart Endings(const std::vector<SceneRuns>& scenes) {
  struct Part {
    const char* name;
    const char* colour;
  };
  static constexpr Part kParts[] = {{"within half a depth of field", "#2a9d5c"},
                                    {"beyond, by less than that", "#e0b030"},
                                    {"refused", "#9aa0a6"},
                                    {"false focus", "#d1495b"}};
  const auto& methods = scenes.front().methods;
  io::Chart chart;
  chart.title = "How the runs ended";
  const double count = static_cast<double>(methods.size());
  chart.x = {.label = "share of runs", .low = 0.0, .high = 1.0};
  chart.y = {.low = 0.0, .high = count};
  chart.legend = io::LegendPlace::Below;
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const AutofocusSummary summary = Summarise(methods[i].first, AllRuns(scenes, i));
    const double near = 1.0 - summary.within - summary.refused - summary.false_focus;
    const double shares[] = {summary.within, std::max(near, 0.0), summary.refused, summary.false_focus};
    const double below = count - static_cast<double>(i) - 1.0;
    chart.y.ticks.emplace_back(below + 0.5, methods[i].first);
    double from = 0.0;
    for (std::size_t part = 0; part < std::size(kParts); ++part) {
      const bool named = i == 0;
      if (shares[part] < 1e-9 && !named) continue;
      io::ChartBar bar{.name = named ? kParts[part].name : "", .colour = kParts[part].colour, .opacity = 0.8};
      bar.x_low = from;
      bar.x_high = from += shares[part];
      bar.y_low = below + 0.15;
      bar.y_high = below + 0.85;
      chart.bars.push_back(std::move(bar));
    }
  }
  return chart;
}

}  // namespace

std::string AutofocusChart(const std::vector<SceneRuns>& scenes) {
  const auto frames = [](const AutofocusRunResult& run) { return static_cast<double>(run.frames); };
  const auto time = [](const AutofocusRunResult& run) {
    return std::chrono::duration<double, std::milli>(run.elapsed).count();
  };
  std::vector<io::Chart> charts = {ErrorAgainst(scenes, "frames", "", frames),
                                   ErrorAgainst(scenes, "simulated time", "ms", time), SuccessAgainstStart(scenes),
                                   RefusedAgainstFalse(scenes), Endings(scenes)};
  const auto known = std::ranges::count_if(scenes, [](const SceneRuns& scene) { return scene.floor.has_value(); });
  if (known > 1) {
    charts.push_back(SuccessAgainst(scenes, "signal to noise of one px",
                                    [](const FocusFloor& floor) { return floor.signal_to_noise(); }));
    charts.push_back(
        SuccessAgainst(scenes, "contrast of the texture", [](const FocusFloor& floor) { return floor.contrast(); }));
  }
  const std::string of = scenes.size() == 1 ? scenes.front().name : std::to_string(scenes.size()) + " scenes";
  charts.front().title += ": " + of;
  return io::ChartsSvg(charts, 2);
}

}  // namespace lensd::bench
