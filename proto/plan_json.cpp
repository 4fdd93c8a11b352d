#include "proto/plan_json.h"

#include <charconv>
#include <cmath>
#include <initializer_list>
#include <numbers>

#include "optics/light.h"

namespace lensd::proto {
namespace {

using optics::DiffractionConvention;
using optics::Number;
using optics::Objective;
using optics::PlanDepth;
using optics::Side;

// ---- numbers: units change by moving the decimal exponent, never by a rounded factor

std::string DecimalText(const Number& number) {
  if (!number.decimal.empty()) return number.decimal;
  char text[32];
  const auto [end, error] = std::to_chars(text, text + sizeof text, number.value, std::chars_format::scientific);
  return {text, end};
}

/// `text` times 10^shift.
std::string Shifted(const std::string& text, int shift) {
  const auto mark = text.find_first_of("eE");
  int exponent = 0;
  if (mark != std::string::npos) {
    const char* digits = text.data() + mark + 1;
    std::from_chars(digits + (*digits == '+' ? 1 : 0), text.data() + text.size(), exponent);
  }
  return text.substr(0, mark) + "e" + std::to_string(exponent + shift);
}

double Nearest(const std::string& text) {
  double value = NAN;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

Json Out(const Number& number, int shift) {
  return NumberOrNull(Nearest(Shifted(DecimalText(number), shift)));
}

Number In(double value, int shift) {
  std::string text = Shifted(DecimalText(Number(value)), -shift);
  const double nearest = Nearest(text);
  return {nearest, std::move(text)};
}

constexpr int kMm = 3, kUm = 6, kNm = 9, kPlain = 0;

Json DepthJson(const PlanDepth& depth) {
  if (!depth.is_vergence && !std::isfinite(depth.number.value)) return {{"vergenceD", 0.0}};
  return {{depth.is_vergence ? "vergenceD" : "distanceM", Out(depth.number, kPlain)}};
}

Json LimitJson(const optics::BlurLimit& limit) {
  Json json = {{"name", limit.name},
               {"kind", limit.kind == optics::LimitKind::Sharp ? "sharp" : "blurred"},
               {"limitUm", Out(limit.limit, kUm)},
               {"depths", Json::array()}};
  for (const auto& interval : limit.depths) {
    json["depths"].push_back({{"oneEnd", DepthJson(interval.one_end)}, {"otherEnd", DepthJson(interval.other_end)}});
  }
  if (limit.side != Side::Either) json["side"] = limit.side == Side::Behind ? "behind" : "front";
  return json;
}

constexpr const char* kObjectives[] = {"light", "sharp", "depth"};

// ---- reading: the first thing wrong is kept

class Reader {
 public:
  Reader(const Json& json, std::string path) : json_(json), path_(std::move(path)) {}

  const Json* Find(const char* key) const {
    if (!json_.is_object()) return nullptr;
    const auto found = json_.find(key);
    return found == json_.end() || found->is_null() ? nullptr : &*found;
  }
  std::string Path(const char* key) const { return path_ + key; }

 private:
  const Json& json_;
  std::string path_;
};

struct FieldError {
  std::string message;
};
[[noreturn]] void Reject(const std::string& field, const char* why) {
  throw FieldError{field + ": " + why};
}

double NumberAt(const Json& value, const std::string& field) {
  if (!value.is_number()) Reject(field, "must be a number");
  return value.get<double>();
}

void Read(const Reader& reader, const char* key, int shift, Number& number) {
  if (const Json* value = reader.Find(key)) number = In(NumberAt(*value, reader.Path(key)), shift);
}

void Read(const Reader& reader, const char* key, int shift, std::optional<Number>& number) {
  if (const Json* value = reader.Find(key)) number = In(NumberAt(*value, reader.Path(key)), shift);
}

void Read(const Reader& reader, const char* key, int shift, std::optional<Metres>& length) {
  if (const Json* value = reader.Find(key)) length = Metres{In(NumberAt(*value, reader.Path(key)), shift).value};
}

std::string TextAt(const Json& value, const std::string& field) {
  if (!value.is_string()) Reject(field, "must be a string");
  return value.get<std::string>();
}

/// Index of the word among `words`; `fallback` where it is absent.
std::size_t Choice(const Reader& reader, const char* key, std::initializer_list<const char*> words,
                   std::size_t fallback) {
  const Json* value = reader.Find(key);
  if (value == nullptr) return fallback;
  const std::string text = TextAt(*value, reader.Path(key));
  std::size_t index = 0;
  std::string choices;
  for (const char* word : words) {
    if (text == word) return index;
    choices += (index++ == 0 ? "" : ", ") + std::string(word);
  }
  throw FieldError{reader.Path(key) + ": '" + text + "' is none of " + choices};
}

PlanDepth ReadDepth(const Json& json, const std::string& path) {
  const Reader reader(json, path + ".");
  const Json* distance = reader.Find("distanceM");
  const Json* vergence = reader.Find("vergenceD");
  if ((distance == nullptr) == (vergence == nullptr)) Reject(path, "give either distanceM or vergenceD");
  if (distance != nullptr) return PlanDepth::Distance(NumberAt(*distance, path + ".distanceM"));
  return PlanDepth::Vergence(NumberAt(*vergence, path + ".vergenceD"));
}

optics::BlurLimit ReadLimit(const Json& json, const std::string& path) {
  const Reader reader(json, path + ".");
  optics::BlurLimit limit;
  const Json* name = reader.Find("name");
  limit.name = name != nullptr ? TextAt(*name, reader.Path("name")) : path;
  if (reader.Find("kind") == nullptr) Reject(path, "needs a kind: sharp or blurred");
  limit.kind =
      Choice(reader, "kind", {"sharp", "blurred"}, 0) == 0 ? optics::LimitKind::Sharp : optics::LimitKind::Blurred;
  limit.side =
      std::array{Side::Either, Side::Behind, Side::Front}[Choice(reader, "side", {"either", "behind", "front"}, 0)];
  if (reader.Find("limitUm") == nullptr) Reject(path, "needs limitUm");
  Read(reader, "limitUm", kUm, limit.limit);
  const Json* depths = reader.Find("depths");
  if (depths == nullptr || !depths->is_array()) Reject(path, "needs depths, an array");
  for (std::size_t i = 0; i < depths->size(); ++i) {
    const std::string place = path + ".depths[" + std::to_string(i) + "]";
    const Reader interval((*depths)[i], place + ".");
    const Json* one = interval.Find("oneEnd");
    const Json* other = interval.Find("otherEnd");
    if (one == nullptr || other == nullptr) Reject(place, "needs oneEnd and otherEnd");
    limit.depths.push_back({ReadDepth(*one, place + ".oneEnd"), ReadDepth(*other, place + ".otherEnd")});
  }
  return limit;
}

void ReadLists(const Reader& reader, optics::PlanRequest& request) {
  if (const Json* stops = reader.Find("stops")) {
    if (!stops->is_array()) Reject("stops", "must be an array of numbers");
    const int shift = request.apertures_are_diameters ? kMm : kPlain;
    request.stops.clear();
    for (const Json& stop : *stops) request.stops.push_back(In(NumberAt(stop, "stops"), shift));
  }
  request.limits.clear();
  if (const Json* limits = reader.Find("limits")) {
    if (!limits->is_array()) Reject("limits", "must be an array");
    for (std::size_t i = 0; i < limits->size(); ++i) {
      request.limits.push_back(ReadLimit((*limits)[i], "limits[" + std::to_string(i) + "]"));
    }
  }
}

void ReadRequest(const Reader& reader, optics::PlanRequest& request) {
  if (const Json* diameters = reader.Find("aperturesAreDiameters")) {
    if (!diameters->is_boolean()) Reject("aperturesAreDiameters", "must be true or false");
    request.apertures_are_diameters = diameters->get<bool>();
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
  Read(reader, "blurLimitUm", kUm, request.depth_limit);
  Read(reader, "pixelUm", kUm, request.pixel);
  Read(reader, "modelToleranceUm", kUm, request.model_tolerance);
  if (const Json* focus = reader.Find("focus")) request.focus = ReadDepth(*focus, "focus");
  request.diffraction =
      Choice(reader, "diffraction", {"airy", "mtf50"}, static_cast<std::size_t>(request.diffraction)) == 0
          ? DiffractionConvention::Airy
          : DiffractionConvention::Mtf50;
  request.objective =
      static_cast<Objective>(Choice(reader, "objective", {kObjectives[0], kObjectives[1], kObjectives[2]},
                                    static_cast<std::size_t>(request.objective)));
  ReadLists(reader, request);
}

Json LimitAnswerJson(const optics::LimitAnswer& limit) {
  Json json = Json::object();
  json["name"] = limit.name;
  json["nearD"] = NumberOrNull(limit.near.value);
  json["farD"] = NumberOrNull(limit.far.value);
  json["limitUm"] = NumberOrNull(limit.limit.value * 1e6);
  json["worstUm"] = NumberOrNull(limit.worst.value * 1e6);
  json["atD"] = NumberOrNull(limit.at.value);
  json["ratio"] = NumberOrNull(limit.ratio);
  return json;
}

}  // namespace

Json PlanRequestJson(const optics::PlanRequest& request) {
  const int aperture = request.apertures_are_diameters ? kMm : kPlain;
  Json json = {{"focalLengthMm", Out(request.focal_length, kMm)},
               {"aperturesAreDiameters", request.apertures_are_diameters},
               {"apertureMin", Out(request.f_numbers.low, aperture)},
               {"apertureMax", Out(request.f_numbers.high, aperture)},
               {"extensionMinMm", Out(request.extensions.low, kMm)},
               {"extensionMaxMm", Out(request.extensions.high, kMm)},
               {"sensorToleranceUm", Out(request.sensor_tolerance, kUm)},
               {"fNumberTolerance", Out(request.f_number_tolerance, kPlain)},
               {"diffraction", request.diffraction == DiffractionConvention::Airy ? "airy" : "mtf50"},
               {"pupilFactor", Out(request.pupil_factor, kPlain)},
               {"objective", kObjectives[static_cast<std::size_t>(request.objective)]},
               {"limits", Json::array()}};
  for (const Number& stop : request.stops) json["stops"].push_back(Out(stop, aperture));
  for (const auto& limit : request.limits) json["limits"].push_back(LimitJson(limit));
  if (request.focus) json["focus"] = DepthJson(*request.focus);
  if (request.wavelength) json["wavelengthNm"] = Out(*request.wavelength, kNm);
  if (request.depth_limit) json["blurLimitUm"] = Out(*request.depth_limit, kUm);
  if (request.pixel) json["pixelUm"] = Out(request.pixel->value, kUm);
  if (request.model_tolerance) json["modelToleranceUm"] = Out(request.model_tolerance->value, kUm);
  return json;
}

Result<optics::PlanRequest> PlanRequestFromJson(const Json& json, optics::PlanRequest defaults) {
  if (!json.is_object()) return Fail(Code::InvalidArgument, "the plan request must be an object");
  try {
    ReadRequest(Reader(json, ""), defaults);
  } catch (const FieldError& wrong) {
    return Fail(Code::InvalidArgument, wrong.message);
  }
  return defaults;
}

Json PlanAnswerJson(const optics::PlanAnswer& answer, Metres principal_gap) {
  Json json = {{"feasible", answer.feasible}};
  if (!answer.note.empty()) json["note"] = answer.note;
  if (!answer.feasible) {
    json["conflict"] = answer.conflict;
    json["relax"] = answer.relax ? NumberOrNull(*answer.relax) : Json(nullptr);
    return json;
  }
  const double vergence = answer.focal_plane.value;
  const double distance = vergence > 0.0 ? 1.0 / vergence : NAN;
  const double angle = optics::SubtendedAngle(answer.working_f_number) * 180.0 / std::numbers::pi;
  json["fNumber"] = NumberOrNull(answer.f_number.value);
  json["apertureDiameterMm"] = NumberOrNull(answer.aperture_diameter.value * 1e3);
  json["workingFNumber"] = NumberOrNull(answer.working_f_number.value);
  json["tStop"] = NumberOrNull(answer.working_f_number.value);
  json["subtendedAngleDeg"] = NumberOrNull(angle);
  json["magnification"] = NumberOrNull(answer.magnification);
  json["extensionMm"] = NumberOrNull(answer.extension.value * 1e3);
  json["sensorDistanceMm"] = NumberOrNull(answer.sensor_distance.value * 1e3);
  json["focalPlaneD"] = NumberOrNull(vergence);
  json["focalPlaneM"] = NumberOrNull(distance);
  json["focusFromSensorM"] = NumberOrNull(distance + answer.sensor_distance.value + principal_gap.value);
  json["worstRatio"] = NumberOrNull(answer.worst_ratio);
  json["model"] = answer.model;
  json["modelErrorUm"] = NumberOrNull(answer.model_error.value * 1e6);
  Json& limits = json["limits"] = Json::array();
  for (const auto& limit : answer.limits) limits.push_back(LimitAnswerJson(limit));
  if (answer.depth_of_field) {
    const double one = answer.depth_of_field->one_end.vergence().value;
    const double other = answer.depth_of_field->other_end.vergence().value;
    json["depthOfField"] = {{"nearD", NumberOrNull(std::max(one, other))},
                            {"farD", NumberOrNull(std::min(one, other))}};
  }
  return json;
}

}  // namespace lensd::proto
