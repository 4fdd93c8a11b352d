// The command `measure`: focus measures against one read of memory and against OpenCV, in turns on the same picture.
#include "bench/measure/measure.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "autofocus/measures.h"
#include "autofocus/measures/measure_scalar.h"
#include "bench/command.h"
#include "bench/cpu_time.h"
#include "bench/measure/peers.h"
#include "bench/outputs.h"
#include "io/svg.h"

namespace lensd::bench {
namespace {

using autofocus::GreyView;
using nlohmann::ordered_json;

struct Options {
  int width = 1920;
  int height = 1080;
  int repeats = 31;
};

struct Row {
  std::string name;
  bool peer;
  double elapsed_ms;
};

/// Sums the picture as fast as memory gives it: eight independent sums of 64-bit words, which compilers vectorise.
double ReadOnce(GreyView<std::uint8_t> view) {
  std::uint64_t sums[8] = {};
  const std::size_t bytes = static_cast<std::size_t>(view.stride) * static_cast<std::size_t>(view.height);
  for (std::size_t i = 0; i + 64 <= bytes; i += 64) {
    std::uint64_t words[8];
    std::memcpy(words, view.samples + i, sizeof words);
    for (std::size_t k = 0; k < 8; ++k) sums[k] += words[k];
  }
  return static_cast<double>(sums[0] + sums[1] + sums[2] + sums[3] + sums[4] + sums[5] + sums[6] + sums[7]);
}

std::vector<MeasurePeer> Ours() {
  return {{"lensd fused", "", [](GreyView<std::uint8_t> view) { return static_cast<double>(SumFocus(view).gradient); }},
          {"lensd Tenengrad", "", [](GreyView<std::uint8_t> view) { return static_cast<double>(SumGradient(view)); }},
          {"lensd Laplacian", "",
           [](GreyView<std::uint8_t> view) { return static_cast<double>(SumLaplacian(view).square); }},
          {"lensd Brenner", "", [](GreyView<std::uint8_t> view) { return static_cast<double>(SumBrenner(view)); }}};
}

/// The fused pass over samples of 16 bits, as every frame of a rig has them: twice the memory.
std::vector<MeasurePeer> OursInWords(const std::vector<std::uint16_t>& twelve,
                                     const std::vector<std::uint16_t>& sixteen) {
  using Wide = GreyView<std::uint16_t>;
  const auto as_wide = [](const std::vector<std::uint16_t>& samples, GreyView<std::uint8_t> like) {
    return Wide{samples.data(), like.width, like.height, like.width};
  };
  const auto one_by_one = [](Wide view) {
    namespace scalar = autofocus::scalar;
    const auto slopes = [](Wide part, scalar::Noise noise) { return scalar::SlopesOf(part, noise); };
    return scalar::ByBands(view, slopes, [&](const std::uint16_t* row, autofocus::FocusSums& sums) {
      scalar::AddLevels(row, view.width, std::uint16_t{4095}, sums);
    });
  };
  return {{"lensd fused, 12 bits", "",
           [=, &twelve](auto like) { return static_cast<double>(SumFocus(as_wide(twelve, like), 4095).gradient); }},
          {"lensd fused, 16 bits", "",
           [=, &sixteen](auto like) { return static_cast<double>(SumFocus(as_wide(sixteen, like), 65535).gradient); }},
          {"lensd fused, 12 bits, no vectors", "",
           [=, &twelve](auto like) { return static_cast<double>(one_by_one(as_wide(twelve, like)).gradient); }}};
}

/// Times in turns, so that a slow spell of the machine falls on all alike; the cache is filled with something else
/// before each.
std::vector<Row> Measure(const Options& options) {
  std::vector<std::uint8_t> picture(static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height));
  std::uint32_t state = 1;
  for (std::uint8_t& sample : picture)
    sample = static_cast<std::uint8_t>((state = state * 1664525u + 1013904223u) >> 24);
  const GreyView<std::uint8_t> view{picture.data(), options.width, options.height, options.width};
  std::vector<std::uint8_t> other(std::size_t{96} << 20);

  std::vector<MeasurePeer> all = {{"read memory once", "", ReadOnce}};
  for (MeasurePeer& own : Ours()) all.push_back(std::move(own));
  std::vector<std::uint16_t> twelve, sixteen;
  for (const std::uint8_t sample : picture) {
    twelve.push_back(static_cast<std::uint16_t>(sample * 16));
    sixteen.push_back(static_cast<std::uint16_t>(sample * 257));
  }
  for (MeasurePeer& own : OursInWords(twelve, sixteen)) all.push_back(std::move(own));
  const std::size_t own_count = all.size();
  for (MeasurePeer& peer : MeasurePeers()) all.push_back(std::move(peer));

