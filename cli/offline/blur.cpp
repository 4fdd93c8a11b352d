// lensctl blur: the blur of points at given depths, under one of the camera models.

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>

#include "cli/commands.h"
#include "cli/offline/camera_system.h"
#include "cli/text.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

struct BlurText {
  SystemText system;
  std::vector<std::string> at;
};

/// One row of the answer.
struct BlurAt {
  Depth object;                    // from the lens centre
  double blur_um = 0.0;            // diffraction included where the model has it
  double signed_blur_um = 0.0;     // geometric: positive behind the focal plane
  std::optional<double> image_mm;  // nothing where no lens forms an image, or it is at infinity
};

Result<std::optional<double>> ImageDistance(const CameraSystem& system, const Place& at) {
  if (!system.focal_length) return std::nullopt;
  const Rational f = system.focal_length->ToRational();
  if (optics::thin_lens::BeyondFocalPoint(f, at).is_zero()) return std::nullopt;
  const auto distance = Rounded(optics::thin_lens::ImageDepth(f, at) * 1000);
  if (!distance) return PassOn(distance);
  return *distance;
}

Result<BlurAt> RowAt(const CameraSystem& system, const std::string& text, std::optional<From> from) {
  const auto object = ParseObject(text, "--at");
  if (!object) return PassOn(object);
  const auto centred = system.FromCentre(*object, from);
  if (!centred) return PassOn(centred);
  const Place at = PlaceOf(*centred);
  const Rational geometric = system.SignedBlur(at);
  const auto signed_blur = Rounded(geometric * 1'000'000);
  if (!signed_blur) return PassOn(signed_blur);
  BlurAt row{*centred, std::abs(*signed_blur), *signed_blur, std::nullopt};
  if (system.wavelength) {
    const auto disk = system.BlurDisk(geometric);
    if (!disk) return PassOn(disk);
    row.blur_um = *disk * 1e6;
  }
  const auto image = ImageDistance(system, at);
  if (!image) return PassOn(image);
  row.image_mm = *image;
  return row;
}

Result<std::vector<BlurAt>> Compute(const BlurText& text, std::optional<From> from) {
  const auto system = ReadSystem(text.system, from);
  if (!system) return PassOn(system);
  std::vector<BlurAt> rows;
  for (const std::string& at : text.at) {
    const auto row = RowAt(*system, at, from);
    if (!row) return PassOn(row);
    rows.push_back(*row);
  }
  return rows;
}

varlink::Json RowJson(const BlurAt& row) {
  const double vergence = row.object.Vergence().value;
  return {{"distanceM", row.object.IsDistance() ? varlink::Json(row.object.value)
                        : vergence > 0.0        ? varlink::NumberOrNull(1.0 / vergence)
                                                : varlink::Json(nullptr)},
          {"vergenceD", vergence},
          {"blurUm", row.blur_um},
          {"signedBlurUm", row.signed_blur_um},
          {"imageDistanceMm", row.image_mm ? varlink::Json(*row.image_mm) : varlink::Json(nullptr)}};
}

Outcome RunBlur(const BlurText& text, Session& session) {
  const auto rows = Compute(text, session.globals().from);
  if (!rows) return PassOn(rows);
  if (session.json()) {
    varlink::Json answer = varlink::Json::array();
    for (const BlurAt& row : *rows) answer.push_back(RowJson(row));
    session.PrintJson(answer);
    return Exit::Done;
  }
  std::vector<std::vector<std::string>> table{{"subject", "blur [um]", "signed [um]", "image at [mm]"}};
  for (const BlurAt& row : *rows) {
    table.push_back({DepthText(row.object.Vergence()), Short(row.blur_um), Short(row.signed_blur_um),
                     row.image_mm ? Short(*row.image_mm, 6) : "none"});
  }
  session.PrintText(TableText(table));
  return Exit::Done;
}

}  // namespace

void AddBlur(CLI::App& root, Run& run) {
  auto text = std::make_shared<BlurText>();
  CLI::App* command = root.add_subcommand("blur", "blur of points at given depths")->group(kOffline);
  AddSystemOptions(*command, text->system);
  command->add_option("--at", text->at, "distance or vergence of a point; repeat for more")
      ->required()
      ->allow_extra_args(false)
      ->type_name("D");
  command->callback([text, &run] { run = [text](Session& session) { return RunBlur(*text, session); }; });
}

}  // namespace lensd::cli
