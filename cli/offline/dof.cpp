// lensctl dof: depth of field and hyperfocal distance.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>

#include "cli/charts/chart_file.h"
#include "cli/commands.h"
#include "cli/offline/blur_chart.h"
#include "cli/offline/camera_system.h"
#include "cli/text/text.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

constexpr std::string_view kHyperfocal = "hyperfocal";  // as a place of --focus

struct DofText {
  std::string focal_length, f_number, focus, blur_limit, pixel, wavelength;
  std::string diffraction = "airy";
  PlotText plot;
};

struct DofInput {
  Decimal focal_length, f_number, blur_limit;
  std::optional<double> pixel_um;
  std::optional<Depth> focus;  ///< nothing: the hyperfocal distance alone
  bool at_hyperfocal = false;  ///< instead of `focus`: what is sharp with the lens there
  std::optional<Metres> wavelength;
  optics::DiffractionConvention convention = optics::DiffractionConvention::Airy;
};

Result<void> ParseDiffraction(const DofText& text, DofInput& input) {
  if (text.diffraction != "mtf50" && text.diffraction != "airy") {
    return Fail(Code::InvalidArgument, "--diffraction '" + text.diffraction + "': say airy or mtf50");
  }
  if (text.diffraction == "mtf50") input.convention = optics::DiffractionConvention::Mtf50;
  if (text.wavelength.empty()) return {};
  const auto wavelength = ParsePositiveLength(text.wavelength, "--wavelength");
  if (!wavelength) return PassOn(wavelength);
  input.wavelength = Metres{wavelength->Nearest().value()};
  return {};
}

Result<std::optional<Depth>> ParseFocus(const DofText& text, const Decimal& f, std::optional<From> from) {
  if (text.focus.empty() || text.focus == kHyperfocal) return std::nullopt;
  const auto focus = ParseDepth(text.focus, "--focus");
  if (!focus) return PassOn(focus);
  if (focus->value < 0.0) {
    return Fail(Code::InvalidArgument,
                "--focus '" + text.focus + "': past infinity nothing real is in focus; write inf");
  }
  const auto centred = FocusFromCentre(f, *focus, ScaleOf(from));
  if (!centred) return PassOn(centred);
  return *centred;
}

Result<DofInput> Parse(const DofText& text, std::optional<From> from) {
  DofInput input;
  auto f = ParseFocalLength(text.focal_length);
  if (!f) return PassOn(f);
  auto n = ParseFNumber(text.f_number, "--f-number");
  if (!n) return PassOn(n);
  const auto pixel = ParsePixel(text.pixel);
  if (!pixel) return PassOn(pixel);
  auto limit = ParseBlurLimit(text.blur_limit, *pixel, "--blur-limit");
  if (!limit) return PassOn(limit);
  const auto focus = ParseFocus(text, *f, from);
  if (!focus) return PassOn(focus);
  input.focal_length = *f;
  if (*pixel) input.pixel_um = (*pixel)->Nearest().value() * 1e6;
  input.f_number = *n;
  input.blur_limit = *limit;
  input.focus = *focus;
  input.at_hyperfocal = text.focus == kHyperfocal;
  if (const auto read = ParseDiffraction(text, input); !read) return PassOn(read);
  return input;
}

/// What is left of the limit for geometric blur beside diffraction with the sensor at this extension; nothing where
/// diffraction alone is more.
std::optional<Rational> LeftFor(const DofInput& input, double extension) {
  if (!input.wavelength) return input.blur_limit.ToRational();
  const double working = *input.f_number.Nearest() * (1.0 + extension / *input.focal_length.Nearest());
  const double disk = optics::DiffractionBlur(input.convention, *input.wavelength, FNumber{working}).value;
  const double limit = *input.blur_limit.Nearest();
  if (!(disk < limit)) return std::nullopt;
  return Decimal::Shortest(std::sqrt((limit - disk) * (limit + disk))).ToRational();
}

