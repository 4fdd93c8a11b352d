// The planner names fields as the interface does, but knows only what became of the request: which of two fields said a
// depth or a blur, and which ends were left to the lens, is read from the call.
#include "planning/request_fault.h"

#include <charconv>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "optics/decimal.h"
#include "planning/zoom_choice.h"

namespace lensd::daemon {
namespace {

using varlink::JsonView;

/// The element that `path` begins with, "[2].oneEnd", which is cut off it.
std::optional<JsonView> TakeElement(JsonView list, std::string_view& path) {
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(path.data() + 1, path.data() + path.size(), index);
  path.remove_prefix(static_cast<std::size_t>(end - path.data()) + 1);
  if (!list.is_array()) return std::nullopt;
  for (const JsonView element : list.elements()) {
    if (index-- == 0) return element;
  }
  return std::nullopt;
}

/// What the request has at a path such as "limits[0].depths[1].oneEnd"; nothing: it says nothing there.
std::optional<JsonView> PartAt(JsonView json, std::string_view path) {
  std::optional<JsonView> part = json;
  while (part && !path.empty()) {
    if (path.starts_with('[')) {
      part = TakeElement(*part, path);
      continue;
    }
    if (path.starts_with('.')) path.remove_prefix(1);
    const std::string_view name = path.substr(0, path.find_first_of(".["));
    path.remove_prefix(name.size());
    part = part->is_object() ? part->Given(name) : std::nullopt;
  }
  return part;
}

/// Of several fields that say the same thing, the one that was written.
std::string AsWritten(const std::string& path, JsonView request) {
  if (const auto part = PartAt(request, path)) {
    const bool is_depth = path == "focus" || path.ends_with("End");
    for (const std::string_view depth : {"distanceM", "vergenceD"}) {
      if (is_depth && part->Given(depth)) return path + "." + std::string(depth);
    }
    return path;
  }
  if (path == "focalLengthMm" && request.Given("focalLengthMinMm")) return "focalLengthMinMm";
  if (!path.ends_with("Um")) return path;
  const std::string in_pixels = path.substr(0, path.size() - 2) + "Px";
  return PartAt(request, in_pixels) ? in_pixels : path;
}

/// A range of the request, its fields, and the shift of their decimal point from metres.
struct RangeFields {
  std::string_view low, high, what;
  std::string unit;
  int shift = 0;
};

std::optional<Error> EmptyAmong(const RangeFields& fields, JsonView request, const optics::NumberRange& asked,
                                const optics::NumberRange& own) {
  if (asked.low.value <= asked.high.value) return std::nullopt;
  const auto told = [&](const optics::Number& number) {
    return optics::Decimal::Shortest(number.value).Shifted(fields.shift).Nearest();
  };
  const bool low = request.Given(fields.low).has_value(), high = request.Given(fields.high).has_value();
  const std::string empty = "the range of " + std::string(fields.what) + " is empty: ";
  if (low && high) {
    return Fail(Code::InvalidArgument, empty + "its low end is above its high end",
                {.parameter = "request." + std::string(fields.low), .maximum = told(asked.high), .unit = fields.unit})
        .error();
  }
  std::ostringstream lens;
  lens << "this lens has " << *told(own.low) << " to " << *told(own.high) << (fields.unit == "mm" ? " mm" : "");
  return Fail(Code::OutOfRange, empty + lens.str(),
              {.parameter = "request." + std::string(low ? fields.low : fields.high),
               .minimum = told(own.low),
               .maximum = told(own.high),
               .unit = fields.unit})
      .error();
}

/// The aperture diameters of a range of f-numbers.
optics::NumberRange Diameters(const optics::NumberRange& f_numbers, double focal_length) {
  return {focal_length / f_numbers.high.value, focal_length / f_numbers.low.value};
}

}  // namespace

std::optional<Error> EmptyRange(const proto::LensRequest& asked, JsonView request, const optics::PlanRequest& own) {
  const optics::PlanRequest& plan = asked.plan;
  if (plan.stops.empty()) {
    auto empty = plan.apertures_are_diameters
                     ? EmptyAmong({"apertureMin", "apertureMax", "aperture diameters", "mm", 3}, request,
                                  plan.f_numbers, Diameters(own.f_numbers, own.focal_length.value))
                     : EmptyAmong({"apertureMin", "apertureMax", "f-numbers", "fNumber", 0}, request, plan.f_numbers,
                                  own.f_numbers);
    if (empty) return empty;
  }
  return EmptyAmong({"extensionMinMm", "extensionMaxMm", "extensions", "mm", 3}, request, plan.extensions,
                    own.extensions);
}

Error AsAsked(const Error& error, JsonView request) {
  ErrorFacts facts = error.facts ? *error.facts : ErrorFacts{};
  if (facts.parameter.empty()) {
    facts.parameter = "request";
  } else if (!facts.parameter.starts_with("request.")) {
    facts.parameter = "request." + AsWritten(facts.parameter, request);
  }
  return Fail(error.code, error.message, std::move(facts)).error();
}

Error WithReach(const Error& error, const proto::LensRequest& asked, const Planning& planning) {
  if (error.code != Code::OutOfRange || !error.facts || error.facts->parameter != "focus" || !asked.plan.focus) {
    return error;
  }
  ErrorFacts facts = *error.facts;
  const auto& [farthest, nearest] = std::tie(planning.positions.focus.front(), planning.positions.focus.back());
  if (asked.plan.focus->is_vergence) {
    facts.minimum = farthest.focal_plane.value;
    facts.maximum = nearest.focal_plane.value;
    facts.unit = "D";
    return Fail(error.code, error.message, std::move(facts)).error();
  }
  const auto distance = [&](const optics::FocusPosition& position) -> std::optional<double> {
    const double vergence = position.focal_plane.value;
    if (!(vergence > 0.0)) return std::nullopt;
    return 1.0 / vergence + OriginOf(planning.scale, asked).At(position).value;
  };
  facts.minimum = distance(nearest);
  facts.maximum = distance(farthest);
  facts.unit = "m";
  return Fail(error.code, error.message, std::move(facts)).error();
}

}  // namespace lensd::daemon
