// lensctl verify: does a picture keep its blur limits? Its blur is measured against frames of a small aperture, depth
// slice by depth slice, and held against what was asked. Nothing here knows what the lens or a plan says.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "cli/charts/chart_file.h"
#include "cli/commands.h"
#include "cli/offline/verify_chart.h"
#include "cli/offline/verify_frames.h"
#include "cli/plan/where.h"
#include "cli/text/quantity.h"
#include "cli/text/text.h"
#include "io/atomic_file.h"
#include "varlink/json.h"
#include "verify/limit_verdict.h"

namespace lensd::cli {
namespace {

using verify::BlurLimit;
using verify::SliceBlur;
using verify::Verdict;

constexpr double kSmallestSearchPx = 1.0, kLargestSearchPx = 40.0, kUsualSearchPx = 14.0;

/// The options as written.
struct VerifyText {
  VerifyFiles files;
  std::vector<std::string> sharp, blurred;
  std::string pixel, reference_opening, slice = "0.1m", largest, predicted;
  PlotText plot;
};

/// What the options mean.
struct VerifyQuestion {
  std::vector<BlurLimit> limits;
  std::optional<double> reference_opening;  ///< nothing: as the files say
  double slice_m = 0.0;
  double largest_px = 0.0;
};

/// What was found.
struct VerifyFound {
  std::vector<Verdict> verdicts;
  std::vector<SliceBlur> slices;     ///< those with enough pixels
  std::optional<std::string> doubt;  ///< of the frames