/// At the hyperfocal distance the extension is N C, C being what is left beside the diffraction at that extension. Both
/// settle within a few rounds, as diffraction hardly changes with so small an extension.
std::optional<Rational> LeftAtHyperfocal(const DofInput& input) {
  std::optional<Rational> left = LeftFor(input, 0.0);
  for (int round = 0; input.wavelength && left && round < 60; ++round) {
    const Rational before = *left;
    left = LeftFor(input, *input.f_number.Nearest() * optics::Nearest(before).value_or(0.0));
    if (left == before) break;
  }
  return left;
}

/// Rounded answers; a far end of nothing is infinity.
struct DofAnswer {
  double hyperfocal_m = 0.0;
  struct Ends {
    double near_d, near_m;
    std::optional<double> far_d, far_m;
  };
  std::optional<Ends> ends;
};

Result<DofAnswer::Ends> EndsOf(const Rational& f, const Rational& n, const Rational& limit, const Place& focus) {
  const auto sharp = optics::thin_lens::DepthOfField(f, n, limit, focus);
  const bool to_infinity = !(sharp.far > 0);
  const auto near_d = Rounded(sharp.near), near_m = Rounded(1 / sharp.near);
  const auto far_d = to_infinity ? Result<double>(0.0) : Rounded(sharp.far);
  const auto far_m = to_infinity ? Result<double>(0.0) : Rounded(1 / sharp.far);
  for (const auto* value : {&near_d, &near_m, &far_d, &far_m}) {
    if (!*value) return PassOn(*value);
  }
  DofAnswer::Ends ends{*near_d, *near_m, std::nullopt, std::nullopt};
  if (!to_infinity) ends.far_d = *far_d, ends.far_m = *far_m;
  return ends;
}

std::expected<DofAnswer, Failure> Compute(const DofInput& input) {
  const Rational f = input.focal_length.ToRational(), n = input.f_number.ToRational();
  const auto too_fine =
      Refuse(Exit::No,
             "diffraction alone blurs by more than --blur-limit at this f-number: nothing is sharp; open the lens (a "
             "smaller --f-number), or allow more blur");
  const auto at_hyperfocal = LeftAtHyperfocal(input);
  if (!at_hyperfocal) return too_fine;
  const Rational exact = optics::thin_lens::Hyperfocal(f, n, *at_hyperfocal);
  const auto hyperfocal = Rounded(exact);
  if (!hyperfocal) return PassOn(hyperfocal);
  DofAnswer answer{*hyperfocal, std::nullopt};
  if (!input.focus && !input.at_hyperfocal) return answer;
  const Place focus = input.focus ? PlaceOf(*input.focus) : Place{exact, 1};
  const auto extension = Rounded(optics::thin_lens::Extension(f, focus));
  if (!extension) return PassOn(extension);
  const auto left = input.at_hyperfocal ? at_hyperfocal : LeftFor(input, *extension);
  if (!left) return too_fine;
  const auto ends = EndsOf(f, n, *left, focus);
  if (!ends) return PassOn(ends);
  answer.ends = *ends;
  return answer;
}

/// The lens as it stands for this chart: focused as asked, else at the hyperfocal distance.
CameraSystem SystemOf(const DofInput& input, const DofAnswer& answer) {
  const Rational f = input.focal_length.ToRational();
  const Place focus =
      input.focus ? PlaceOf(*input.focus) : Place{Decimal::Shortest(answer.hyperfocal_m).ToRational(), 1};
  return {.model = input.wavelength ? CameraModel::Diffraction : CameraModel::Thin,
          .focal_length = input.focal_length,
          .diameter = f / input.f_number.ToRational(),
          .sensor_distance = f + optics::thin_lens::Extension(f, focus),
          .wavelength = input.wavelength,
          .convention = input.convention};
}

