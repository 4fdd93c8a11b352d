// The options of plan and stack for a lens of the daemon: units are converted in decimal, nothing else is worked out.
#include "cli/online/plan/plan_request.h"

#include <utility>

#include "cli/plan/reading.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr int kMm = 3, kUm = 6, kNm = 9;

Json NumberJson(const Decimal& value, int exponent = 0) {
  return (value * Decimal(1, exponent)).Nearest().value();
}

Json DepthJson(const Depth& depth) {
  return {{depth.IsDistance() ? "distanceM" : "vergenceD", NumberJson(depth.exact)}};
}

/// Fields of a request, until one of its texts is wrong.
class Typed {
 public:
  template <class Parse, class Place>
  void Read(const std::string& text, std::string_view option, Parse parse, Place place) {
    if (error_ || text.empty()) return;
    auto value = parse(text, option);
    if (value) return place(*std::move(value));
    error_ = value.error();
  }
  void Length(const std::string& text, std::string_view option, const char* key, int exponent) {
    Read(text, option, ParseExactLength, [&](const Decimal& length) { json[key] = NumberJson(length, exponent); });
  }
  void Number(const std::string& text, std::string_view option, const char* key) {
    Read(text, option, ParseNumber, [&](const Decimal& number) { json[key] = NumberJson(number); });
  }
  void Blur(const std::string& text, std::string_view option, const std::string& name) {
    Read(text, option, ParseBlur, [&](const BlurSize& blur) { AddBlur(json, name, blur); });
  }
  static void AddBlur(Json& object, const std::string& name, const BlurSize& blur) {
    object[name + (blur.in_pixels ? "Px" : "Um")] = NumberJson(blur.value, blur.in_pixels ? 0 : kUm);
  }
  void Fail(Error error) {
    if (!error_) error_ = std::move(error);
  }
  Result<Json> Take() {
    if (error_) return PassOn(*std::move(error_));
    return std::move(json);
  }

  Json json = Json::object();

 private:
  std::optional<Error> error_;
};

void AddLens(const PlanText& text, Typed& typed) {
  Json& json = typed.json;
  typed.Read(text.focal_length, "--focal-length", ParseLengthRange, [&](const Span<Decimal>& range) {
    if (!(range.low < range.high)) {
      json["focalLengthMm"] = NumberJson(range.low, kMm);
      return;
    }
    json["focalLengthMinMm"] = NumberJson(range.low, kMm);
    json["focalLengthMaxMm"] = NumberJson(range.high, kMm);
  });
  if (!text.f_number.empty() && !text.aperture_diameter.empty()) {
    typed.Fail(
        {Code::InvalidArgument, "give the opening once: --f-number or --aperture-diameter, such as --f-number 2.8"});
  }
  const bool diameters = !text.aperture_diameter.empty();
  const auto add_openings = [&](const Openings& openings) {
    const int exponent = diameters ? kMm : 0;
    if (diameters) json["aperturesAreDiameters"] = true;
    json["apertureMin"] = NumberJson(openings.range.low, exponent);
    json["apertureMax"] = NumberJson(openings.range.high, exponent);
    for (const Decimal& stop : openings.stops) json["stops"].push_back(NumberJson(stop, exponent));
  };
  typed.Read(text.f_number, "--f-number", ParseFNumbers, add_openings);
  typed.Read(text.aperture_diameter, "--aperture-diameter", ParseDiameters, add_openings);
  typed.Read(text.extension, "--extension", ParseLengthRange, [&](const Span<Decimal>& range) {
    json["extensionMinMm"] = NumberJson(range.low, kMm);
    json["extensionMaxMm"] = NumberJson(range.high, kMm);
  });
  if (!text.sensor_distance.empty()) {
    typed.Fail({Code::InvalidArgument,
                "--sensor-distance is for a lens described by --focal-length; of a lens of the "
                "daemon say --extension"});
  }
  typed.Length(text.pixel, "--pixel", "pixelUm", kUm);
  typed.Number(text.pupil_factor, "--pupil-factor", "pupilFactor");
  typed.Length(text.sensor_width, "--sensor-width", "sensorWidthMm", kMm);
  typed.Read(text.field, "--field", ParseField, [&](const FieldText& field) {
    json["field"] = {{"widthM", NumberJson(field.width)}, {"distanceM", NumberJson(field.distance)}};
  });
}

