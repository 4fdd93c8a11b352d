// Half a turn of the target turns the sign of its tilt and of nothing else: half the sum of two maps is the camera's,
// half the difference the target's.
#include "cli/online/autofocus/focus_map_compare.h"

#include <cmath>
#include <fstream>
#include <iterator>

#include "base/quantity_text.h"
#include "cli/online/autofocus/focus_map_text.h"

namespace lensd::cli {
namespace {

using varlink::Json;

/// "23.4 um (+- 0.8 um)"
std::string WithError(double um, double sigma) {
  return Short(um, 3) + " um (+- " + Short(sigma, 2) + " um)";
}

bool IsTilt(const Json& tilt) {
  return tilt.is_object() && tilt.value("riseUm", Json()).is_number() && tilt.value("sigmaUm", Json()).is_number();
}

}  // namespace

std::expected<Json, Failure> ReadFocusMap(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return Refuse(Exit::NoInput, "--before: " + file + " cannot be read");
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  auto map = varlink::ParseJson(text);
  const Json surface = map && map->is_object() ? map->value("surface", Json()) : Json();
  if (!surface.is_object() || !IsTilt(surface.value("across", Json())) || !IsTilt(surface.value("down", Json()))) {
    return Refuse(
        Exit::BadData,
        "--before: " + file +
            " is no focus map: it takes what `lensctl focus-map --json` printed, of a map that was not refused");
  }
  return *std::move(map);
}

Json ProbeOf(const Json& before, const Json& map, Metres moved) {
  const Json& then = before["surface"];
  const Json& now = map["surface"];
  for (const Json* surface : {&then, &now}) {
    if (!surface->value("curvatureUm", Json()).is_number() || !surface->value("curvatureSigmaUm", Json()).is_number())
      return nullptr;
  }
  const double moved_um = moved.value * 1e6;
  const double curvature = now["curvatureUm"].get<double>(), error = now["curvatureSigmaUm"].get<double>();
  const double change = curvature - then["curvatureUm"].get<double>();
  const double sigma = std::hypot(error, then["curvatureSigmaUm"].get<double>());
  const double gain = change / moved_um, gain_sigma = sigma / std::abs(moved_um);
  Json probe{{"changeUm", change},      {"sigmaUm", sigma},  {"gain", gain},
             {"gainSigma", gain_sigma}, {"moveUm", nullptr}, {"moveSigmaUm", nullptr}};
  if (std::abs(gain) >= kClearSigmas * gain_sigma && std::abs(curvature) >= kClearSigmas * error) {
    probe["moveUm"] = -curvature / gain;
    probe["moveSigmaUm"] = std::hypot(error / gain, curvature / gain * gain_sigma / gain);
  }
  return probe;
}

std::string ProbeText(const Json& probe) {
  if (probe.is_null()) return "  probe: one of the two maps has no curvature";
  const double gain = probe["gain"].get<double>(), sigma = probe["gainSigma"].get<double>();
  std::string text = "  probe: curvature changed by " +
                     WithError(probe["changeUm"].get<double>(), probe["sigmaUm"].get<double>()) + ", which is " +
                     Short(gain, 3) + " (+- " + Short(sigma, 2) + ") of the move";
  if (probe["moveUm"].is_number()) {
    return text + "\n    to flatten the field: move it by another " +
           WithError(probe["moveUm"].get<double>(), probe["moveSigmaUm"].get<double>()) +
           ", in the direction of the change if positive";
  }
  if (std::abs(gain) >= kClearSigmas * sigma)
    return text + "\n    nothing to do: the remaining curvature is within its error";
  return text + "\n    no advice: that is within its error. Move it farther, or map with more texture";
}

Json TurnedOf(const Json& before, const Json& map) {
  Json turned = Json::object();
  for (const char* side : {"across", "down"}) {
    const Json& then = before["surface"][side];
    const Json& now = map["surface"][side];
    turned[side] = {{"cameraUm", 0.5 * (now["riseUm"].get<double>() + then["riseUm"].get<double>())},
                    {"targetUm", 0.5 * (now["riseUm"].get<double>() - then["riseUm"].get<double>())},
                    {"sigmaUm", 0.5 * std::hypot(now["sigmaUm"].get<double>(), then["sigmaUm"].get<double>())}};
  }
  return turned;
}

std::string TurnedText(const Json& turned) {
  std::string text = "  separation of these tilts, by turning the target by half a turn:";
  for (const char* side : {"across", "down"}) {
    const Json& part = turned[side];
    const double sigma = part["sigmaUm"].get<double>();
    text += std::string("\n    ") + side + ": the camera's " + WithError(part["cameraUm"].get<double>(), sigma) +
            ", the target's as it hangs now " + WithError(part["targetUm"].get<double>(), sigma);
  }
  return text;
}

}  // namespace lensd::cli
