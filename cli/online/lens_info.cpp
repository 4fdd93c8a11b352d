#include "cli/online/lens_info.h"

#include <utility>

namespace lensd::cli {

using proto::Json;

namespace {

/// A number of the daemon, in metres or plain, as the decimal it was sent as.
std::optional<Decimal> Exact(const Json& object, const char* key, int exponent = 0) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return Decimal::Shortest(found->get<double>()) * Decimal(1, exponent);
}

std::optional<Span<Decimal>> ExactSpan(const Json& object, const char* low, const char* high, int exponent = 0) {
  auto from = Exact(object, low, exponent);
  auto to = Exact(object, high, exponent);
  if (!from || !to) return std::nullopt;
  return Span<Decimal>{*std::move(from), *std::move(to)};
}

}  // namespace

std::expected<Json, Failure> FindInfo(Link& link, const std::string& lens) {
  auto reply = link.Ask(MethodOfLens("List"), Json::object());
  if (!reply) return std::unexpected(reply.error());
  const Json& lenses = (*reply)["lenses"];
  for (const Json& info : lenses) {
    if (lens.empty() ? lenses.size() == 1 : info.value("name", "") == lens) return info;
  }
  if (!lens.empty()) return Refuse(Exit::Unavailable, "there is no lens \"" + lens + "\"; see lensctl list");
  if (lenses.empty())
    return Refuse(Exit::Unavailable,
                  "no lens is configured; for a plan without one give "
                  "--focal-length");
  return Refuse(Exit::Usage, "say which lens; see lensctl list");
}

PlanDefaults DefaultsOf(const Json& info) {
  PlanDefaults defaults;
  if (const auto camera = info.find("camera"); camera != info.end() && camera->is_object()) {
    defaults.pixel = Exact(*camera, "pixelUm", -6);
  }
  const auto optics = info.find("optics");
  if (optics == info.end() || !optics->is_object()) return defaults;
  defaults.focal_length = Exact(*optics, "focalLengthMm", -3);
  defaults.f_numbers = ExactSpan(*optics, "fNumberMin", "fNumberMax");
  defaults.extensions = ExactSpan(*optics, "extensionMinMm", "extensionMaxMm", -3);
  defaults.pupil_factor = Exact(*optics, "pupilFactor");
  defaults.principal_gap = Metres{optics->value("principalGapMm", 0.0) * 1e-3};
  return defaults;
}

std::optional<From> OriginOf(const Session& session, const Json& info) {
  if (session.globals().from) return session.globals().from;
  const auto optics = info.find("optics");
  if (optics == info.end() || !optics->is_object()) return std::nullopt;
  const std::string from = optics->value("distanceFrom", "lens");
  return from == "sensor" ? From::Sensor : from == "front" ? From::Front : From::Lens;
}

void AddTolerances(const Json& info, optics::PlanRequest& request) {
  const auto optics = info.find("optics");
  if (optics == info.end() || !optics->is_object()) return;
  request.sensor_tolerance = optics::Number(optics->value("sensorToleranceUm", 0.0) * 1e-6);
  request.f_number_tolerance = optics::Number(optics->value("fNumberTolerance", 0.0));
}

}  // namespace lensd::cli
