// The options of `plan` and `stack` into a question for the planner. Numbers stay decimal until the last moment.
#include "cli/plan/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <utility>

#include "cli/lens_options.h"
#include "cli/plan/reading.h"
#include "optics/focus_scale.h"
#include "optics/framing.h"
#include "optics/plan_causes.h"

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
  if (!value) return PassOn(value);
  place(*std::move(value));
  return {};
}

/// Settles the focal length of a zoom by what it shall frame.
Result<void> FrameField(const PlanText& text, const Span<Decimal>& zoom, const optics::FocusScale& scale,
                        Reading& reading) {
  if (text.field.empty() || text.sensor_width.empty()) {
    return Usage("--focal-length '" + text.focal_length +
                 "' leaves the focal length open: give one, or say what to frame with --field WIDTH@DISTANCE and "
                 "--sensor-width W");
  }
  const auto typed = ParseField(text.field, "--field");
  if (!typed) return PassOn(typed);
  const optics::Field field{Metres{typed->width.Nearest().value()}, Metres{typed->distance.Nearest().value()}, scale};
  const auto width = ParsePositiveLength(text.sensor_width, "--sensor-width");
  if (!width) return PassOn(width);
  const Metres sensor_width{width->Nearest().value()};
  const auto f =
      optics::FramingFocalLength(field, sensor_width, {{zoom.low.Nearest().value()}, {zoom.high.Nearest().value()}});
  if (!f) return PassOn(f);
  const auto place = optics::DepthInFocus(scale, *f, field.distance);
  if (!place) return PassOn(place);
  reading.focal_length = Decimal::Shortest(f->value);
  reading.framing = Framing{sensor_width, place->distance().value_or(field.distance)};
  return {};
}

Result<void> ReadFocalLength(const PlanText& text, const optics::FocusScale& scale, Reading& reading) {
  if (text.focal_length.empty()) return Usage("--focal-length is required, such as 50mm");
  const auto range = ParseLengthRange(text.focal_length, "--focal-length");
  if (!range) return PassOn(range);
  if (!range->low.IsPositive()) return Usage("--focal-length '" + text.focal_length + "': must be greater than zero");
  if (range->low < range->high) return FrameField(text, *range, scale, reading);
  reading.focal_length = range->low;
  if (text.field.empty() && text.sensor_width.empty()) return {};
  return Usage("--field and --sensor-width choose the focal length of a zoom: write --focal-length A..B");
}

Result<void> ReadOpenings(const PlanText& text, PlanRequest& request) {
  if (!text.f_number.empty() && !text.aperture_diameter.empty()) {
    return Usage("give the opening once: --f-number or --aperture-diameter, such as --f-number 2.8");
  }
  request.apertures_are_diameters = !text.aperture_diameter.empty();
  if (text.f_number.empty() && text.aperture_diameter.empty()) {
    return Usage("--f-number is required, such as 1.4..22 or 1.4,2,2.8 (or --aperture-diameter)");
  }
  const auto openings = request.apertures_are_diameters ? ParseDiameters(text.aperture_diameter, "--aperture-diameter")
                                                        : ParseFNumbers(text.f_number, "--f-number");
  if (!openings) return PassOn(openings);
  request.f_numbers = RangeOf(openings->range);
  for (const Decimal& stop : openings->stops) request.stops.push_back(NumberOf(stop));
  return {};
}

