// lensctl light: how much light reaches the sensor, beside the f-number and the T-stop.

#include <CLI/CLI.hpp>
#include <memory>
#include <numbers>

#include "cli/commands.h"
#include "cli/offline/camera_system.h"
#include "cli/text/text.h"
#include "optics/light.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

Outcome RunLight(const SystemText& text, Session& session) {
  const auto system = ReadSystem(text, session.globals().from);
  if (!system) return PassOn(system);
  if (system->diameter.is_zero()) {
    return Refuse(Exit::Usage,
                  "--model pinhole: how much light passes is a matter of its size; give "
                  "--aperture-diameter");
  }
  const Rational working = system->WorkingFNumber();
  const Rational number = system->focal_length ? Rational(system->focal_length->ToRational() / system->diameter) : 0;
  const auto f_number = Rounded(number), working_number = Rounded(working);
  const auto diameter_mm = Rounded(system->diameter * 1000), stands_mm = Rounded(system->sensor_distance * 1000);
  const auto paraxial = Rounded(optics::thin_lens::ParaxialLight(working));
  const auto exact = Rounded(optics::thin_lens::ExactLight(working));
  for (const auto* value : {&f_number, &working_number, &diameter_mm, &stands_mm, &paraxial, &exact}) {
    if (!*value) return PassOn(*value);
  }
  const double angle = optics::SubtendedAngle(FNumber{*working_number}) * 180.0 / std::numbers::pi;
  if (session.json()) {
    session.PrintJson({{"fNumber", system->focal_length ? varlink::Json(*f_number) : varlink::Json(nullptr)},
                       {"tStop", *working_number},
                       {"workingFNumber", *working_number},
                       {"apertureDiameterMm", *diameter_mm},
                       {"sensorDistanceMm", *stands_mm},
                       {"subtendedAngleDeg", angle},
                       {"lightParaxial", *paraxial},
                       {"lightExact", *exact}});
    return Exit::Done;
  }
  session.PrintText(TableText({{"f-number", system->focal_length ? "f/" + Short(*f_number, 6) : "none: no lens"},
                               {"working f-number, T-stop", "f/" + Short(*working_number, 6)},
                               {"opening", Short(*diameter_mm, 6) + " mm, " + Short(*stands_mm, 6) +
                                               " mm before the sensor, seen under " + Short(angle) + " degrees"},
                               {"light, (A/Z)²", Short(*paraxial, 6)},
                               {"light, exactly", Short(*exact, 6)}}));
  return Exit::Done;
}

}  // namespace

void AddLight(CLI::App& root, Run& run) {
  auto text = std::make_shared<SystemText>();
  CLI::App* command = root.add_subcommand("light", "how much light reaches the sensor")->group(kOffline);
  AddSystemOptions(*command, *text);
  command->footer(
      "The light is that on the axis, relative to an opening as wide as its distance: (A/Z)² paraxially, 4 sin² of the "
      "half angle exactly. The T-stop assumes glass without losses.");
  command->callback([text, &run] { run = [text](Session& session) { return RunLight(*text, session); }; });
}

}  // namespace lensd::cli
