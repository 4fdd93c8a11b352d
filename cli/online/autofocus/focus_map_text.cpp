// One flat target shows one tilt, of the sensor against the target as the lens images it. Each of the three may be
// turned against it, so each remedy stands here with its own figure, and how to find out which of them it is.
#include "cli/online/autofocus/focus_map_text.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/quantity_text.h"
#include "cli/text/text.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr int kDigits = 3;

struct Side {
  const char* key;
  const char* name;
  const char* axis;
  const char* edges[2];    ///< of the picture: where best focus rises to, where the rise is positive and negative
  const char* sensors[2];  ///< the edge of the sensor that shows it, from behind the camera
};
constexpr Side kSides[] = {{"across", "across", "vertical", {"right", "left"}, {"left", "right"}},
                           {"down", "down", "horizontal", {"lower", "upper"}, {"upper", "lower"}}};

bool Clear(double value, double sigma) {
  return std::abs(value) >= kClearSigmas * sigma;
}

std::string Um(double um) {
  return Short(um, kDigits) + " um";
}

std::string DegText(const Json& tilt, const char* key) {
  return Short(std::abs(tilt[key].get<double>()), kDigits) + " deg";
}

/// The grid as it lies in the picture.
std::string GridText(const Json& map) {
  std::vector<std::vector<std::string>> rows(map["rows"].get<std::size_t>());
  for (const Json& cell : map["cells"]) {
    const Json& at = cell["extensionUm"];
    std::string text = "-";
    if (at.is_number()) text = OffsetText(at.get<double>());
    if (cell["outlier"].get<bool>()) text.insert(0, "(").append(")");
    rows[cell["row"].get<std::size_t>()].push_back(text);
  }
  std::vector<std::vector<std::string>> table{{}};
  for (int column = 0; column < map["columns"].get<int>(); ++column) table[0].push_back(std::to_string(column + 1));
  table.insert(table.end(), rows.begin(), rows.end());
  return TableText(table);
}

/// What would take this side's tilt away.
std::string Remedies(const Json& map, const Side& side, std::optional<Metres> between_shims) {
  const Json& tilt = map["surface"][side.key];
  const double rise = tilt["riseUm"].get<double>();
  const std::size_t way = rise > 0.0 ? 0 : 1;
  std::string text = "\n    sensor: move its " + std::string(side.sensors[way]) +
                     " edge, seen from behind the camera (it shows the picture's " + side.edges[way] + " edge), " +
                     Um(std::abs(rise)) + " away from the lens";
  if (!tilt["sensorDeg"].is_number()) return text;
  text += ", " + DegText(tilt, "sensorDeg");
  // Turning the lens turns the image by one magnification more: the target is turned against it as well.
  const double lens =
      std::tan(std::abs(tilt["sensorDeg"].get<double>()) * M_PI / 180.0) / (1.0 + map["magnification"].get<double>());
  const double apart_mm = between_shims ? between_shims->value * 1e3 : 10.0;
  text += "\n    or mount: a shim of " + Um(lens * apart_mm * 1e3) + " under the same side of the lens" +
          (between_shims ? "" : ", for each 10 mm to the other side of the mount");
  if (tilt["targetDeg"].is_number()) {
    text += "\n    or target: turn it by " + DegText(tilt, "targetDeg") + ", its " + side.edges[way] +
            " edge away from the camera";
  } else {
    text += "\n    (the target is too far away for its own angle to show)";
  }
  return text;
}

std::string TiltText(const Json& map, const Side& side, std::optional<Metres> between_shims) {
  const Json& tilt = map["surface"][side.key];
  const double rise = tilt["riseUm"].get<double>();
  std::string text = std::string("\n  tilt ") + side.name + ": ";
  if (!Clear(rise, tilt["sigmaUm"].get<double>())) return text + RiseText(tilt);
  text += "best focus at the " + std::string(side.edges[rise > 0.0 ? 0 : 1]) + " edge lies " + RiseText(tilt) +
          " farther out than at the other";
  if (tilt["sensorDeg"].is_number()) {
    text += ": " + DegText(tilt, "sensorDeg") + " (+- " + DegText(tilt, "sensorSigmaDeg") +
            ") of the sensor about its " + side.axis + " axis";
    if (tilt["targetDeg"].is_number()) text += ", or " + DegText(tilt, "targetDeg") + " of the target";
  }
  return text + Remedies(map, side, between_shims);
}