void AddWishes(const PlanText& text, Typed& typed) {
  Json& json = typed.json;
  typed.Read(text.focus, "--focus", ParseDepth, [&](const Depth& depth) { json["focus"] = DepthJson(depth); });
  typed.Length(text.sensor_tolerance, "--sensor-tolerance", "sensorToleranceUm", kUm);
  typed.Read(text.f_number_tolerance, "--f-number-tolerance", ParsePercent,
             [&](const Decimal& ratio) { json["fNumberTolerance"] = NumberJson(ratio); });
  typed.Length(text.wavelength, "--wavelength", "wavelengthNm", kNm);
  if (!text.diffraction.empty()) json["diffraction"] = text.diffraction;
  if (!text.objective.empty()) json["objective"] = text.objective;
  typed.Blur(text.blur_limit, "--blur-limit", "blurLimit");
  typed.Blur(text.model_tolerance, "--model-tolerance", "modelTolerance");
  if (text.stack) json["stack"] = true;
}

Json DepthsJson(const NamedLimit& limit, const std::map<int, OccupiedDepths>& classes) {
  const auto metres = [](int millimetres) { return NumberJson(Decimal(millimetres, -3)); };
  Json depths = Json::array();
  const auto* mask_class = std::get_if<MaskClass>(&limit.written.where);
  if (mask_class == nullptr) {
    const DepthRange& range = std::get<DepthRange>(limit.written.where);
    depths.push_back({{"oneEnd", DepthJson(range.near)}, {"otherEnd", DepthJson(range.far)}});
    return depths;
  }
  const OccupiedDepths& occupied = classes.at(mask_class->number);
  const auto add = [&](int near, int far) {
    depths.push_back({{"oneEnd", {{"distanceM", metres(near)}}}, {"otherEnd", {{"distanceM", metres(far)}}}});
  };
  if (!MayLieOnBothSides(limit)) {
    add(occupied.front(), occupied.back());
  } else {
    for (const int depth : occupied) add(depth, depth);
  }
  return depths;
}

void AddLimits(const PlanText& text, Typed& typed) {
  const auto limits = NamedLimits(text);
  if (!limits) return typed.Fail(limits.error());
  const auto classes = ReadClasses(text, *limits);
  if (!classes) return typed.Fail(classes.error());
  for (const NamedLimit& limit : *limits) {
    Json json{{"name", limit.written.name}, {"kind", limit.kind == optics::LimitKind::Sharp ? "sharp" : "blurred"}};
    if (limit.written.limit) Typed::AddBlur(json, "limit", *limit.written.limit);
    if (limit.written.side != optics::Side::Either) {
      json["side"] = limit.written.side == optics::Side::Behind ? "behind" : "front";
    }
    if (const auto* plane = std::get_if<TiltedPlane>(&limit.written.where)) {
      const auto interval = optics::DepthsOfPlane(NumberOf(plane->u0), NumberOf(plane->ux), NumberOf(plane->uy));
      if (!interval) return typed.Fail({interval.error().code, limit.written.name + ": " + interval.error().message});
      const auto vergence = [](const optics::PlanDepth& depth) { return Json{{"vergenceD", depth.number.value}}; };
      json["depths"] = Json::array();
      json["depths"].push_back({{"oneEnd", vergence(interval->one_end)}, {"otherEnd", vergence(interval->other_end)}});
    } else {
      json["depths"] = DepthsJson(limit, *classes);
    }
    typed.json["limits"].push_back(std::move(json));
  }
}

}  // namespace

Result<Json> TypedRequest(const PlanText& text, std::optional<From> from) {
  Typed typed;
  AddLens(text, typed);
  AddWishes(text, typed);
  AddLimits(text, typed);
  if (from) {
    typed.json["distanceFrom"] = *from == From::Sensor ? "sensor" : *from == From::Front ? "front" : "lens";
  }
  return typed.Take();
}

Failure InWordsOfOptions(Failure refused) {
  constexpr std::string_view kField = "give pixelUm";
  if (const std::size_t at = refused.message.find(kField); at != std::string::npos) {
    refused.message.replace(at, kField.size(), "give --pixel, or pixel_um of its camera in the configuration");
  }
  return refused;
}

}  // namespace lensd::cli
