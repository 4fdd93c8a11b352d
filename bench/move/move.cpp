// A voice coil that rings is sent one step by a rig on a stepped clock; the simulator's truth says how far from the
// target it still swings. One run for each way of moving and each error of the configured frequency.
#include "bench/move/move.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/clock.h"
#include "bench/command.h"
#include "bench/outputs.h"
#include "io/svg.h"
#include "rig/rig.h"
#include "sim/world.h"

namespace lensd::bench {
namespace {

using nlohmann::ordered_json;

struct Way {
  const char* name;
  rig::Shaper shaper;
  const char* colour;
};
constexpr Way kWays[] = {{"raw", rig::Shaper::None, "#9aa0a6"},
                         {"ramp", rig::Shaper::Ramp, "#e0b030"},
                         {"split", rig::Shaper::Split, "#d1495b"},
                         {"zv", rig::Shaper::Zv, "#2266aa"},
                         {"zvd", rig::Shaper::Zvd, "#2a9d5c"}};
constexpr double kLongest = 40.0;        // periods looked at: a raw step at 2 % damping is at 0.7 % by then
constexpr double kSampling = 1.0 / 200;  // periods
constexpr double kFrom = 2000.0, kTo = 8000.0;

struct MoveOptions {
  double ring_hz = 80.0, damping = 0.02, range_percent = 20.0;
  int errors = 21;
  Outputs outputs;
};

/// What is left from each time on: the largest distance from the target then or later, as a part of the step.
struct Swing {
  double period_s = 0.0;  ///< the configured one
  std::vector<double> left;