bool AnyTilt(const Json& surface) {
  return std::ranges::any_of(kSides, [&](const Side& side) {
    const Json& tilt = surface[side.key];
    return Clear(tilt["riseUm"].get<double>(), tilt["sigmaUm"].get<double>());
  });
}

std::string SurfaceText(const Json& map, std::optional<Metres> between_shims) {
  const Json& surface = map["surface"];
  std::string text;
  for (const Side& side : kSides) text += TiltText(map, side, between_shims);
  if (AnyTilt(surface)) {
    text +=
        "\n  One flat target cannot show which of them is tilted: save this map (--json), turn the target by half a "
        "turn "
        "in "
        "its own plane, and map again with --before FILE --turned";
  }
  text += "\n  curvature: " + CurvatureText(surface);
  if (surface["curvatureUm"].is_number() &&
      Clear(surface["curvatureUm"].get<double>(), surface["curvatureSigmaUm"].get<double>())) {
    text +=
        "\n    No advice without a measured probe: how much a change takes away (of a spacer, a corrector's distance) "
        "is "
        "not known. Keep this map (--json), make a known change, and map again with --before FILE --moved LENGTH.";
  }
  return text;
}

std::string LeftOutText(const Json& map) {
  std::string text;
  for (const Json& cell : map["cells"]) {
    if (cell["outlier"].get<bool>()) {
      text += "\n  left out: " + CellName(cell) + ": " + Um(std::abs(cell["offUm"].get<double>())) +
              " off the surface of the others";
    } else if (!cell["position"].is_number()) {
      text += "\n  left out: " + CellName(cell) + ": " + TextOf(cell, "reason");
    }
  }
  return text;
}

}  // namespace

std::string OffsetText(double um) {
  const double rounded = std::round(10.0 * um) / 10.0;
  return (rounded > 0.0 ? "+" : "") + Short(rounded, 4);
}

std::string CellName(const Json& cell) {
  return "column " + std::to_string(cell["column"].get<int>() + 1) + ", row " +
         std::to_string(cell["row"].get<int>() + 1);
}

std::string RiseText(const Json& tilt) {
  const double rise = tilt["riseUm"].get<double>(), sigma = tilt["sigmaUm"].get<double>();
  if (!Clear(rise, sigma)) return "none beyond its error: " + Um(rise) + " (+- " + Short(sigma, 2) + " um)";
  return Um(std::abs(rise)) + " (+- " + Short(sigma, 2) + " um)";
}

std::string CurvatureText(const Json& surface) {
  if (!surface["curvatureUm"].is_number()) return "not known: too few regions";
  const double curvature = surface["curvatureUm"].get<double>(), sigma = surface["curvatureSigmaUm"].get<double>();
  const std::string error = " (+- " + Short(sigma, 2) + " um)";
  if (!Clear(curvature, sigma)) return "none beyond its error: " + Um(curvature) + error;
  return "best focus in the corners lies " + Um(std::abs(curvature)) + error + " farther " +
         (curvature > 0.0 ? "out" : "in") + " than in the middle";
}

std::string FocusMapText(const Json& map, std::optional<Metres> between_shims) {
  std::string text = TextOf(map, "lens") + ": ";
  const bool mapped = map["mapped"].get<bool>();
  text +=
      mapped ? "stands where the frame as a whole is least out of focus" : "refused, and the lens is back where it was";
  if (map["vergenceD"].is_number()) text += ", at " + DepthText({map["vergenceD"].get<double>()});
  text += ", position " + NumberText(map, "position", 8, ", ") + NumberText(map, "frames", 6, " frames, ") +
          NumberText(map, "moves", 6, " moves, ") + TimeText(map, "elapsedMs");
  text += (mapped ? "\n  why: " : "\n  why not: ") + TextOf(map, "reason");
  if (!mapped) return text + LeftOutText(map);
  const Json& surface = map["surface"];
  text += "\n  the farthest region is " + Um(surface["leftUm"].get<double>()) + " off, ";
  if (surface["leftPx"].is_number()) text += NumberText(surface, "leftPx", kDigits, " px of blur, ");
  text += "by the surface\n  best focus of each region in um of extension from there, as in the picture:\n";
  text += GridText(map);
  while (text.ends_with('\n')) text.pop_back();
  return text + SurfaceText(map, between_shims) + LeftOutText(map);
}

}  // namespace lensd::cli
