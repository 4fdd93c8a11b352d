// Measures the blur of a picture against two small-aperture frames, depth slice by depth slice, and holds it against
// the limits that were planned. Nothing here knows what the lens or a simulator thinks.
#include "bench/verify/verify.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "io/png.h"
#include "io/svg.h"
#include "verify/relative_blur.h"

namespace lensd::bench {
namespace {

using nlohmann::json;
using verify::BlurBetween;
using verify::FramesToCompare;
using verify::kFewestPixels;
using verify::Plane;
using verify::SliceBlur;

struct Options {
  std::string reference_a, reference_b, picture, depth_map, predicted, svg;
  std::vector<double> sharp, blurred;  // NEAR FAR PX triples
  double slice_m = 0.1, largest_px = 14.0, reference_opening = 0.0;
  bool as_json = false;
};

struct Limit {
  std::string name;
  bool sharp = false;
  double near_m = 0.0, far_m = 0.0, limit_px = 0.0;
};

// One limit over the slices that lie in it.
struct Verdict {
  Limit limit;
  long pixels = 0;
  SliceBlur worst;
  enum class Answer { Holds, Broken, CannotTell } answer = Answer::CannotTell;
  bool holds() const { return answer == Answer::Holds; }
};

Result<Plane> ReadPlane(const std::string& path) {
  const auto image = io::ReadPng(path);
  if (!image) return PassOn(image);
  Plane plane{image->width, image->height, {}};
  // Of colours the green alone: its noise depends on its own level only.
  const std::size_t green = image->channels == 3 ? 1 : 0;
  for (std::size_t i = green; i < image->samples.size(); i += image->channels)
    plane.values.push_back(image->samples[i]);
  return plane;
}

std::vector<Limit> LimitsFrom(const Options& options) {
  std::vector<Limit> limits;
  const auto add = [&](const std::vector<double>& triples, const std::string& kind) {
    for (std::size_t i = 0; i + 2 < triples.size(); i += 3) {
      limits.push_back({kind, kind == "sharp", triples[i], triples[i + 1], triples[i + 2]});
    }
  };
  add(options.sharp, "sharp");
  add(options.blurred, "blurred");
  return limits;
}

// Slice edges from the nearest to the farthest depth, with every end of a limit among them.
std::vector<double> Edges(const std::vector<float>& depth, const std::vector<Limit>& limits, double step) {
  double nearest = 1e9, farthest = 0;
  for (const float metres : depth) {
    if (metres <= 0) continue;
    nearest = std::min<double>(nearest, metres);
    farthest = std::max<double>(farthest, metres);
  }
  std::vector<double> ends = {nearest, farthest + 1e-6};
  for (const Limit& limit : limits) {
    for (const double end : {limit.near_m, limit.far_m}) {
      if (end > nearest && end < farthest) ends.push_back(end);
    }
  }
  std::sort(ends.begin(), ends.end());
  std::vector<double> edges;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const int parts = std::max(1, static_cast<int>(std::lround((ends[i + 1] - ends[i]) / step)));
    for (int part = 0; part < parts; ++part) edges.push_back(ends[i] + (ends[i + 1] - ends[i]) * part / parts);
  }
  edges.push_back(ends.back());
  return edges;
}

/// A limit holds where no slice's error bar reaches more than a tenth of it beyond it; it is broken where a whole bar
/// lies beyond.
Verdict Judge(const Limit& limit, const std::vector<SliceBlur>& slices) {
  constexpr double kReach = 0.1;
  Verdict verdict;
  verdict.limit = limit;
  double worst = -1e9;
  bool broken = false, all_told = true;
  for (const SliceBlur& slice : slices) {
    const double middle = 0.5 * (slice.near_m + slice.far_m);
    if (slice.pixels < kFewestPixels || middle < limit.near_m || middle > limit.far_m) continue;
    verdict.pixels += slice.pixels;
    broken |= limit.sharp ? slice.low_px > limit.limit_px : slice.high_px < limit.limit_px;
    all_told &=
        limit.sharp ? slice.high_px <= (1 + kReach) * limit.limit_px : slice.low_px >= (1 - kReach) * limit.limit_px;
    const double excess = (limit.sharp ? 1 : -1) * (slice.diameter_px - limit.limit_px);
    if (excess <= worst) continue;
    worst = excess;
    verdict.worst = slice;
  }
  if (broken) verdict.answer = Verdict::Answer::Broken;
  if (!broken && all_told && verdict.pixels > 0) verdict.answer = Verdict::Answer::Holds;
  return verdict;
}

std::string_view NameOf(Verdict::Answer answer) {
  switch (answer) {
    case Verdict::Answer::Holds:
      return "holds";
    case Verdict::Answer::Broken:
      return "broken";
    case Verdict::Answer::CannotTell:
      break;
  }
  return "cannot tell";
}

json ToJson(const SliceBlur& slice) {
  return {{"nearM", slice.near_m},
          {"farM", slice.far_m},
          {"meanM", slice.mean_m},
          {"pixels", slice.pixels},
          {"diameterPx", slice.diameter_px},
          {"lowPx", slice.low_px},
          {"highPx", slice.open ? json(nullptr) : json(slice.high_px)},
          {"atMost", slice.at_most()},
          {"gain", slice.gain}};
}

json ToJson(const std::vector<Verdict>& verdicts, const std::vector<SliceBlur>& slices) {
  json out = {{"limits", json::array()}, {"slices", json::array()}, {"holds", true}};
  for (const Verdict& verdict : verdicts) {
    out["limits"].push_back({{"name", verdict.limit.name},
                             {"nearM", verdict.limit.near_m},
                             {"farM", verdict.limit.far_m},
                             {"limitPx", verdict.limit.limit_px},
                             {"worst", ToJson(verdict.worst)},
                             {"pixels", verdict.pixels},
                             {"answer", NameOf(verdict.answer)}});
    if (!verdict.holds()) out["holds"] = false;
  }
  for (const SliceBlur& slice : slices) {
    if (slice.pixels >= kFewestPixels) out["slices"].push_back(ToJson(slice));
  }
  return out;
}

std::string BlurText(const SliceBlur& slice) {
  char text[80];
  if (slice.open) {
    std::snprintf(text, sizeof text, "not known");
  } else if (slice.at_most()) {
    std::snprintf(text, sizeof text, "at most %.2f px", slice.high_px);
  } else {
    std::snprintf(text, sizeof text, "%.2f px (%.2f to %.2f)", slice.diameter_px, slice.low_px, slice.high_px);
  }
  return text;
}

io::Chart ChartOf(const std::vector<Verdict>& verdicts, const std::vector<SliceBlur>& slices, const json& predicted) {
  io::Chart chart;
  chart.title = "Blur against distance: planned, and measured from the frames";
  chart.subtitle =
      "measured by blurring a small-aperture frame until it looks like the picture; bars: 95 % where one depth fills a "
      "slice";
  chart.x = {.label = "distance from the lens centre", .unit = "m"};
  chart.y = {.label = "blur diameter", .unit = "px", .low = 0.0};
  io::ChartLine line{.name = "planned (thin lens)"};
  for (const json& point : predicted) {
    line.points.push_back({point.at("distanceM").get<double>(), point.at("blurPx").get<double>()});
  }
  if (!line.points.empty()) chart.lines.push_back(line);
  io::ChartPoints points{.name = "measured", .colour = io::PaletteColour(1)};
  io::ChartPoints limits{.name = "measured: at most", .colour = io::PaletteColour(1), .marker = io::Marker::Ring};
  double farthest = 0;
  for (const SliceBlur& slice : slices) {
    if (slice.pixels < kFewestPixels || slice.open) continue;
    farthest = std::max(farthest, slice.far_m);
    const double shown = slice.at_most() ? slice.high_px : slice.diameter_px;
    (slice.at_most() ? limits : points).points.push_back({{slice.mean_m, shown}, ""});
    chart.intervals.push_back({{slice.mean_m, shown}, slice.low_px, slice.high_px, io::PaletteColour(1)});
  }
  for (const auto& shown : {points, limits}) {
    if (!shown.points.empty()) chart.points.push_back(shown);
  }
  for (const Verdict& verdict : verdicts) {
    const Limit& limit = verdict.limit;
    char label[64];
    std::snprintf(label, sizeof label, limit.sharp ? "at most %g px" : "at least %g px", limit.limit_px);
    io::ChartBar bar{.x_low = limit.near_m, .x_high = std::min(limit.far_m, farthest), .label = label, .hatched = true};
    (limit.sharp ? bar.y_low : bar.y_high) = limit.limit_px;
    bar.colour = "#b22222";
    chart.bars.push_back(bar);
  }
  return chart;
}

void PrintTable(const std::vector<Verdict>& verdicts) {
  for (const Verdict& verdict : verdicts) {
    std::printf("%-8s %5.2f..%-5.2f m  limit %4.1f px  worst %s at %.2f m  (%ld px)  %s\n", verdict.limit.name.c_str(),
                verdict.limit.near_m, verdict.limit.far_m, verdict.limit.limit_px, BlurText(verdict.worst).c_str(),
                verdict.worst.mean_m, verdict.pixels, std::string(NameOf(verdict.answer)).c_str());
  }
}

int Complain(int status, const std::string& message) {
  std::cerr << "lens-bench verify: " << message << "\n";
  return status;
}

int Verify(const Options& options) {
  FramesToCompare frames;
  for (const auto& [path, plane] : {std::pair{&options.reference_a, &frames.reference_a},
                                    {&options.reference_b, &frames.reference_b},
                                    {&options.picture, &frames.picture}}) {
    auto read = ReadPlane(*path);
    if (!read) return Complain(EX_DATAERR, read.error().message);
    *plane = std::move(*read);
  }
  frames.reference_opening = options.reference_opening;
  const auto depth_image = io::ReadPng(options.depth_map);
  if (!depth_image) return Complain(EX_DATAERR, depth_image.error().message);
  std::vector<float> depth;
  for (const std::uint16_t millimetres : depth_image->samples) depth.push_back(static_cast<float>(millimetres) / 1000);

  const std::vector<Limit> limits = LimitsFrom(options);
  const auto slices = BlurBetween(frames, depth, Edges(depth, limits, options.slice_m), options.largest_px);
  if (!slices) return Complain(EX_DATAERR, slices.error().message);
  std::vector<Verdict> verdicts;
  for (const Limit& limit : limits) verdicts.push_back(Judge(limit, *slices));

  if (!options.svg.empty()) {
    json predicted = json::array();
    if (!options.predicted.empty()) {
      std::ifstream in(options.predicted);
      predicted = json::parse(in, nullptr, false);
      if (predicted.is_discarded()) return Complain(EX_DATAERR, options.predicted + ": not JSON");
    }
    const auto written = io::WriteSvg(options.svg, io::ChartSvg(ChartOf(verdicts, *slices, predicted)));
    if (!written) return Complain(EX_IOERR, written.error().message);
  }
  const json result = ToJson(verdicts, *slices);
  if (options.as_json) {
    std::cout << result.dump() << "\n";
  } else {
    PrintTable(verdicts);
  }
  return result["holds"].get<bool>() ? EX_OK : 1;
}

}  // namespace

