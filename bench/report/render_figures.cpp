// Renderers: time against error on scenes, cost and error over the disk's diameter, and what `auto` chose.
#include <algorithm>
#include <cmath>

#include "bench/report/figures.h"

namespace lensd::bench {
namespace {

constexpr double kLeastLevels = 1e-5;  // of 255; less is drawn there
constexpr double kTolerance = 0.5;     // of 255: what auto may be off by

const char* const kDiameter = "disk diameter [px]";

std::vector<std::string> RenderedScenes(const Evidence& rows) {
  return Names(Selected(rows,
                        [](const EvidenceRow& row) {
                          return row.family == "render" && row.sweep.empty() && row.measure == "error" &&
                                 row.method == "auto";
                        }),
               &EvidenceRow::scene);
}

ScatterChart SceneChart(const Evidence& rows, const std::string& scene) {
  ScatterChart chart{.x = {.label = "CPU time of one frame [ms]", .log = true},
                     .y = {.label = "error that one pixel in a thousand exceeds [1/255]", .log = true},
                     .rules = {{.y = kTolerance, .label = "half a level"}}};
  for (const EvidenceRow& row : rows) {
    if (row.family != "render" || row.scene != scene || row.measure != "time" || !row.sweep.empty()) continue;
    const EvidenceRow* error = RowOf(rows, "render", scene, row.method, "error");
    if (error == nullptr) continue;
    const bool chosen = row.method == "auto";
    chart.marks.push_back({.x = row.estimate.middle,
                           .y = std::max(error->estimate.middle, kLeastLevels),
                           .x_range = row.estimate,
                           .series = chosen               ? 0
                                     : row.role == "peer" ? 1
                                                          : 2,
                           .label = chosen ? "auto: " + row.note : row.method,
                           .tip = row.method + ": " + InWords(row) + ", " + Short(error->estimate.middle) + " of 255"});
  }
  return chart;
}

void AddScene(const Evidence& rows, const std::string& scene, std::vector<Figure>& figures) {
  ScatterChart chart = SceneChart(rows, scene);
  if (chart.marks.size() < 2) return;
  const ChartLine front = FrontOf(chart.marks);
  const auto ours = std::ranges::find(chart.marks, 0, &ChartMark::series);
  // The same renderer by name takes the same time but for what a clock is off by.
  const bool first = ours == chart.marks.end() || std::ranges::none_of(chart.marks, [&](const ChartMark& mark) {
                       return mark.x < 0.8 * ours->x && mark.y <= ours->y;
                     });
  chart.lines.push_back(front);
  figures.push_back(
      {.id = "render-" + FileNameOf(scene),
       .title = "Rendering “" + scene + "”: time against error",
       .read = "Left is faster, down is truer; rays in great number are the truth, the number behind a name is that of "
               "rays a pixel.",
       .means = (ours == chart.marks.end()
                     ? std::string()
                     : "Auto took " + ours->label.substr(6) + ", off by " + Short(ours->y) + " of 255" +
                           (ours->y > kTolerance ? ": more than half a level, where the texture is as fine as the "
                                                   "pixels, which kernels lose and the bound does not vouch for. "
                                                 : ". ")) +
                (first ? "Nothing was faster and truer." : "Something else was faster and no less true."),
       .chart = std::move(chart),
       .key = {{0, "auto's choice"}, {2, "lensd's renderers by name"}}});
}

/// Every renderer's time (or error) over the diameter.
ScatterChart OverDiameter(const Evidence& rows, const std::string& measure, const std::string& label) {
  ScatterChart chart{.x = {.label = kDiameter,
                           .log = true,
                           .ticks = {{1, "1"}, {3, "3"}, {5, "5"}, {15, "15"}, {41, "41"}, {101, "101"}}},
                     .y = {.label = label, .log = true}};
  const Evidence some = Selected(rows, [&](const EvidenceRow& row) {
    return row.family == "render" && row.sweep == kDiameter && row.measure == measure;
  });
  int other = 1;
  for (const std::string& method : Names(some, &EvidenceRow::method)) {
    ChartLine line{.marks = {}, .label = method};
    for (const EvidenceRow& row : some) {
      if (row.method != method) continue;
      line.dashed = row.role != "ours";
      line.marks.push_back({.x = *row.value,
                            .y = std::max(row.estimate.middle, kLeastLevels),
                            .y_range = measure == "time" ? std::optional(row.estimate) : std::nullopt,
                            .tip = method + " at " + Short(*row.value) + " px: " + InWords(row)});
    }
    line.series = line.dashed ? other : method.ends_with("direct") ? 0 : method.ends_with("runs") ? 3 : 4;
    if (line.dashed) other = other == 1 ? 2 : 5;
    for (ChartMark& mark : line.marks) mark.series = line.series;
    chart.lines.push_back(std::move(line));
  }
  return chart;
}

/// Rays one by one, the most of them.
const EvidenceRow* HeaviestOf(const Evidence& rows, const std::string& scene) {
  const EvidenceRow* heaviest = nullptr;
  for (const EvidenceRow& row : rows) {
    if (row.family != "render" || row.scene != scene || row.measure != "time" || !row.method.starts_with("rays"))
      continue;
    if (heaviest == nullptr || row.estimate.middle > heaviest->estimate.middle) heaviest = &row;
  }
  return heaviest;
}

/// What auto chose for a scene, beside the most rays.
DotRow CostOf(const Evidence& rows, const std::string& scene, const EvidenceRow& chosen) {
  DotRow row{.name = scene,
             .marks = {{chosen.estimate, 0, "auto took " + chosen.note + ": " + InWords(chosen)}},
             .figure = chosen.note};
  if (const EvidenceRow* heaviest = HeaviestOf(rows, scene))
    row.marks.push_back({heaviest->estimate, 1, heaviest->method + ": " + InWords(*heaviest)});
  return row;
}

/// Was anything faster by a fifth and within half a level?
bool SimplerWouldDo(const Evidence& rows, const std::string& scene, const EvidenceRow& chosen) {
  return std::ranges::any_of(rows, [&](const EvidenceRow& row) {
    if (row.family != "render" || row.scene != scene || row.measure != "time" || row.method == "auto") return false;
    const EvidenceRow* error = RowOf(rows, "render", scene, row.method, "error");
    return error != nullptr && error->estimate.middle <= kTolerance &&
           row.estimate.middle < 0.8 * chosen.estimate.middle;
  });
}

}  // namespace

void AddRenderSpeed(const Evidence& rows, std::vector<Figure>& figures) {
  ScatterChart cost = OverDiameter(rows, "time", "CPU time of one 1080p frame [ms] (median)");
  if (!cost.lines.empty()) {
    figures.push_back(
        {.id = "render-disk",
         .title = "Blurring by one disk: what it costs at every diameter",
         .read = "Lower is faster; dashed lines are peers, bars are 95 % intervals of the median.",
         .means = "The renderers take the least of lensd's three lines, which rises by a few times from one pixel to "
                  "a hundred where a direct sum grows with the square of the diameter.",
         .chart = std::move(cost)});
  }
  for (const std::string& scene : RenderedScenes(rows)) AddScene(rows, scene, figures);
}

std::vector<Figure> RenderFailures(const Evidence& rows) {
  ScatterChart error = OverDiameter(rows, "error", "largest error of 500 pixels [1/255]");
  if (error.lines.empty()) return {};
  error.rules.push_back({.y = 1e-3, .label = "goal: 0.001"});
  return {{.id = "render-error",
           .title = "Blurring by one disk: how far each method is off at every diameter",
           .read = "Lower is truer; the truth is a sum in double precision over the disk's exact areas.",
           .means = "Above the dashed goal a method is not exact enough for that diameter.",
           .chart = std::move(error)}};
}

std::vector<Figure> RenderNeeds(const Evidence& rows) {
  DotChart cost{.x = {.label = "CPU time of one frame [ms]", .log = true}, .groups = {{.name = "", .rows = {}}}};
  ScatterChart bounds{.x = {.label = "stated bound of the error [1/255]", .log = true},
                      .y = {.label = "true error [1/255], one pixel in a thousand exceeds it", .log = true}};
  int scenes = 0, simpler = 0, short_of = 0, beyond_half = 0;
  for (const std::string& scene : RenderedScenes(rows)) {
    const EvidenceRow *time = RowOf(rows, "render", scene, "auto", "time"),
                      *error = RowOf(rows, "render", scene, "auto", "error"),
                      *bound = RowOf(rows, "render", scene, "auto", "bound");
    if (time == nullptr || error == nullptr) continue;
    ++scenes;
    beyond_half += error->estimate.middle > kTolerance;
    simpler += SimplerWouldDo(rows, scene, *time);
    if (bound != nullptr) {
      const bool beyond = error->estimate.middle > std::max(bound->estimate.middle, 1e-3);
      short_of += beyond;
      bounds.marks.push_back({.x = std::max(bound->estimate.middle, kLeastLevels),
                              .y = std::max(error->estimate.middle, kLeastLevels),
                              .series = beyond ? 5 : 0,
                              .label = scene,
                              .tip = scene + ": " + time->note + ", off by " + Short(error->estimate.middle) +
                                     ", bound " + Short(bound->estimate.middle)});
    }
    cost.groups[0].rows.push_back(CostOf(rows, scene, *time));
  }
  std::vector<Figure> figures;
  if (scenes == 0) return figures;
  figures.push_back(
      {.id = "need-render",
       .title = "Which renderer each scene needs, and what the heaviest would cost",
       .read =
           "Scenes from trivial to hard; the disk is what auto chose (named at the right), the square rays one by one.",
       .means = "Something simpler would have been faster and within half a level in " + ShareInWords(simpler, scenes) +
                " of the scenes; what was chosen was off by more than it stated in " + ShareInWords(short_of, scenes) +
                ", and by more than half a level in " + ShareInWords(beyond_half, scenes) +
                " (0 wanted): those have textures as fine as the pixels.",
       .chart = std::move(cost),
       .key = {{0, "auto"}, {1, "rays, the heaviest"}}});
  if (!bounds.marks.empty()) {
    bounds.diagonal = true;
    figures.push_back({.id = "need-bound",
                       .title = "Does the chosen renderer keep what it promised?",
                       .read = "A mark below the diagonal is a scene whose true error is less than the bound that auto "
                               "stated; a cross is one where it is more. Errors below 0.001 are rounding and count as "
                               "held.",
                       .means = short_of == 0
                                    ? "Every bound held."
                                    : "In " + Short(short_of) + " of " + Short(scenes) +
                                          " scenes the error is larger than stated. Their textures are noise as "
                                          "fine as a pixel, finer than the bound vouches for: waves shorter "
                                          "than 2.5 pixels keep a part of their light that no kernel on pixels has.",
                       .chart = std::move(bounds),
                       .key = {{0, "bound held"}, {5, "bound broken"}}});
  }
  return figures;
}

}  // namespace lensd::bench
