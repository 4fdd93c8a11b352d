// Reading what is asked of a planner, straight from the message. The first thing wrong is what the caller is told.
#include <array>
#include <initializer_list>
#include <string>

#include "plan_numbers.h"
#include "proto/plan_json.h"

namespace lensd::proto {
namespace {

using varlink::JsonView;

using optics::DiffractionConvention;
using optics::Number;
using optics::Objective;
using optics::PlanDepth;
using optics::Side;

/// Where in the request something is, spelled only when it is wrong: "limits[0].depths[1].oneEnd".
struct Place {
  const Place* inside = nullptr;
  std::string_view name;
  std::size_t index = kNoIndex;
  static constexpr std::size_t kNoIndex = static_cast<std::size_t>(-1);

  std::string Text() const {
    const bool top = inside == nullptr || (inside->inside == nullptr && inside->name.empty());
    std::string text = top ? std::string(name) : inside->Text() + "." + std::string(name);
    if (index != kNoIndex) text += "[" + std::to_string(index) + "]";
    return text;
  }
};

struct FieldError {
  std::string place;
  std::string why;
};
[[noreturn]] void Reject(const Place& place, const std::string& why) {
  throw FieldError{place.Text(), why};
}

/// An object of the request; anything else has no fields.
class Reader {
 public:
  Reader(JsonView json, const Place& place) : json_(json), place_(&place) {}

  std::optional<JsonView> Find(std::string_view key) const {
    return json_.is_object() ? json_.Given(key) : std::nullopt;
  }
  Place At(std::string_view key) const { return {place_, key}; }
  Place At(std::string_view key, std::size_t index) const { return {place_, key, index}; }