/// Blur over depth with the limit, and what lies below it.
Result<io::Chart> ChartOf(const DofInput& input, const DofAnswer& answer) {
  const BlurUnit unit{input.pixel_um};
  const CameraSystem system = SystemOf(input, answer);
  const double near_d = answer.ends ? answer.ends->near_d : 2.0 / answer.hyperfocal_m;
  const double far_d = answer.ends ? answer.ends->far_d.value_or(0.0) : 0.0;
  const double span = near_d - far_d;
  auto chart = BlurOverDepth(system, Dioptres{std::max(far_d - 0.7 * span, 0.0)}, Dioptres{near_d + 0.7 * span}, unit);
  if (!chart) return chart;
  const std::string ends =
      DistanceText({1.0 / near_d}) + " to " + (far_d > 0.0 ? DistanceText({1.0 / far_d}) : "infinity");
  chart->title = SystemName(system) + ": sharp from " + ends;
  chart->subtitle = (answer.ends ? "hyperfocal distance " : "focused at the hyperfocal distance ") +
                    DistanceText({answer.hyperfocal_m}) + (input.wavelength ? "; with diffraction" : "");
  const double limit = unit.Of(*input.blur_limit.Nearest() * 1e6);
  chart->bars.push_back({.x_low = far_d,
                         .x_high = near_d,
                         .y_low = 0.0,
                         .y_high = limit,
                         .colour = io::PaletteColour(2),
                         .label = "sharp"});
  chart->rules.push_back({.y = limit, .label = "limit " + Short(limit, 4) + " " + unit.Name()});
  return chart;
}

Outcome RunDof(const DofText& text, Session& session) {
  if (auto good = CheckPlot(text.plot); !good) return PassOn(good);
  const auto input = Parse(text, session.globals().from);
  if (!input) return PassOn(input);
  const auto answer = Compute(*input);
  if (!answer) return PassOn(answer);
  if (text.plot.wanted()) {
    const auto chart = ChartOf(*input, *answer);
    if (!chart) return PassOn(chart);
    if (auto drawn = WritePlot(text.plot, io::ChartSvg(*chart)); !drawn) return PassOn(drawn);
  }
  const auto json = [](const std::optional<double>& number) {
    return number ? varlink::Json(*number) : varlink::Json(nullptr);
  };
  const auto& ends = answer->ends;
  if (session.json()) {
    varlink::Json told{{"hyperfocalM", answer->hyperfocal_m}};
    if (ends) {
      told.update({{"nearM", ends->near_m},
                   {"farM", json(ends->far_m)},
                   {"nearD", ends->near_d},
                   {"farD", ends->far_d.value_or(0.0)}});
    }
    session.PrintJson(told);
    return Exit::Done;
  }
  std::vector<std::vector<std::string>> rows;
  if (ends) rows = {{"sharp from", DepthText({ends->near_d})}, {"to", DepthText({ends->far_d.value_or(0.0)})}};
  rows.push_back({"hyperfocal", DistanceText({answer->hyperfocal_m})});
  session.PrintText(TableText(rows) + std::string(OriginLine()));
  return Exit::Done;
}

}  // namespace

void AddDof(CLI::App& root, Run& run) {
  auto text = std::make_shared<DofText>();
  CLI::App* command = root.add_subcommand("dof", "depth of field and hyperfocal distance")->group(kOffline);
  command->add_option("--focal-length", text->focal_length, "focal length, such as 50mm")->required()->type_name("F");
  command->add_option("--f-number", text->f_number, "f-number, such as 2.8 or f/2.8")->required()->type_name("N");
  command
      ->add_option("--focus", text->focus,
                   "distance or vergence in focus: 2m, 0.5D, inf, or hyperfocal; when left out, only the hyperfocal "
                   "distance is given")
      ->type_name("D");
  command->add_option("--blur-limit", text->blur_limit, "blur diameter that still counts as sharp: 8um, or 1px")
      ->required()
      ->type_name("C");
  command->add_option("--pixel", text->pixel, "size of a pixel, for a limit in px")->type_name("LENGTH");
  command->add_option("--wavelength", text->wavelength, "count diffraction at this wavelength, 550nm")->type_name("L");
  command
      ->add_option("--diffraction", text->diffraction, "how the diffraction blur is measured: airy (default) or mtf50")
      ->type_name("KIND");
  AddPlotOptions(*command, text->plot, "blur over depth, the limit and what is sharp");
  command->callback([text, &run] { run = [text](Session& session) { return RunDof(*text, session); }; });
}

}  // namespace lensd::cli