  double LeftAfter(double periods) const {
    return left[std::min(left.size() - 1, static_cast<std::size_t>(std::ceil(periods / kSampling - 1e-9)))];
  }
  /// Periods until no more than `part` is left; nothing within kLongest: infinity.
  double PeriodsTo(double part) const {
    const auto found = std::ranges::find_if(left, [&](double now) { return now <= part; });
    if (found == left.end()) return std::numeric_limits<double>::infinity();
    return kSampling * static_cast<double>(found - left.begin());
  }
};

sim::Scene VoiceCoil(double ring_hz, double damping) {
  sim::Scene scene;
  scene.camera.width = scene.camera.height = 8;
  scene.surfaces.push_back({.shape = sim::PlaneShape{.u0_d = 1.0}, .region = {}, .paint = sim::ConstantPaint{}});
  scene.lens.steps = 10001;
  scene.lens.speed_steps_per_s = 1e9;
  scene.lens.acceleration_steps_per_s2 = 1e15;
  scene.lens.settle_ms = 0.0;
  scene.lens.ring_hz = ring_hz;
  scene.lens.ring_damping = damping;
  return scene;
}

template <class T>
T OrThrow(Result<T> made) {
  if (!made) throw std::runtime_error(made.error().message);
  return *std::move(made);
}

/// One step, `true_hz` being what the actuator does and the options what the configuration says.
Swing Measure(rig::Shaper shaper, double true_hz, const MoveOptions& options) {
  SteppedClock clock;
  const auto scene = std::make_shared<const sim::Scene>(VoiceCoil(true_hz, options.damping));
  auto world = OrThrow(sim::OpenWorld(scene, clock, {.focus_start = Native{kFrom}}));
  rig::RigConfig config;
  auto& focus = config.axes[drivers::Axis::Focus];
  focus.shaper = shaper;
  focus.ring_hz = options.ring_hz;
  focus.ring_damping = options.damping;
  const auto rig = OrThrow(rig::Rig::Create(config, std::move(world.device), clock));
  rig->Move(drivers::Axis::Focus, {.kind = rig::Target::Kind::Native, .value = kTo, .from = {}},
            [](const Result<rig::MoveOutcome>&) {});
  Swing swing{.period_s = 1.0 / options.ring_hz, .left = {}};
  const Instant begin = clock.Now();
  Instant next_step = begin;
  for (int i = 0; i <= static_cast<int>(kLongest / kSampling); ++i) {
    const auto at = std::chrono::duration<double>(i * kSampling * swing.period_s);
    const Instant sample = begin + std::chrono::duration_cast<Duration>(at);
    while (next_step <= sample) {
      clock.AdvanceTo(next_step);
      next_step = std::max(rig->Step(clock.Now()), clock.Now() + std::chrono::nanoseconds(1));
    }
    clock.AdvanceTo(sample);
    swing.left.push_back(std::abs(world.truth->Now().focus_steps - kTo) / (kTo - kFrom));
  }
  for (std::size_t i = swing.left.size() - 1; i-- > 0;) swing.left[i] = std::max(swing.left[i], swing.left[i + 1]);
  return swing;
}

struct Row {
  const Way* way;
  double error = 0.0;  ///< the true frequency over the configured one, less 1
  Swing swing;
};

std::vector<Row> MeasureAll(const MoveOptions& options) {
  std::vector<Row> rows;
  for (const Way& way : kWays) {
    for (int i = 0; i < options.errors; ++i) {
      const double along = options.errors > 1 ? 2.0 * i / (options.errors - 1) - 1.0 : 0.0;
      const double error = along * options.range_percent * 1e-2;
      rows.push_back({&way, error, Measure(way.shaper, options.ring_hz * (1.0 + error), options)});
    }
  }
  return rows;
}

/// A driver that waits a fixed time after a raw step waits until what is left of a calibrated one is 5 %.
double FixedWait(const std::vector<Row>& rows) {
  const auto calibrated = std::ranges::find_if(rows, [](const Row& row) { return std::abs(row.error) < 1e-9; });
  return calibrated == rows.end() ? std::numeric_limits<double>::infinity() : calibrated->swing.PeriodsTo(0.05);
}

ordered_json Finite(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json();
}

ordered_json JsonOf(const Row& row, const std::string& name, double waits) {
  return {{"method", name},
          {"frequencyErrorPercent", std::round(row.error * 1e6) / 1e4},
          {"waitPeriods", waits > 0.0 ? Finite(waits) : ordered_json()},
          {"residualAt055", row.swing.LeftAfter(0.55)},
          {"residualAt075", row.swing.LeftAfter(0.75)},
          {"residualAt1", row.swing.LeftAfter(1.0)},
          {"residualAtWait",
           waits > 0.0 && std::isfinite(waits) ? ordered_json(row.swing.LeftAfter(waits)) : ordered_json()},
          {"periodsTo5Percent", Finite(row.swing.PeriodsTo(0.05))},
          {"periodsTo2Percent", Finite(row.swing.PeriodsTo(0.02))},
          {"settleMsTo5Percent", Finite(1e3 * row.swing.period_s * row.swing.PeriodsTo(0.05))}};
}

io::Chart OverTime(const std::vector<Row>& rows, double wait) {
  io::Chart chart;
  chart.title = "What is left of one step: calibrated";
  chart.subtitle = "largest distance from the target then or later; the frequency is known";
  chart.x = {
      .label = "time since the command", .unit = "periods", .scale = io::Scale::Log, .low = 0.1, .high = kLongest};
  chart.y = {.label = "residual", .unit = "% of the step", .scale = io::Scale::Log, .low = 0.01, .high = 200.0};
  chart.rules.push_back({.y = 5.0, .label = "5 %"});
  chart.rules.push_back({.x = 0.75, .label = "0.75"});
  for (const Row& row : rows) {
    if (std::abs(row.error) > 1e-9) continue;
    io::ChartLine line{.name = row.way->name, .points = {}, .colour = row.way->colour};
    // On a logarithmic axis later points lie closer.
    for (std::size_t i = 0; i < row.swing.left.size(); i += 1 + i / 100) {
      line.points.push_back({kSampling * static_cast<double>(i), std::max(100.0 * row.swing.left[i], 1e-3)});
    }
    chart.lines.push_back(std::move(line));
  }
  if (std::isfinite(wait)) {
    io::ChartPoints mark{.name = "raw and a fixed wait", .points = {{{wait, 5.0}, ""}}, .colour = "#333333"};
    mark.marker = io::Marker::Diamond;
    chart.points.push_back(std::move(mark));
  }
  return chart;
}

io::Chart OverError(const std::vector<Row>& rows, double after) {
  io::Chart chart;
  char title[80];
  std::snprintf(title, sizeof title, "Residual after %g %s, over the error of the frequency", after,
                after == 1.0 ? "period" : "periods");
  chart.title = title;
  chart.subtitle = "true frequency over the configured one; periods are configured ones";
  chart.x = {.label = "frequency error", .unit = "%"};
  chart.y = {.label = "residual", .unit = "% of the step", .scale = io::Scale::Log, .low = 0.01, .high = 200.0};
  chart.rules.push_back({.y = 5.0, .label = "5 %"});
  for (const Way& way : kWays) {
    io::ChartLine line{.name = way.name, .points = {}, .colour = way.colour, .markers = true};
    for (const Row& row : rows) {
      if (row.way == &way) {
        line.points.push_back({100.0 * row.error, std::max(100.0 * row.swing.LeftAfter(after), 1e-3)});
      }
    }
    chart.lines.push_back(std::move(line));
  }
  return chart;
}

int Bench(const MoveOptions& options) {
  const std::vector<Row> rows = MeasureAll(options);
  const double wait = FixedWait(rows);
  std::vector<ordered_json> table;
  for (const Row& row : rows) table.push_back(JsonOf(row, row.way->name, 0.0));
  for (const Row& row : rows) {
    if (row.way->shaper == rig::Shaper::None) table.push_back(JsonOf(row, "fixed-wait", wait));
  }
  return WriteOutputs("move", table, {}, options.outputs, [&] {
    return io::ChartsSvg({OverTime(rows, wait), OverError(rows, 0.75), OverError(rows, 1.0)}, 1);
  });
}

}  // namespace

int RunMove(int argc, char** argv) {
  CLI::App app(
      "Sends a simulated voice coil one step through a rig, raw and shaped, and measures what still swings and when.\n"
      "Residuals are parts of the step, times are periods of the configured frequency.");
  MoveOptions options;
  app.add_option("--ring-hz", options.ring_hz, "configured frequency")
      ->check(CLI::Range(1.0, 10e3))
      ->capture_default_str();
  app.add_option("--damping", options.damping, "of critical, true and configured")
      ->check(CLI::Range(0.0, 0.5))
      ->capture_default_str();
  app.add_option("--error", options.range_percent, "largest error of the frequency, percent")
      ->check(CLI::Range(0.0, 50.0))
      ->capture_default_str();
  app.add_option("--points", options.errors, "frequencies measured, an odd number")
      ->check(CLI::Range(1, 1001))
      ->capture_default_str();
  app.add_option("--csv", options.outputs.csv, "file for the table");
  app.add_option("--svg", options.outputs.svg, "file for the charts");
  app.add_flag("--json", options.outputs.as_json, "one line of JSON instead of the table");
  return ParseThen(app, argc, argv, [&] { return Bench(options); });
}

}  // namespace lensd::bench
