// The command `render`: cost and error of the renderers and their peers over diameters and scenes.
#include "bench/render/render.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>

#include "bench/command.h"
#include "bench/outputs.h"
#include "bench/render/cases.h"
#include "bench/render/peers.h"
#include "io/svg.h"

namespace lensd::bench {
namespace {

using nlohmann::ordered_json;

constexpr double kLeastError = 1e-5;  // levels; less is drawn there

ordered_json JsonOf(const RenderRow& row) {
  const auto number = [](const auto& value) { return value ? ordered_json(*value) : ordered_json(); };
  return {{"family", row.family},
          {"scene", row.scene},
          {"renderer", row.renderer},
          {"peer", row.peer},
          {"diameterPx", number(row.diameter_px)},
          {"rays", number(row.rays)},
          {"elapsedMs", row.elapsed_ms},
          {"interiorErrorLevels", number(row.interior_error)},
          {"boundaryErrorLevels", number(row.boundary_error)},
          {"errorLevelsP99", number(row.p99_error)},
          {"boundLevels", number(row.error_bound)}};
}

io::Chart CostAgainstDiameter(const std::vector<RenderRow>& rows) {
  io::Chart chart;
  chart.title = "Cost of one disk";
  chart.width = 620;
  chart.height = 360;
  chart.subtitle = "one thread, whole frame; dashed: peers";
  chart.x = {.label = "disk diameter",
             .unit = "px",
             .scale = io::Scale::Log,
             .ticks = {{1, "1"}, {3, "3"}, {5, "5"}, {15, "15"}, {41, "41"}, {101, "101"}}};
  chart.y = {.label = "CPU time", .unit = "ms", .scale = io::Scale::Log};
  std::vector<std::string> order;
  std::map<std::string, io::ChartLine> lines;
  for (const RenderRow& row : rows) {
    if (row.family != "one disk") continue;
    if (!lines.contains(row.renderer)) order.push_back(row.renderer);
    io::ChartLine& line = lines[row.renderer];
    line.name = row.renderer;
    line.dashed = row.peer;
    line.markers = true;
    line.points.push_back({*row.diameter_px, row.elapsed_ms});
  }
  for (const std::string& name : order) chart.lines.push_back(lines[name]);
  return chart;
}

io::Chart ErrorAgainstTime(const std::vector<RenderRow>& rows, const std::string& scene, bool boundary) {
  io::Chart chart;
  chart.title = scene + (boundary ? ": near edges" : ": elsewhere");
  chart.subtitle = "error that one pixel in a thousand exceeds; with the number of rays a pixel";
  chart.x = {.label = "CPU time", .unit = "ms", .scale = io::Scale::Log};
  chart.y = {.label = "error", .unit = "1/255", .scale = io::Scale::Log};
  chart.rules.push_back({.y = 0.5, .label = "half a level"});
  chart.legend = io::LegendPlace::None;
  chart.width = 620;
  chart.height = 360;
  for (const RenderRow& row : rows) {
    const std::optional<double> error = boundary ? row.boundary_error : row.interior_error;
    if (row.scene != scene || !error) continue;
    io::ChartPoints mark;
    std::string label = row.renderer + (row.rays ? " " + std::to_string(*row.rays) : "");
    mark.points.push_back({.at = {row.elapsed_ms, std::max(*error, kLeastError)}, .label = std::move(label)});
    mark.colour = io::PaletteColour(row.renderer.starts_with("auto") ? 1 : row.rays ? 2 : 0);
    chart.points.push_back(std::move(mark));
  }
  return chart;
}

std::string ChartOf(const std::vector<RenderRow>& rows) {
  std::vector<io::Chart> charts;
  std::vector<std::string> scenes;
  for (const RenderRow& row : rows) {
    if (!row.scene.empty() && std::find(scenes.begin(), scenes.end(), row.scene) == scenes.end())
      scenes.push_back(row.scene);
  }
  for (const std::string& scene : scenes) {
    for (const bool boundary : {false, true}) {
      io::Chart chart = ErrorAgainstTime(rows, scene, boundary);
      if (!chart.points.empty()) charts.push_back(std::move(chart));
    }
  }
  io::Chart cost = CostAgainstDiameter(rows);
  if (!cost.lines.empty()) charts.insert(charts.begin(), std::move(cost));
  return io::ChartsSvg(charts, 2);
}

}  // namespace

int RunRender(int argc, char** argv) {
  Outputs outputs;
  RenderBenchOptions options;
  std::string only, scene;
  CLI::App app("Time against error for every renderer and peer, and cost against disk diameter.", argv[0]);
  app.add_option("--csv", outputs.csv, "write every figure to this file");
  app.add_option("--svg", outputs.svg, "write the charts to this file");
  app.add_flag("--json", outputs.as_json, "one line of JSON instead of the table");
  app.add_option("--width", options.width, "px of the frame the disks are timed on")
      ->check(CLI::Range(64, 8192))
      ->capture_default_str();
  app.add_option("--height", options.height, "px")->check(CLI::Range(64, 8192))->capture_default_str();
  app.add_option("--repeats", options.repeats, "runs of each; the median counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--only", only, "disks, varying or scenes")->check(CLI::IsMember({"disks", "varying", "scenes"}));
  app.add_option("--scene", scene, "only this scene file, at its own size, in focus far, halfway and near");
  return ParseThen(app, argc, argv, [&] {
    std::vector<RenderRow> rows;
    const auto add = [&](std::vector<RenderRow> more) { rows.insert(rows.end(), more.begin(), more.end()); };
    if (!scene.empty()) only = "scenes";
    if (only.empty() || only == "disks") add(OneDiskRows(options));
    if (only.empty() || only == "varying") add(VaryingDiskRows(options));
    if (only.empty() || only == "scenes") {
      auto scenes = SceneRows(scene);
      if (!scenes) {
        std::cerr << "lens-bench render: " << scenes.error().message << "\n";
        return scenes.error().code == Code::Io ? EX_IOERR : EX_DATAERR;
      }
      add(*std::move(scenes));
    }
    std::vector<ordered_json> json;
    for (const RenderRow& row : rows) json.push_back(JsonOf(row));
    return WriteOutputs(argv[0], json, MissingPeers(), outputs, [&] { return ChartOf(rows); });
  });
}

}  // namespace lensd::bench