int RunVerify(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Measures the blur of a picture against two frames taken through a small aperture, and says whether the "
      "limits hold: where no error bar (95 %) reaches more than a tenth of a limit beyond it. One is broken where a "
      "whole bar lies beyond. Frames are linear light; of colours the green is judged. Exit status 1: a limit is "
      "broken, or the frames cannot tell.");
  app.add_option("--reference-a", options.reference_a, "small-aperture frame (PNG)")->required();
  app.add_option("--reference-b", options.reference_b, "another one like it: their difference tells the noise")
      ->required();
  app.add_option("--picture", options.picture, "the picture to judge (PNG)")->required();
  app.add_option("--depth-map", options.depth_map, "16-bit PNG, millimetres, 0 unknown, same size")->required();
  app.add_option("--sharp", options.sharp, "NEAR FAR PX: metres, metres, largest blur diameter in px")->type_size(3);
  app.add_option("--blurred", options.blurred, "NEAR FAR PX: metres, metres, least blur diameter in px")->type_size(3);
  app.add_option("--reference-opening", options.reference_opening,
                 "diameter of the references' aperture over the picture's: their f-numbers, picture's over references'")
      ->check(CLI::Range(0.0, 0.99));
  app.add_option("--slice", options.slice_m, "depth of a slice, metres")->check(CLI::PositiveNumber);
  app.add_option("--largest", options.largest_px, "largest blur looked for, px")->check(CLI::Range(1.0, 40.0));
  app.add_option("--predicted", options.predicted, "JSON array of {distanceM, blurPx} to draw beside the measurement");
  app.add_option("--svg", options.svg, "write the chart here");
  app.add_flag("--json", options.as_json, "one line of JSON");
  return ParseThen(app, argc, argv, [&] { return Verify(options); });
}

}  // namespace lensd::bench