Result<void> ReadExtensions(const PlanText& text, const Decimal& focal_length, PlanRequest& request) {
  if (!text.extension.empty() && !text.sensor_distance.empty()) {
    return Usage("say once where the sensor may stand: --extension or --sensor-distance");
  }
  if (text.extension.empty() && text.sensor_distance.empty()) {
    return Usage("--extension is required, such as 0mm..8mm (or --sensor-distance)");
  }
  const bool direct = !text.extension.empty();
  auto range = direct ? ParseLengthRange(text.extension, "--extension")
                      : ParseLengthRange(text.sensor_distance, "--sensor-distance");
  if (!range) return PassOn(range);
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
    return Usage("--objective depth needs --focus and --blur-limit, such as --focus 2m --blur-limit 20um");
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

Result<void> ReadTolerances(const PlanText& text, PlanRequest& request) {
  auto done = Optional(text.sensor_tolerance, "--sensor-tolerance", ParseExactLength,
                       [&](const Decimal& length) { request.sensor_tolerance = NumberOf(length); });
  if (!done) return done;
  done = Optional(text.f_number_tolerance, "--f-number-tolerance", ParsePercent,
                  [&](const Decimal& ratio) { request.f_number_tolerance = NumberOf(ratio); });
  if (!done) return done;
  return Optional(text.pupil_factor, "--pupil-factor", ParseNumber,
                  [&](const Decimal& factor) { request.pupil_factor = NumberOf(factor); });
}

/// The blur of each limit; one pixel where none is given.
Result<void> ReadBlurs(Reading& reading) {
  for (const NamedLimit& limit : reading.limits) {
    const std::string option = limit.kind == LimitKind::Sharp ? "--sharp" : "--blurred";
    if (!limit.written.limit && !reading.pixel) {
      return Usage(option + " '" + limit.text + "': add a blur limit such as :8um, or give --pixel for 1px");
    }
    const BlurSize blur = limit.written.limit.value_or(BlurSize{Decimal(1, 0), true});
    auto metres = BlurInMetres(blur, limit.text, reading.pixel, option);
    if (!metres) return PassOn(metres);
    reading.blurs.push_back(*std::move(metres));
  }
  return {};
}

Result<Reading> ReadOptions(const PlanText& text, const optics::FocusScale& scale) {
  Reading reading;
  PlanRequest& request = reading.request;
  reading.in_focus = text.stack;
  auto done =
      Optional(text.pixel, "--pixel", ParsePositiveLength, [&](const Decimal& length) { reading.pixel = length; });
  if (done) done = ReadFocalLength(text, scale, reading);
  if (done) done = ReadOpenings(text, request);
  if (done) done = ReadExtensions(text, reading.focal_length, request);
  if (done) done = Optional(text.focus, "--focus", ParseDepth, [&](const Depth& depth) { reading.focus = depth; });
  if (done) done = ReadDiffraction(text, request);
  if (done) done = ReadObjective(text, reading.pixel, request);
  if (done) done = ReadTolerances(text, request);
  if (!done) return PassOn(done);
  auto limits = NamedLimits(text);
  if (!limits) return PassOn(limits);
  reading.limits = *std::move(limits);
  done = ReadBlurs(reading);
  if (!done) return PassOn(done);
  auto classes = ReadClasses(text, reading.limits);
  if (!classes) return PassOn(classes);
  reading.classes = *std::move(classes);
  request.focal_length = NumberOf(reading.focal_length);
  if (reading.pixel) request.pixel = Metres{reading.pixel->Nearest().value()};
  return reading;
}

}  // namespace

Result<FieldText> ParseField(std::string_view text, std::string_view option) {
  const auto at = text.find('@');
  if (at == std::string_view::npos) return Wrong(option, text, "write WIDTH@DISTANCE, such as 1.2m@3m");
  auto width = ParsePositiveLength(text.substr(0, at), option);
  if (!width) return PassOn(width);
  auto distance = ParsePositiveLength(text.substr(at + 1), option);
  if (!distance) return PassOn(distance);
  return FieldText{*std::move(width), *std::move(distance)};
}

Result<std::vector<NamedLimit>> NamedLimits(const PlanText& text) {
  std::vector<NamedLimit> limits;
  for (const LimitKind kind : {LimitKind::Sharp, LimitKind::Blurred}) {
    const auto& texts = kind == LimitKind::Sharp ? text.sharp : text.blurred;
    const std::string prefix = kind == LimitKind::Sharp ? "sharp" : "blurred";
    for (std::size_t i = 0; i < texts.size(); ++i) {
      auto written = ParseLimit(texts[i], kind);
      if (!written) return PassOn(written);
      if (written->name.empty()) written->name = prefix + "[" + std::to_string(i) + "]";
      limits.push_back({*std::move(written), texts[i], kind});
    }
  }
  return limits;
}

BlurUnits UnitsOf(const std::vector<NamedLimit>& limits, std::optional<Metres> pixel) {
  BlurUnits units{pixel, {}};
  for (const NamedLimit& limit : limits) {
    const bool in_pixels = !limit.written.limit || limit.written.limit->in_pixels;
    if (pixel && in_pixels) units.in_pixels.insert(limit.written.name);
  }
  return units;
}

Result<std::map<int, OccupiedDepths>> ReadClasses(const PlanText& text, const std::vector<NamedLimit>& limits) {
  std::vector<WantedClass> wanted;
  for (const NamedLimit& limit : limits) {
    const auto* mask_class = std::get_if<MaskClass>(&limit.written.where);
    if (mask_class == nullptr) continue;
    auto known = std::ranges::find(wanted, mask_class->number, &WantedClass::number);
    if (known == wanted.end()) known = wanted.insert(known, {.number = mask_class->number});
    known->every_depth = known->every_depth || MayLieOnBothSides(limit);
  }
  if (text.depth_map.empty()) {
    if (!wanted.empty())
      return Usage("classes such as @" + std::to_string(wanted[0].number) + " need --depth-map F.png");
    if (!text.mask.empty()) return Usage("--mask needs --depth-map F.png");
    return std::map<int, OccupiedDepths>();
  }
  if (wanted.empty()) return Usage("--depth-map: no limit uses it; write --sharp @1 for class 1 of the mask");
  return ReadDepthClasses(text.depth_map, text.mask, wanted);
}