 private:
  JsonView json_;
  const Place* place_;
};

double NumberAt(JsonView value, const Place& place) {
  if (!value.is_number()) Reject(place, "must be a number");
  return value.number();
}

void Read(const Reader& reader, std::string_view key, int shift, Number& number) {
  if (const auto value = reader.Find(key)) number = In(NumberAt(*value, reader.At(key)), shift);
}

void Read(const Reader& reader, std::string_view key, int shift, std::optional<Number>& number) {
  if (const auto value = reader.Find(key)) number = In(NumberAt(*value, reader.At(key)), shift);
}

void Read(const Reader& reader, std::string_view key, int shift, std::optional<Metres>& length) {
  if (const auto value = reader.Find(key)) length = Metres{In(NumberAt(*value, reader.At(key)), shift).value};
}

std::string_view TextAt(JsonView value, const Place& place) {
  if (!value.is_string()) Reject(place, "must be a string");
  return value.text();
}

/// Index of the word among `words`; `fallback` where it is absent.
std::size_t Choice(const Reader& reader, std::string_view key, std::initializer_list<std::string_view> words,
                   std::size_t fallback) {
  const auto value = reader.Find(key);
  if (!value) return fallback;
  const std::string_view text = TextAt(*value, reader.At(key));
  std::size_t index = 0;
  std::string choices;
  for (const std::string_view word : words) {
    if (text == word) return index;
    choices.append(index++ == 0 ? "" : ", ").append(word);
  }
  Reject(reader.At(key), "'" + std::string(text) + "' is none of " + choices);
}

PlanDepth ReadDepth(JsonView json, const Place& place) {
  const Reader reader(json, place);
  const auto distance = reader.Find("distanceM"), vergence = reader.Find("vergenceD");
  if (distance.has_value() == vergence.has_value()) Reject(place, "give either distanceM or vergenceD");
  if (distance) return PlanDepth::Distance(NumberAt(*distance, reader.At("distanceM")));
  return PlanDepth::Vergence(NumberAt(*vergence, reader.At("vergenceD")));
}

optics::DepthInterval ReadInterval(JsonView json, const Place& place) {
  const Reader reader(json, place);
  const auto one = reader.Find("oneEnd"), other = reader.Find("otherEnd");
  if (!one || !other) Reject(place, "needs oneEnd and otherEnd");
  return {ReadDepth(*one, reader.At("oneEnd")), ReadDepth(*other, reader.At("otherEnd"))};
}

/// A blur in micrometres or in pixels; nothing where it is not given.
std::optional<Number> ReadBlur(const Reader& reader, const Place& place, const std::optional<Metres>& pixel,
                               std::string_view in_um, std::string_view in_px) {
  const auto um = reader.Find(in_um), px = reader.Find(in_px);
  if (um && px) Reject(reader.At(in_px), "give " + std::string(in_um) + " or this, not both");
  if (um) return In(NumberAt(*um, reader.At(in_um)), kUm);
  if (!px) return std::nullopt;
  if (!pixel) Reject(place, "a blur in pixels needs the size of a pixel: give pixelUm");
  return Number(NumberAt(*px, reader.At(in_px)) * pixel->value);
}

optics::BlurLimit ReadLimit(JsonView json, const Place& place, const std::optional<Metres>& pixel) {
  const Reader reader(json, place);
  optics::BlurLimit limit;
  const auto name = reader.Find("name");
  limit.name = name ? std::string(TextAt(*name, reader.At("name"))) : place.Text();
  if (!reader.Find("kind")) Reject(place, "needs a kind: sharp or blurred");
  const bool sharp = Choice(reader, "kind", {"sharp", "blurred"}, 0) == 0;
  limit.kind = sharp ? optics::LimitKind::Sharp : optics::LimitKind::Blurred;
  constexpr std::array kSides{Side::Either, Side::Behind, Side::Front};
  limit.side = kSides[Choice(reader, "side", {"either", "behind", "front"}, 0)];
  const auto blur = ReadBlur(reader, place, pixel, "limitUm", "limitPx");
  if (!blur && !pixel) Reject(place, "needs limitUm");
  limit.limit = blur.value_or(Number(pixel.value_or(Metres{}).value));
  const auto depths = reader.Find("depths");
  if (!depths || !depths->is_array()) Reject(place, "needs depths, an array");
  for (const JsonView interval : depths->elements()) {
    limit.depths.push_back(ReadInterval(interval, reader.At("depths", limit.depths.size())));
  }
  return limit;
}

void ReadLists(const Reader& reader, optics::PlanRequest& request) {
  if (const auto stops = reader.Find("stops")) {
    if (!stops->is_array()) Reject(reader.At("stops"), "must be an array of numbers");
    const int shift = request.apertures_are_diameters ? kMm : kPlain;
    request.stops.clear();
    for (const JsonView stop : stops->elements()) {
      request.stops.push_back(In(NumberAt(stop, reader.At("stops")), shift));
    }
  }
  request.limits.clear();
  if (const auto limits = reader.Find("limits")) {
    if (!limits->is_array()) Reject(reader.At("limits"), "must be an array");
    for (const JsonView limit : limits->elements()) {
      request.limits.push_back(ReadLimit(limit, reader.At("limits", request.limits.size()), request.pixel));
    }
  }
}

/// What stands for ends that are left out: the largest diameter is the least f-number's.
void AsDiameters(optics::PlanRequest& request) {
  const double f = request.focal_length.value;
  if (!(f > 0.0)) return;
  const auto [low, high] = request.f_numbers;
  if (low.value > 0.0 && high.value > 0.0) request.f_numbers = {f / high.value, f / low.value};
}

void ReadRequest(const Reader& reader, optics::PlanRequest& request) {
  if (const auto diameters = reader.Find("aperturesAreDiameters")) {
    if (!diameters->is_boolean()) Reject(reader.At("aperturesAreDiameters"), "must be true or false");
    if (diameters->boolean() && !request.apertures_are_diameters) AsDiameters(request);
    request.apertures_are_diameters = diameters->boolean();
  }
  const int aperture = request.apertures_are_diameters ? kMm : kPlain;
  Read(reader, "focalLengthMm", kMm, request.focal_length);
  Read(reader, "apertureMin", aperture, request.f_numbers.low);
  Read(reader, "apertureMax", aperture, request.f_numbers.high);
  Read(reader, "extensionMinMm", kMm, request.extensions.low);
  Read(reader, "extensionMaxMm", kMm, request.extensions.high);
  Read(reader, "sensorToleranceUm", kUm, request.sensor_tolerance);
  Read(reader, "fNumberTolerance", kPlain, request.f_number_tolerance);
  Read(reader, "wavelengthNm", kNm, request.wavelength);
  Read(reader, "pupilFactor", kPlain, request.pupil_factor);
  Read(reader, "pixelUm", kUm, request.pixel);
  if (const auto blur = ReadBlur(reader, reader.At("blurLimitPx"), request.pixel, "blurLimitUm", "blurLimitPx")) {
    request.depth_limit = *blur;
  }
  const Place at_model = reader.At("modelTolerancePx");
  if (const auto blur = ReadBlur(reader, at_model, request.pixel, "modelToleranceUm", "modelTolerancePx")) {
    request.model_tolerance = Metres{blur->value};
  }
  if (const auto focus = reader.Find("focus")) request.focus = ReadDepth(*focus, reader.At("focus"));
  const bool airy =
      Choice(reader, "diffraction", {"airy", "mtf50"}, static_cast<std::size_t>(request.diffraction)) == 0;
  request.diffraction = airy ? DiffractionConvention::Airy : DiffractionConvention::Mtf50;
  request.objective =
      static_cast<Objective>(Choice(reader, "objective", {kObjectives[0], kObjectives[1], kObjectives[2]},
                                    static_cast<std::size_t>(request.objective)));
  ReadLists(reader, request);
}

/// What only a lens can answer.
void ReadWishes(const Reader& reader, LensRequest& asked) {
  if (reader.Find("distanceFrom")) {
    constexpr std::array kOrigins{optics::DistanceFrom::Lens, optics::DistanceFrom::Sensor,
                                  optics::DistanceFrom::Front};
    asked.from = kOrigins[Choice(reader, "distanceFrom", {"lens", "sensor", "front"}, 0)];
  }
  const auto left = [&](std::string_view key) { return !reader.Find(key).has_value(); };
  asked.own = {left("extensionMinMm"), left("extensionMaxMm"), left("sensorToleranceUm"), left("fNumberTolerance")};
  if (const auto stack = reader.Find("stack")) {
    if (!stack->is_boolean()) Reject(reader.At("stack"), "must be true or false");
    asked.stack = stack->boolean();
  }
  std::optional<Metres> fixed, shortest, longest;
  Read(reader, "focalLengthMm", kMm, fixed);
  Read(reader, "focalLengthMinMm", kMm, shortest);
  Read(reader, "focalLengthMaxMm", kMm, longest);
  if (shortest.has_value() != longest.has_value()) {
    Reject(reader.At("focalLengthMinMm"), "give focalLengthMaxMm with it, and the other way round");
  }
  if (fixed && shortest) Reject(reader.At("focalLengthMm"), "give one focal length or a range of them, not both");
  if (fixed) asked.focal_lengths = std::pair(*fixed, *fixed);
  if (shortest) asked.focal_lengths = std::minmax(*shortest, *longest);
  Read(reader, "sensorWidthMm", kMm, asked.sensor_width);
  const auto field = reader.Find("field");
  if (!field) return;
  const Place place = reader.At("field");
  const Reader parts(*field, place);
  std::optional<Metres> width, distance;
  Read(parts, "widthM", kPlain, width);
  Read(parts, "distanceM", kPlain, distance);
  if (!width || !distance) Reject(place, "needs widthM and distanceM");
  asked.field = LensRequest::Field{*width, *distance};
}

/// Runs what reads; its complaint is the error.
template <class Read>
Result<void> Reading(JsonView json, Read read) {
  if (!json.is_object()) return Fail(Code::InvalidArgument, "the plan request must be an object");
  try {
    const Place top;
    read(Reader(json, top));
  } catch (const FieldError& wrong) {
    return Fail(Code::InvalidArgument, wrong.place + ": " + wrong.why, {.parameter = "request." + wrong.place});
  }
  return {};
}

}  // namespace

Result<optics::PlanRequest> PlanRequestFromJson(JsonView json, optics::PlanRequest defaults) {
  const auto read = Reading(json, [&](const Reader& reader) { ReadRequest(reader, defaults); });
  if (!read) return PassOn(read);
  return defaults;
}

Result<LensRequest> LensRequestFromJson(JsonView json, const optics::PlanRequest& defaults) {
  LensRequest asked{.plan = defaults};
  const auto read = Reading(json, [&](const Reader& reader) {
    ReadRequest(reader, asked.plan);
    ReadWishes(reader, asked);
  });
  if (!read) return PassOn(read);
  return asked;
}

}  // namespace lensd::proto
