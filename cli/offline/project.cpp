// lensctl project: the two views of one bundle of rays. Forward: which area of the sensor a scene point lights.
// Reverse: which area of the scene a sensor point sees.

#include <CLI/CLI.hpp>
#include <memory>

#include "cli/commands.h"
#include "cli/offline/camera_system.h"
#include "cli/offline/point.h"
#include "cli/text/text.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

struct ProjectText {
  SystemText system;
  std::string point, sensor_point, at;
};

using Area = optics::thin_lens::Disk<Rational>;

/// A disk rounded to the unit it is shown in.
struct Shown {
  double x = 0.0;
  double y = 0.0;
  double diameter = 0.0;
};

Result<Shown> In(const Area& area, int per_metre, int diameters_per_metre) {
  const auto x = Rounded(area.x * per_metre), y = Rounded(area.y * per_metre);
  const auto diameter = Rounded(area.diameter * diameters_per_metre);
  for (const auto* value : {&x, &y, &diameter}) {
    if (!*value) return PassOn(*value);
  }
  return Shown{*x, *y, *diameter};
}

Result<Shown> Forward(const CameraSystem& system, const std::string& text) {
  const auto point = ParsePoint(text, "--point");
  if (!point) return PassOn(point);
  const auto& [x, y, z, w] = *point;
  if (!(z > 0) || w < 0) {
    return Fail(Code::InvalidArgument,
                "--point '" + text + "': the camera sees only what is before it, with Z above 0");
  }
  const Rational blur = system.SignedBlur({z, w});
  return In(optics::thin_lens::LitBy(*point, system.sensor_distance, blur), 1000, 1'000'000);
}

Result<Shown> Reverse(const CameraSystem& system, const ProjectText& text, std::optional<From> from) {
  const auto sensor_point = ParsePlanePoint(text.sensor_point, "--sensor-point");
  if (!sensor_point) return PassOn(sensor_point);
  const auto object = ParseObject(text.at, "--at");
  if (!object) return PassOn(object);
  const auto centred = system.FromCentre(*object, from);
  if (!centred) return PassOn(centred);
  if (centred->IsInfinite()) {
    return Fail(Code::InvalidArgument, "--at '" + text.at + "': at infinity the area has no size; give a distance");
  }
  const Place at = PlaceOf(*centred);
  const auto& [x, y] = *sensor_point;
  return In(optics::thin_lens::SeenFrom(x, y, system.sensor_distance, Rational(at.z / at.w), system.SignedBlur(at)), 1,
            1000);
}

Outcome RunProject(const ProjectText& text, Session& session) {
  const bool forward = !text.point.empty();
  if (forward == !text.sensor_point.empty() || forward == !text.at.empty()) {
    return Refuse(Exit::Usage,
                  "give --point X,Y,Z for the area of the sensor it lights, or --sensor-point X,Y and --at D for the "
                  "area of the scene it sees");
  }
  const auto system = ReadSystem(text.system, session.globals().from);
  if (!system) return PassOn(system);
  if (forward && session.globals().from.value_or(From::Lens) != From::Lens) {
    return Refuse(Exit::Usage, "--point starts at the lens centre; leave --from out");
  }
  const auto area = forward ? Forward(*system, text.point) : Reverse(*system, text, session.globals().from);
  if (!area) return PassOn(area);
  const auto& [x, y, diameter] = *area;
  if (session.json()) {
    session.PrintJson({{forward ? "imageMm" : "sceneM", {x, y}}, {forward ? "diameterUm" : "diameterMm", diameter}});
    return Exit::Done;
  }
  const std::string centre = "(" + Short(x, 6) + ", " + Short(y, 6) + ") " + (forward ? "mm" : "m");
  const std::string size = LengthText(Metres{diameter * (forward ? 1e-6 : 1e-3)});
  session.PrintText(
      forward ? "lights a disk " + size + " across at " + centre + " on the sensor, axes opposite to the scene's"
              : "sees a disk " + size + " across at " + centre + " in the scene, axes opposite to the sensor's");
  return Exit::Done;
}

}  // namespace

void AddProject(CLI::App& root, Run& run) {
  auto text = std::make_shared<ProjectText>();
  CLI::App* command =
      root.add_subcommand("project",
                          "the sensor area that a scene point lights, or the scene area that a sensor point sees")
          ->group(kOffline);
  AddSystemOptions(*command, text->system);
  command->add_option("--point", text->point, "a scene point X,Y,Z from the lens centre (Z may be inf), or X,Y,Z,W")
      ->type_name("POINT");
  command->add_option("--sensor-point", text->sensor_point, "a sensor point X,Y")->type_name("POINT");
  command->add_option("--at", text->at, "distance of the scene plane that the sensor point sees")->type_name("D");
  command->footer(
      "Only rays are computed, without diffraction. A real pinhole has a size; --model aperture shows its effect.");
  command->callback([text, &run] { run = [text](Session& session) { return RunProject(*text, session); }; });
}

}  // namespace lensd::cli