Result<PlanQuestion> ReadPlan(const PlanText& text, std::optional<From> from) {
  const optics::FocusScale scale = ScaleOf(from);
  const auto reading = ReadOptions(text, scale);
  if (!reading) return PassOn(reading);
  auto request = RequestFromCentre(*reading, scale);
  if (!request) return PassOn(request);
  BlurUnits units = UnitsOf(reading->limits, request->pixel);
  PlanQuestion question{*std::move(request), reading->framing, std::move(units)};
  if (scale.from != optics::DistanceFrom::Sensor || reading->in_focus) return question;
  auto moving = MeasuredFromSensor(*reading, scale);
  if (!moving) return PassOn(moving);
  if (optics::Moves(moving->request)) question.moving = *std::move(moving);
  return question;
}

Result<optics::PlanAnswer> AnswerTo(const PlanQuestion& question) {
  auto answer = optics::Plan(question.request);
  if (!answer || answer->feasible) return answer;
  answer->causes = optics::CausesInRequest(question.request, optics::PlanIfAny);
  if (!question.moving) return answer;
  answer->conflict = optics::MovingConflict(*question.moving, answer->conflict);
  return answer;
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
  add("--focal-length", text.focal_length, "F", "such as 50mm, or 24mm..70mm for a zoom with --field")->group(lens);
  add("--f-number", text.f_number, "N", "range 1.4..22, or the stops 1.4,2,2.8")->group(lens);
  add("--aperture-diameter", text.aperture_diameter, "A", "diameters instead of f-numbers, such as 3mm..20mm")
      ->group(lens);
  add("--extension", text.extension, "E", "sensor distance beyond the focal length, 0mm..8mm")->group(lens);
  add("--sensor-distance", text.sensor_distance, "Z", "sensor distance from the lens centre instead, 50mm..58mm")
      ->group(lens);
  add("--pixel", text.pixel, "SIZE", "size of a pixel, for limits in px")->group(lens);
  add("--pupil-factor", text.pupil_factor, "P", "exit over entrance pupil diameter (default 1)")->group(lens);
  add("--field", text.field, "W@D", "zoom: fill the frame with a field W wide at distance D")->group(lens);
  add("--sensor-width", text.sensor_width, "W", "zoom: width of the sensor")->group(lens);
  add_limits("--sharp", text.sharp, "[NAME=]WHERE[:LIMIT], blur at most LIMIT everywhere in WHERE; repeatable");
  add_limits("--blurred", text.blurred, "[NAME=]WHERE[:LIMIT][:behind|:front], blur at least LIMIT; repeatable");
  add("--depth-map", text.depth_map, "F.png", "depths in mm, 16-bit grey PNG, 0 where unknown")
      ->group("What must be sharp or blurred");
  add("--mask", text.mask, "F.png",
      "classes of the depth map's pixels, 8-bit grey PNG, 0 ignored; without a mask all pixels are @1")
      ->group("What must be sharp or blurred");
  const char* const wanted = "What is wanted";
  add("--focus", text.focus, "D", "keep the focal plane at this distance or vergence")->group(wanted);
  add("--objective", text.objective, "WHAT",
      "light: smallest f-number (default); sharp: smallest blur relative to the limits; depth: greatest depth of "
      "field, with --focus and --blur-limit")
      ->group(wanted);
  add("--blur-limit", text.blur_limit, "C", "blur that still counts as sharp, for --objective depth")->group(wanted);
  command.add_flag("--stack", text.stack, "the fewest shots that together keep every sharp limit")->group(wanted);
  AddPlotOptions(command, text.plot,
                 "the settings that meet the limits, and blur against vergence; for a stack the depths of its shots",
                 wanted);
  AddRaysOption(command, text.rays, wanted);
  const char* const certain = "Tolerances and diffraction";
  add("--sensor-tolerance", text.sensor_tolerance, "T", "the sensor is within this of its position, 2um")
      ->group(certain);
  add("--f-number-tolerance", text.f_number_tolerance, "T", "the f-number is within this of its value, 2%")
      ->group(certain);
  add("--wavelength", text.wavelength, "L", "count diffraction at this wavelength, 550nm")->group(certain);
  add("--diffraction", text.diffraction, "KIND", "diffraction blur: airy (default) or mtf50")->group(certain);
  add("--model-tolerance", text.model_tolerance, "T",
      "largest error of the camera model (default: a tenth of the tightest limit, or a quarter pixel if larger)")
      ->group(certain);
  command.footer(
      "WHERE is NEAR..FAR, one distance or vergence, plane(U0,UX,UY) (vergence U0 + UX x + UY y in dioptres, x and y "
      "in\n"
      "[-1,1] across the frame) or @K (class K of the mask). LIMIT is a blur diameter on the sensor, 8um or 1.5px; "
      "1px\n"
      "when left out. NAME is the name of the limit in the answer.");
}

}  // namespace lensd::cli