  /// Nothing where nothing was asked.
  std::optional<bool> holds() const {
    if (verdicts.empty()) return std::nullopt;
    return std::ranges::all_of(verdicts, [](const Verdict& each) { return each.answer == verify::Answer::Holds; });
  }
};

Result<double> BlurInPixels(const BlurSize& blur, const std::string& text, const std::optional<Decimal>& pixel,
                            std::string_view option) {
  std::optional<double> px = blur.value.Nearest();
  if (!blur.in_pixels) {
    if (!pixel) {
      return Wrong(option, text,
                   "a blur in um needs the size of a pixel: add --pixel, such as --pixel 3.45um, or write it in px");
    }
    px = optics::Nearest(blur.value.ToRational() / pixel->ToRational());
  }
  if (!px) return Wrong(option, text, "this is beyond what a picture can show");
  return *px;
}

double MetresTo(const Depth& depth) {
  return depth.IsDistance() ? depth.value : 1.0 / depth.value;  // infinity is 1/0
}

Result<BlurLimit> ReadVerifyLimit(const std::string& text, BlurLimit::Kind kind, std::size_t index,
                                  const std::optional<Decimal>& pixel) {
  const bool sharp = kind == BlurLimit::Kind::Sharp;
  const std::string word = sharp ? "sharp" : "blurred", option = "--" + word;
  const auto written = ParseLimit(text, sharp ? optics::LimitKind::Sharp : optics::LimitKind::Blurred);
  if (!written) return PassOn(written);
  const auto* range = std::get_if<DepthRange>(&written->where);
  if (range == nullptr) {
    return Wrong(option, text, "a picture is judged between two depths: write [NAME=]NEAR..FAR[:LIMIT]");
  }
  BlurLimit limit{.name = written->name.empty() ? word + "[" + std::to_string(index) + "]" : written->name,
                  .kind = kind,
                  .near_m = MetresTo(range->near),
                  .far_m = MetresTo(range->far),
                  .limit_px = 1.0};
  if (!(limit.near_m < limit.far_m)) {
    return Wrong(option, text, "both ends are one depth, which no slice fills: write NEAR..FAR, such as 2.1m..2.5m");
  }
  if (!written->limit) return limit;
  const auto px = BlurInPixels(*written->limit, text, pixel, option);
  if (!px) return PassOn(px);
  limit.limit_px = *px;
  return limit;
}

Result<std::vector<BlurLimit>> ReadVerifyLimits(const VerifyText& text, const std::optional<Decimal>& pixel) {
  std::vector<BlurLimit> limits;
  std::set<std::string> names;
  for (const auto& [kind, written] :
       {std::pair(BlurLimit::Kind::Sharp, &text.sharp), {BlurLimit::Kind::Blurred, &text.blurred}}) {
    for (std::size_t i = 0; i < written->size(); ++i) {
      auto limit = ReadVerifyLimit((*written)[i], kind, i, pixel);
      if (!limit) return PassOn(limit);
      if (!names.insert(limit->name).second) {
        return Fail(Code::InvalidArgument, "two limits are called '" + limit->name + "'; give each a name of its own");
      }
      limits.push_back(*std::move(limit));
    }
  }
  return limits;
}

/// The largest blur to look for, which has to be beyond every limit.
Result<double> ReadLargest(const VerifyText& text, const std::vector<BlurLimit>& limits,
                           const std::optional<Decimal>& pixel) {
  constexpr double kBeyondLimit = 1.25;
  const std::string option = "--largest";
  double most_px = 0.0, largest_px = kUsualSearchPx;
  for (const BlurLimit& limit : limits) most_px = std::max(most_px, limit.limit_px);
  if (text.largest.empty()) {
    largest_px = std::clamp(kBeyondLimit * most_px, kUsualSearchPx, kLargestSearchPx);
  } else {
    const auto written = ParseBlur(text.largest, option);
    if (!written) return PassOn(written);
    const auto px = BlurInPixels(*written, text.largest, pixel, option);
    if (!px) return PassOn(px);
    largest_px = *px;
    if (!(largest_px >= kSmallestSearchPx && largest_px <= kLargestSearchPx)) {
      return Wrong(option, text.largest,
                   "blur is looked for up to " + Short(kSmallestSearchPx) + "px to " + Short(kLargestSearchPx) + "px");
    }
  }
  if (most_px < largest_px) return largest_px;
  return Fail(
      Code::InvalidArgument,
      "a limit of " + Short(most_px) + " px cannot be judged where blur is looked for up to " + Short(largest_px) +
          " px: " +
          (text.largest.empty() ? "judge a smaller picture of the scene" : "give a larger --largest, up to 40px"));
}

Result<std::optional<double>> ReadOpening(const std::string& text) {
  constexpr double kMost = 0.99;
  const std::string option = "--reference-opening";
  if (text.empty()) return std::nullopt;
  const auto number = ParseNumber(text, option);
  if (!number) return PassOn(number);
  const double opening = number->Nearest().value_or(0.0);
  if (opening >= 0.0 && opening <= kMost) return opening;
  return Wrong(option, text,
               "the picture's f-number over the references' is from 0 (a pinhole) to 0.99, such as 0.125 for f/2 and "
               "f/16");
}

Result<VerifyQuestion> ReadVerify(const VerifyText& text, std::optional<From> from) {
  if (from.value_or(From::Lens) != From::Lens) {
    return Fail(Code::InvalidArgument,
                "distances of verify start at the lens centre, as those of the depth map do: leave --from out");
  }
  std::optional<Decimal> pixel;
  if (!text.pixel.empty()) {
    const auto pitch = ParsePositiveLength(text.pixel, "--pixel");
    if (!pitch) return PassOn(pitch);
    pixel = *pitch;
  }
  auto limits = ReadVerifyLimits(text, pixel);
  if (!limits) return PassOn(limits);
  const auto largest = ReadLargest(text, *limits, pixel);
  if (!largest) return PassOn(largest);
  const auto opening = ReadOpening(text.reference_opening);
  if (!opening) return PassOn(opening);
  const auto slice = ParsePositiveLength(text.slice, "--slice");
  if (!slice) return PassOn(slice);
  return VerifyQuestion{.limits = *std::move(limits),
                        .reference_opening = *opening,
                        .slice_m = slice->Nearest().value_or(0.0),
                        .largest_px = *largest};
}

/// The curve that was planned, as `lensctl blur --pixel P --json` prints it; nothing for a point at infinity.
std::expected<std::vector<io::ChartPoint>, Failure> ReadPredicted(const std::string& path) {
  std::vector<io::ChartPoint> points;
  if (path.empty()) return points;
  const auto text = io::ReadWholeFile(path);
  if (!text) return RefuseInput(text);
  const auto json = varlink::ParseJson(*text);
  const auto refuse = [&path](const std::string& why) {
    return Refuse(Exit::BadData, path + ": " + why +
                                     "; write it by lensctl blur --pixel P --at D ... --json, which prints "
                                     "[{distanceM, blurPx}]");
  };
  if (!json || !json->is_array()) return refuse(json ? "not a list of points" : "not JSON");
  for (const varlink::Json& point : *json) {
    const bool whole = point.is_object() && point.contains("distanceM") && point.contains("blurPx") &&
                       point["blurPx"].is_number() && (point["distanceM"].is_number() || point["distanceM"].is_null());
    if (!whole) return refuse("a point without its distance and its blur in pixels");
    if (point["distanceM"].is_null()) continue;
    points.push_back({point["distanceM"].get<double>(), point["blurPx"].get<double>()});
  }
  return points;
}

std::expected<VerifyFound, Failure> Find(const VerifyText& text, const VerifyQuestion& question) {
  const auto read = ReadVerifyFrames(text.files, question.reference_opening);
  if (!read) return PassOn(read);
  const auto edges = verify::SliceEdges(read->depth_m, question.limits, question.slice_m);
  if (!edges) {
    const bool thin = edges.error().code == Code::InvalidArgument;
    return Refuse(thin ? Exit::Usage : Exit::BadData,
                  (thin ? "--slice '" + text.slice + "': " : text.files.depth_map + ": ") + edges.error().message);
  }
  auto slices = verify::BlurBetween(read->frames, read->depth_m, *edges, question.largest_px);
  if (!slices) return PassOn(Failure(slices.error()));
  VerifyFound found{.verdicts = {}, .slices = {}, .doubt = read->doubt};
  for (const BlurLimit& limit : question.limits) found.verdicts.push_back(verify::Judge(limit, *slices));
  std::erase_if(*slices, [](const SliceBlur& slice) { return slice.pixels < verify::kFewestPixels; });
  found.slices = *std::move(slices);
  return found;
}

varlink::Json SliceJson(const SliceBlur& slice) {
  return {{"nearM", slice.near_m},
          {"farM", slice.far_m},
          {"meanM", slice.mean_m},
          {"pixels", slice.pixels},
          {"diameterPx", slice.diameter_px},
          {"lowPx", slice.low_px},
          {"highPx", slice.open ? varlink::Json() : varlink::Json(slice.high_px)},
          {"atMost", slice.at_most()},
          {"gain", slice.gain}};
}

varlink::Json FoundJson(const VerifyFound& found) {
  varlink::Json limits = varlink::Json::array(), slices = varlink::Json::array();
  for (const auto& [limit, pixels, worst, answer] : found.verdicts) {
    limits.push_back({{"name", limit.name},
                      {"kind", limit.kind == BlurLimit::Kind::Sharp ? "sharp" : "blurred"},
                      {"nearM", limit.near_m},
                      {"farM", varlink::NumberOrNull(limit.far_m)},
                      {"limitPx", limit.limit_px},
                      {"worst", worst ? SliceJson(*worst) : varlink::Json()},
                      {"pixels", pixels},
                      {"answer", verify::NameOf(answer)}});
  }
  for (const SliceBlur& slice : found.slices) slices.push_back(SliceJson(slice));
  const auto holds = found.holds();
  return {{"holds", holds ? varlink::Json(*holds) : varlink::Json()}, {"limits", limits}, {"slices", slices}};
}

std::string MeasuredText(const SliceBlur& slice) {
  if (slice.open) return "not known";
  if (slice.at_most()) return "at most " + Short(slice.high_px, 3) + " px";
  return Short(slice.diameter_px, 3) + " px (" + Short(slice.low_px, 3) + " to " + Short(slice.high_px, 3) + ")";
}

std::string EndText(double metres) {
  return std::isinf(metres) ? "infinity" : DistanceText(Metres{metres});
}

std::string LimitsText(const VerifyFound& found) {
  std::vector<std::vector<std::string>> cells{
      {"limit", "depths", "asked", "worst measured (95 %)", "at", "pixels", "answer"}};
  bool broken = false;
  for (const auto& [limit, pixels, worst, answer] : found.verdicts) {
    broken |= answer == verify::Answer::Broken;
    cells.push_back({limit.name, EndText(limit.near_m) + " to " + EndText(limit.far_m),
                     (limit.kind == BlurLimit::Kind::Sharp ? "at most " : "at least ") + Short(limit.limit_px) + " px",
                     worst ? MeasuredText(*worst) : "nothing", worst ? DistanceText(Metres{worst->mean_m}) : "-",
                     std::to_string(pixels), std::string(verify::NameOf(answer))});
  }
  return TableText(cells) + (*found.holds() ? "the picture keeps its limits"
                             : broken       ? "the picture does not keep its limits"
                                            : "the frames cannot tell whether the picture keeps its limits");
}

std::string SlicesText(const VerifyFound& found) {
  if (found.slices.empty()) {
    return "no slice of depth has the " + std::to_string(verify::kFewestPixels) + " pixels that blur is measured from";
  }
  std::vector<std::vector<std::string>> cells{{"at", "measured (95 %)", "pixels"}};
  for (const SliceBlur& slice : found.slices) {
    cells.push_back({DistanceText(Metres{slice.mean_m}), MeasuredText(slice), std::to_string(slice.pixels)});
  }
  return TableText(cells);
}

Outcome RunVerify(const VerifyText& text, Session& session) {
  if (auto good = CheckPlot(text.plot); !good) return PassOn(good);
  const auto question = ReadVerify(text, session.globals().from);
  if (!question) return PassOn(question);
  auto planned = ReadPredicted(text.predicted);
  if (!planned) return PassOn(planned);
  const auto found = Find(text, *question);
  if (!found) return PassOn(found);
  if (found->doubt) session.Remark(*found->doubt);
  if (text.plot.wanted()) {
    const io::Chart chart =
        VerifyChart({.verdicts = found->verdicts, .slices = found->slices, .planned = *std::move(planned)});
    if (auto drawn = WritePlot(text.plot, io::ChartSvg(chart)); !drawn) return PassOn(drawn);
  }
  if (session.json()) {
    session.PrintJson(FoundJson(*found));
  } else {
    session.PrintText(found->verdicts.empty() ? SlicesText(*found) : LimitsText(*found));
  }
  return found->holds().value_or(true) ? Exit::Done : Exit::No;
}

}  // namespace

void AddVerify(CLI::App& root, Run& run) {
  auto text = std::make_shared<VerifyText>();
  CLI::App* command =
      root.add_subcommand("verify", "measure the blur of a picture and say whether it keeps its limits");
  command->group(kOffline);
  command->add_option("PICTURE", text->files.picture, "the picture to judge: a PNG in linear light")->required();
  command
      ->add_option("--reference", text->files.references,
                   "a frame of this view and focus through a small aperture; give two or more, from which the noise is "
                   "estimated")
      ->required()
      ->allow_extra_args(false)
      ->type_name("FILE");
  command
      ->add_option("--depth-map", text->files.depth_map,
                   "the depth of each pixel: grey 16-bit PNG in mm, 0 where unknown")
      ->required()
      ->type_name("FILE");
  for (const auto& [option, limits, what] :
       {std::tuple("--sharp", &text->sharp, "[NAME=]NEAR..FAR[:LIMIT]: the blur there is at most LIMIT (default 1px)"),
        std::tuple("--blurred", &text->blurred, "[NAME=]NEAR..FAR[:LIMIT]: the blur there is at least LIMIT")}) {
    command->add_option(option, *limits, what)->allow_extra_args(false)->type_name("L");
  }
  command->add_option("--pixel", text->pixel, "size of a pixel, for limits in um")->type_name("P");
  command
      ->add_option("--reference-opening", text->reference_opening,
                   "f-number of the picture over that of the references (default: from the files)")
      ->type_name("N");
  command->add_option("--slice", text->slice, "thickness of a depth slice (default 0.1m)")->type_name("L");
  command->add_option("--largest", text->largest, "the largest blur to look for (default 14px, or beyond all limits)")
      ->type_name("BLUR");
  AddPlotOptions(*command, text->plot, "measured blur over distance, and the limits");
  command
      ->add_option("--predicted", text->predicted,
                   "also draw this curve: a file that lensctl blur --pixel P --json printed")
      ->type_name("FILE")
      ->needs(command->get_option("--plot"));
  command->footer(
      "A limit holds if no error bar (95 %) reaches more than a tenth of the limit beyond it, and is broken if a whole "
      "bar lies beyond it. Exit status 1: a limit is broken, or the frames cannot tell. Of a colour picture the green "
      "channel is measured.");
  command->callback([text, &run] { run = [text](Session& session) { return RunVerify(*text, session); }; });
}

}  // namespace lensd::cli