  std::vector<std::vector<double>> times(all.size());
  double kept = 0.0;
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      for (std::size_t at = 0; at < other.size(); at += 64) ++other[at];
      const double start = ThreadCpuMs();
      kept += all[i].run(view);
      times[i].push_back(ThreadCpuMs() - start);
    }
  }
  if (!std::isfinite(kept)) return {};  // keeps the work from being left out
  std::vector<Row> rows;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto middle = times[i].begin() + static_cast<std::ptrdiff_t>(times[i].size() / 2);
    std::nth_element(times[i].begin(), middle, times[i].end());
    rows.push_back({all[i].name, i >= own_count, *middle});
  }
  return rows;
}

double TimeOf(const std::vector<Row>& rows, const std::string& name) {
  for (const Row& row : rows) {
    if (row.name == name) return row.elapsed_ms;
  }
  return 0.0;
}

std::string ChartOf(const std::vector<Row>& rows) {
  io::Chart chart;
  chart.title = "Focus measures on a cold 8-bit picture";
  chart.subtitle = "median CPU time of one thread; labels: times the memory read";
  const double floor = TimeOf(rows, "read memory once");
  chart.x = {.label = "", .low = 0.0, .high = static_cast<double>(rows.size())};
  chart.y = {.label = "CPU time", .unit = "ms", .scale = io::Scale::Log, .low = 0.5 * floor};
  chart.legend = io::LegendPlace::Below;
  chart.width = 1280;
  bool named[3] = {};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const int kind = i == 0 ? 0 : rows[i].peer ? 2 : 1;
    static constexpr const char* kNames[] = {"floor", "lensd", "OpenCV"};
    static constexpr const char* kColours[] = {"#9aa0a6", "#2a9d5c", "#d1495b"};
    char ratio[32];
    std::snprintf(ratio, sizeof ratio, "%.3g x", rows[i].elapsed_ms / floor);
    io::ChartBar bar{.name = std::exchange(named[kind], true) ? "" : kNames[kind],
                     .colour = kColours[kind],
                     .opacity = 0.7,
                     .label = ratio};
    bar.x_low = static_cast<double>(i) + 0.1;
    bar.x_high = static_cast<double>(i) + 0.9;
    bar.y_high = rows[i].elapsed_ms;
    chart.bars.push_back(std::move(bar));
    std::string name = rows[i].name;
    for (const char* prefix : {"lensd ", "OpenCV "}) {
      if (name.starts_with(prefix)) name.erase(0, std::strlen(prefix));
    }
    chart.x.ticks.emplace_back(static_cast<double>(i) + 0.5, name);
  }
  return io::ChartSvg(chart);
}

}  // namespace

int RunMeasure(int argc, char** argv) {
  Outputs outputs;
  Options options;
  CLI::App app("Focus measures against OpenCV's and against reading the memory once.", argv[0]);
  app.add_option("--csv", outputs.csv, "write every figure to this file");
  app.add_option("--svg", outputs.svg, "write the chart to this file");
  app.add_flag("--json", outputs.as_json, "one line of JSON instead of the table");
  app.add_option("--width", options.width, "px")->check(CLI::Range(64, 16384))->capture_default_str();
  app.add_option("--height", options.height, "px")->check(CLI::Range(64, 16384))->capture_default_str();
  app.add_option("--repeats", options.repeats, "runs of each; the median counts")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  return ParseThen(app, argc, argv, [&] {
    const std::vector<Row> rows = Measure(options);
    const double floor = TimeOf(rows, "read memory once");
    const double tenengrad = TimeOf(rows, "OpenCV Tenengrad, tuned");
    std::vector<ordered_json> json;
    for (const Row& row : rows) {
      json.push_back(
          {{"measure", row.name},
           {"peer", row.peer},
           {"elapsedMs", row.elapsed_ms},
           {"timesRead", row.elapsed_ms / floor},
           {"tunedTenengradOverThis", tenengrad > 0.0 ? ordered_json(tenengrad / row.elapsed_ms) : ordered_json()}});
    }
    std::vector<std::string> missing;
    if (MeasurePeers().empty()) missing.emplace_back("OpenCV");
    return WriteOutputs(argv[0], json, missing, outputs, [&] { return ChartOf(rows); });
  });
}

}  // namespace lensd::bench
