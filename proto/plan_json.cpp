// What is asked of a planner, as JSON.
#include "proto/plan_json.h"

#include <cmath>

#include "plan_numbers.h"

namespace lensd::proto {
namespace {

using optics::DiffractionConvention;
using optics::Number;
using optics::PlanDepth;
using optics::Side;

varlink::Json OutJson(const Number& number, int shift) {
  return varlink::NumberOrNull(Out(number, shift));
}

varlink::Json DepthJson(const PlanDepth& depth) {
  if (!depth.is_vergence && !std::isfinite(depth.number.value)) return {{"vergenceD", 0.0}};
  return {{depth.is_vergence ? "vergenceD" : "distanceM", OutJson(depth.number, kPlain)}};
}

varlink::Json LimitJson(const optics::BlurLimit& limit) {
  varlink::Json json = {{"name", limit.name},
                        {"kind", limit.kind == optics::LimitKind::Sharp ? "sharp" : "blurred"},
                        {"limitUm", OutJson(limit.limit, kUm)},
                        {"depths", varlink::Json::array()}};
  for (const auto& interval : limit.depths) {
    json["depths"].push_back({{"oneEnd", DepthJson(interval.one_end)}, {"otherEnd", DepthJson(interval.other_end)}});
  }
  if (limit.side != Side::Either) json["side"] = limit.side == Side::Behind ? "behind" : "front";
  return json;
}

}  // namespace

varlink::Json PlanRequestJson(const optics::PlanRequest& request) {
  const int aperture = request.apertures_are_diameters ? kMm : kPlain;
  varlink::Json json = {{"focalLengthMm", OutJson(request.focal_length, kMm)},
                        {"aperturesAreDiameters", request.apertures_are_diameters},
                        {"apertureMin", OutJson(request.f_numbers.low, aperture)},
                        {"apertureMax", OutJson(request.f_numbers.high, aperture)},
                        {"extensionMinMm", OutJson(request.extensions.low, kMm)},
                        {"extensionMaxMm", OutJson(request.extensions.high, kMm)},
                        {"sensorToleranceUm", OutJson(request.sensor_tolerance, kUm)},
                        {"fNumberTolerance", OutJson(request.f_number_tolerance, kPlain)},
                        {"diffraction", request.diffraction == DiffractionConvention::Airy ? "airy" : "mtf50"},
                        {"pupilFactor", OutJson(request.pupil_factor, kPlain)},
                        {"objective", kObjectives[static_cast<std::size_t>(request.objective)]},
                        {"limits", varlink::Json::array()}};
  for (const Number& stop : request.stops) json["stops"].push_back(OutJson(stop, aperture));
  for (const auto& limit : request.limits) json["limits"].push_back(LimitJson(limit));
  if (request.focus) json["focus"] = DepthJson(*request.focus);
  if (request.wavelength) json["wavelengthNm"] = OutJson(*request.wavelength, kNm);
  if (request.depth_limit) json["blurLimitUm"] = OutJson(*request.depth_limit, kUm);
  if (request.pixel) json["pixelUm"] = OutJson(request.pixel->value, kUm);
  if (request.model_tolerance) json["modelToleranceUm"] = OutJson(request.model_tolerance->value, kUm);
  return json;
}

}  // namespace lensd::proto
