#include "cli/plan/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <utility>

#include "cli/lens_options.h"
#include "cli/plan/reading.h"
#include "optics/focus_scale.h"
#include "optics/framing.h"

namespace lensd::cli {
namespace {

using optics::LimitKind;
using optics::PlanRequest;

std::unexpected<Error> Usage(std::string message) {
  return Fail(Code::InvalidArgument, std::move(message));
}

optics::NumberRange RangeOf(const Span<Decimal>& span) {
  return {NumberOf(span.low), NumberOf(span.high)};
}

/// Parses an option into `place` where it is given.
template <class Parse, class Place>
Result<void> Optional(const std::string& text, std::string_view option, Parse parse, Place place) {
  if (text.empty()) return {};
  auto value = parse(text, option);
  if (!value) return PassOn(std::move(value));
  place(*std::move(value));
  return {};
}

/// `W@D`: a field W wide at distance D.
Result<optics::Field> ParseField(const std::string& text, const optics::FocusScale& scale) {
  const auto at = text.find('@');
  if (at == std::string::npos) return Usage("--field '" + text + "': write WIDTH@DISTANCE, such as 1.2m@3m");
  const auto width = ParsePositiveLength(text.substr(0, at), "--field");
  if (!width) return std::unexpected(width.error());
  const auto distance = ParsePositiveLength(text.substr(at + 1), "--field");
  if (!distance) return std::unexpected(distance.error());
  return optics::Field{Metres{width->Nearest().value()}, Metres{distance->Nearest().value()}, scale};
}

/// Settles the focal length of a zoom by what it shall frame.
Result<void> FrameField(const PlanText& text, const Span<Decimal>& zoom, const optics::FocusScale& scale,
                        Reading& reading) {
  if (text.field.empty() || text.sensor_width.empty()) {
    return Usage("--focal-length '" + text.focal_length +
                 "' leaves the focal length open: give one, or say what to frame with --field WIDTH@DISTANCE and "
                 "--sensor-width W");
  }
  const auto field = ParseField(text.field, scale);
  if (!field) return std::unexpected(field.error());
  const auto width = ParsePositiveLength(text.sensor_width, "--sensor-width");
  if (!width) return std::unexpected(width.error());
  const Metres sensor_width{width->Nearest().value()};
  const auto f =
      optics::FramingFocalLength(*field, sensor_width, {{zoom.low.Nearest().value()}, {zoom.high.Nearest().value()}});
  if (!f) return std::unexpected(f.error());
  const auto place = optics::DepthInFocus(scale, *f, field->distance);
  if (!place) return std::unexpected(place.error());
  reading.focal_length = Decimal::Shortest(f->value);
  reading.framing = Framing{sensor_width, place->distance().value_or(field->distance)};
  return {};
}

Result<void> ReadFocalLength(const PlanText& text, const PlanDefaults& defaults, const optics::FocusScale& scale,
                             Reading& reading) {
  if (text.focal_length.empty()) {
    if (!defaults.focal_length) return Usage("--focal-length is required, such as 50mm");
    reading.focal_length = *defaults.focal_length;
  } else {
    const auto range = ParseLengthRange(text.focal_length, "--focal-length");
    if (!range) return std::unexpected(range.error());
    if (!range->low.IsPositive()) return Usage("--focal-length '" + text.focal_length + "': must be greater than zero");
    if (range->low < range->high) return FrameField(text, *range, scale, reading);
    reading.focal_length = range->low;
  }
  if (text.field.empty() && text.sensor_width.empty()) return {};
  return Usage("--field and --sensor-width choose the focal length of a zoom: write --focal-length A..B");
}

Result<void> ReadOpenings(const PlanText& text, const PlanDefaults& defaults, PlanRequest& request) {
  if (!text.f_number.empty() && !text.aperture_diameter.empty()) {
    return Usage("give the opening once: --f-number or --aperture-diameter");
  }
  request.apertures_are_diameters = !text.aperture_diameter.empty();
  if (text.f_number.empty() && text.aperture_diameter.empty()) {
    if (!defaults.f_numbers)
      return Usage("--f-number is required, such as 1.4..22 or 1.4,2,2.8 (or --aperture-diameter)");
    request.f_numbers = RangeOf(*defaults.f_numbers);
    return {};
  }
  const auto openings = request.apertures_are_diameters ? ParseDiameters(text.aperture_diameter, "--aperture-diameter")
                                                        : ParseFNumbers(text.f_number, "--f-number");
  if (!openings) return std::unexpected(openings.error());
  request.f_numbers = RangeOf(openings->range);
  for (const Decimal& stop : openings->stops) request.stops.push_back(NumberOf(stop));
  return {};
}

Result<void> ReadExtensions(const PlanText& text, const PlanDefaults& defaults, const Decimal& focal_length,
                            PlanRequest& request) {
  if (!text.extension.empty() && !text.sensor_distance.empty()) {
    return Usage("say once where the sensor may stand: --extension or --sensor-distance");
  }
  if (text.extension.empty() && text.sensor_distance.empty()) {
    if (!defaults.extensions) return Usage("--extension is required, such as 0mm..8mm (or --sensor-distance)");
    request.extensions = RangeOf(*defaults.extensions);
    return {};
  }
  const bool direct = !text.extension.empty();
  auto range = direct ? ParseLengthRange(text.extension, "--extension")
                      : ParseLengthRange(text.sensor_distance, "--sensor-distance");
  if (!range) return PassOn(std::move(range));
  if (!direct) range = Span<Decimal>{range->low - focal_length, range->high - focal_length};
  request.extensions = RangeOf(*range);
  return {};
}

Result<void> ReadDiffraction(const PlanText& text, PlanRequest& request) {
  auto done = Optional(text.wavelength, "--wavelength", ParsePositiveLength,
                       [&](const Decimal& length) { request.wavelength = NumberOf(length); });
  if (!done || text.diffraction.empty()) return done;
  if (!request.wavelength) return Usage("--diffraction needs --wavelength, such as 550nm");
  if (text.diffraction != "airy" && text.diffraction != "mtf50") {
    return Usage("--diffraction '" + text.diffraction + "': say airy or mtf50");
  }
  request.diffraction =
      text.diffraction == "airy" ? optics::DiffractionConvention::Airy : optics::DiffractionConvention::Mtf50;
  return {};
}

Result<void> ReadObjective(const PlanText& text, const std::optional<Decimal>& pixel, PlanRequest& request) {
  constexpr std::string_view kNames[] = {"light", "sharp", "depth"};
  if (!text.objective.empty()) {
    const auto* found = std::ranges::find(kNames, text.objective);
    if (found == std::end(kNames)) return Usage("--objective '" + text.objective + "': say light, sharp or depth");
    request.objective = static_cast<optics::Objective>(found - kNames);
  }
  const bool depth = request.objective == optics::Objective::Depth;
  if (depth && (text.focus.empty() || text.blur_limit.empty())) {
    return Usage("--objective depth needs --focus and --blur-limit");
  }
  if (!depth && !text.blur_limit.empty()) return Usage("--blur-limit is for --objective depth");
  const auto limit = [&pixel](std::string_view value, std::string_view option) {
    return ParseBlurLimit(value, pixel, option);
  };
  auto done = Optional(text.blur_limit, "--blur-limit", limit,
                       [&](const Decimal& length) { request.depth_limit = NumberOf(length); });
  if (!done) return done;
  return Optional(text.model_tolerance, "--model-tolerance", limit,
                  [&](const Decimal& length) { request.model_tolerance = Metres{length.Nearest().value()}; });
}

Result<void> ReadTolerances(const PlanText& text, const PlanDefaults& defaults, PlanRequest& request) {
  auto done = Optional(text.sensor_tolerance, "--sensor-tolerance", ParseExactLength,
                       [&](const Decimal& length) { request.sensor_tolerance = NumberOf(length); });
  if (!done) return done;
  done = Optional(text.f_number_tolerance, "--f-number-tolerance", ParsePercent,
                  [&](const Decimal& ratio) { request.f_number_tolerance = NumberOf(ratio); });
  if (!done) return done;
  if (defaults.pupil_factor) request.pupil_factor = NumberOf(*defaults.pupil_factor);
  return Optional(text.pupil_factor, "--pupil-factor", ParseNumber,
                  [&](const Decimal& factor) { request.pupil_factor = NumberOf(factor); });
}

/// Reads the limits and settles their names: as given, or by their place among the options of their kind.
Result<void> ReadLimits(const std::vector<std::string>& texts, LimitKind kind, Reading& reading) {
  const std::string prefix = kind == LimitKind::Sharp ? "sharp" : "blurred";
  for (std::size_t i = 0; i < texts.size(); ++i) {
    auto written = ParseLimit(texts[i], kind, reading.pixel);
    if (!written) return PassOn(std::move(written));
    if (written->name.empty()) written->name = prefix + "[" + std::to_string(i) + "]";
    if (!written->limit && !reading.pixel) {
      return Usage("--" + prefix + " '" + texts[i] + "': add a blur limit such as :8um, or give --pixel for 1px");
    }
    if (!written->limit) written->limit = reading.pixel;
    reading.limits.push_back({*std::move(written), kind});
  }
  return {};
}

/// Reads the depth map where limits speak of its classes.
Result<void> ReadClasses(const PlanText& text, Reading& reading) {
  std::vector<WantedClass> wanted;
  for (const NamedLimit& limit : reading.limits) {
    const auto* mask_class = std::get_if<MaskClass>(&limit.written.where);
    if (mask_class == nullptr) continue;
    auto known = std::ranges::find(wanted, mask_class->number, &WantedClass::number);
    if (known == wanted.end()) known = wanted.insert(known, {.number = mask_class->number});
    known->every_depth = known->every_depth || MayLieOnBothSides(limit);
  }
  if (text.depth_map.empty()) {
    if (!wanted.empty())
      return Usage("classes such as @" + std::to_string(wanted[0].number) + " need --depth-map F.png");
    return text.mask.empty() ? Result<void>() : Usage("--mask needs --depth-map F.png");
  }
  if (wanted.empty()) return Usage("--depth-map: no limit uses it; write --sharp @1 for class 1 of the mask");
  auto classes = ReadDepthClasses(text.depth_map, text.mask, wanted);
  if (!classes) return PassOn(std::move(classes));
  reading.classes = *std::move(classes);
  return {};
}

Result<Reading> ReadOptions(const PlanText& text, const PlanDefaults& defaults, const optics::FocusScale& scale) {
  Reading reading;
  PlanRequest& request = reading.request;
  reading.pixel = defaults.pixel;
  reading.in_focus = text.stack;
  auto done =
      Optional(text.pixel, "--pixel", ParsePositiveLength, [&](const Decimal& length) { reading.pixel = length; });
  if (done) done = ReadFocalLength(text, defaults, scale, reading);
  if (done) done = ReadOpenings(text, defaults, request);
  if (done) done = ReadExtensions(text, defaults, reading.focal_length, request);
  if (done) done = Optional(text.focus, "--focus", ParseDepth, [&](const Depth& depth) { reading.focus = depth; });
  if (done) done = ReadDiffraction(text, request);
  if (done) done = ReadObjective(text, reading.pixel, request);
  if (done) done = ReadTolerances(text, defaults, request);
  if (done) done = ReadLimits(text.sharp, LimitKind::Sharp, reading);
  if (done) done = ReadLimits(text.blurred, LimitKind::Blurred, reading);
  if (done) done = ReadClasses(text, reading);
  if (!done) return PassOn(std::move(done));
  request.focal_length = NumberOf(reading.focal_length);
  if (reading.pixel) request.pixel = Metres{reading.pixel->Nearest().value()};
  return reading;
}

}  // namespace

Result<PlanQuestion> ReadPlan(const PlanText& text, const PlanDefaults& defaults, std::optional<From> from) {
  const optics::FocusScale scale = ScaleOf(from, defaults.principal_gap);
  const auto reading = ReadOptions(text, defaults, scale);
  if (!reading) return std::unexpected(reading.error());
  auto request = RequestFromCentre(*reading, scale);
  if (!request) return PassOn(std::move(request));
  return PlanQuestion{*std::move(request), defaults.principal_gap, reading->framing};
}

void AddPlanOptions(CLI::App& command, PlanText& text) {
  const auto add = [&command](const char* name, std::string& place, const char* type, const char* help) {
    return command.add_option(name, place, help)->type_name(type);
  };
  const auto add_limits = [&command](const char* name, std::vector<std::string>& place, const char* help) {
    command.add_option(name, place, help)
        ->type_name("LIMIT")
        ->allow_extra_args(false)
        ->group("What must be sharp or blurred");
  };
  const char* const lens = "The lens";
  add("--focal-length", text.focal_length, "F", "50mm; of a zoom 24mm..70mm, with --field")->group(lens);
  add("--f-number", text.f_number, "N", "range 1.4..22, or the stops 1.4,2,2.8")->group(lens);
  add("--aperture-diameter", text.aperture_diameter, "A", "the same as diameters, such as 3mm..20mm")->group(lens);
  add("--extension", text.extension, "E", "sensor distance beyond the focal length, 0mm..8mm")->group(lens);
  add("--sensor-distance", text.sensor_distance, "Z", "the same from the lens centre, 50mm..58mm")->group(lens);
  add("--pixel", text.pixel, "SIZE", "size of a pixel, for limits in px")->group(lens);
  add("--pupil-factor", text.pupil_factor, "P", "exit over entrance pupil diameter (default 1)")->group(lens);
  add("--field", text.field, "W@D", "zoom: frame a field W wide at distance D")->group(lens);
  add("--sensor-width", text.sensor_width, "W", "zoom: width of the sensor")->group(lens);
  add_limits("--sharp", text.sharp, "[NAME=]WHERE[:LIMIT], blur at most LIMIT everywhere in WHERE; repeatable");
  add_limits("--blurred", text.blurred, "[NAME=]WHERE[:LIMIT][:behind|:front], blur at least LIMIT; repeatable");
  add("--depth-map", text.depth_map, "F.png", "depths in mm, 16-bit grey PNG, 0 where unknown")
      ->group("What must be sharp or blurred");
  add("--mask", text.mask, "F.png",
      "classes of the depth map's pixels, 8-bit grey PNG, 0 ignored; without it all are @1")
      ->group("What must be sharp or blurred");
  const char* const wanted = "What is wanted";
  add("--focus", text.focus, "D", "keep the focal plane at this distance or vergence")->group(wanted);
  add("--objective", text.objective, "WHAT",
      "light: smallest f-number (default); sharp: smallest blur against the limits; depth: with --focus and "
      "--blur-limit, the greatest depth of field")
      ->group(wanted);
  add("--blur-limit", text.blur_limit, "C", "blur that still counts as sharp, for --objective depth")->group(wanted);
  command.add_flag("--stack", text.stack, "the fewest shots that together keep every sharp limit")->group(wanted);
  add("--plot", text.plot, "F.svg", "draw the settings that meet the limits, and blur against vergence")->group(wanted);
  const char* const certain = "What must be counted with";
  add("--sensor-tolerance", text.sensor_tolerance, "T", "the sensor stands within this of where it should, 2um")
      ->group(certain);
  add("--f-number-tolerance", text.f_number_tolerance, "T", "the f-number is within this of its value, 2%")
      ->group(certain);
  add("--wavelength", text.wavelength, "L", "count diffraction at this wavelength, 550nm")->group(certain);
  add("--diffraction", text.diffraction, "KIND", "its convention: airy (default) or mtf50")->group(certain);
  add("--model-tolerance", text.model_tolerance, "T",
      "what the camera model may leave out (default: a tenth of the tightest limit, or a quarter pixel if larger)")
      ->group(certain);
  command.footer(
      "WHERE is NEAR..FAR, one distance or vergence, plane(U0,UX,UY) (vergence U0 + UX x + UY y in dioptres, x and y "
      "in\n"
      "[-1,1] across the frame) or @K (class K of the mask). LIMIT is a blur diameter on the sensor, 8um or 1.5px; "
      "1px\n"
      "when left out. NAME says what answers shall call it.");
}

}  // namespace lensd::cli
