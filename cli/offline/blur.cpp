// lensctl blur: the blur of points at given depths, under one of the camera models.

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>

#include "cli/commands.h"
#include "cli/exact_lens.h"
#include "cli/lens_options.h"
#include "cli/text.h"
#include "optics/aperture.h"
#include "optics/diffraction.h"
#include "proto/json.h"

namespace lensd::cli {
namespace {

using optics::DiffractionConvention;

struct BlurText {
  std::string focal_length, f_number, aperture_diameter, focus, extension, sensor_distance, model, wavelength;
  std::string diffraction = "airy";
  std::vector<std::string> at;
};

enum class Model { Pinhole, Aperture, Thin, Diffraction };

/// One row of the answer.
struct BlurAt {
  Depth object;                          // from the lens centre
  double blur_m = 0.0;                   // diffraction included where the model has it
  double signed_blur_m = 0.0;            // geometric: positive behind the focal plane
  std::optional<double> image_distance;  // metres; nothing where no lens forms an image, or it is at infinity
};

std::unexpected<Error> Usage(std::string message) {
  return Fail(Code::InvalidArgument, std::move(message));
}

Result<Model> ParseModel(const BlurText& text) {
  if (text.model.empty()) return text.wavelength.empty() ? Model::Thin : Model::Diffraction;
  const std::string_view names[] = {"pinhole", "aperture", "thin", "diffraction"};
  const auto* found = std::ranges::find(names, text.model);
  if (found == std::end(names)) {
    return Usage("--model '" + text.model + "': say pinhole, aperture, thin or diffraction");
  }
  const auto model = static_cast<Model>(found - names);
  if (model == Model::Thin && !text.wavelength.empty()) {
    return Usage("--wavelength has no part in the thin model; say --model diffraction");
  }
  return model;
}

/// Which options the model needs, and which it has no use for.
Result<void> CheckOptions(const BlurText& text, Model model) {
  const bool lens = model == Model::Thin || model == Model::Diffraction;
  const int planes = !text.focus.empty() + !text.extension.empty() + !text.sensor_distance.empty();
  if (lens) {
    if (text.focal_length.empty()) return Usage("--focal-length is required, such as 50mm");
    if (text.f_number.empty() == text.aperture_diameter.empty()) {
      return Usage("give the opening once: --f-number or --aperture-diameter");
    }
    if (planes != 1) return Usage("say where the sensor stands, once: --focus, --extension or --sensor-distance");
    return {};
  }
  if (!text.focus.empty() || !text.extension.empty() || !text.f_number.empty()) {
    return Usage(
        "without a lens nothing is focused: give --sensor-distance and --aperture-diameter, not --focus, "
        "--extension or --f-number");
  }
  if (text.sensor_distance.empty()) return Usage("--model " + text.model + " needs --sensor-distance");
  const bool needs_hole = model == Model::Aperture || !text.wavelength.empty();
  if (needs_hole && text.aperture_diameter.empty())
    return Usage("--model " + text.model + " needs --aperture-diameter");
  return {};
}

struct Diffraction {
  std::optional<Metres> wavelength;
  DiffractionConvention convention = DiffractionConvention::Airy;
};

Result<Diffraction> ParseDiffraction(const BlurText& text, Model model) {
  Diffraction diffraction;
  if (text.diffraction == "mtf50") diffraction.convention = DiffractionConvention::Mtf50;
  if (text.diffraction != "mtf50" && text.diffraction != "airy") {
    return Usage("--diffraction '" + text.diffraction + "': say airy or mtf50");
  }
  if (text.wavelength.empty() && model != Model::Diffraction) return diffraction;
  const auto wavelength = ParsePositiveLength(text.wavelength.empty() ? "550nm" : text.wavelength, "--wavelength");
  if (!wavelength) return std::unexpected(wavelength.error());
  diffraction.wavelength = Metres{wavelength->Nearest().value()};
  return diffraction;
}

double WithDiffraction(double geometric, const Diffraction& diffraction, double working_f_number) {
  if (!diffraction.wavelength) return std::abs(geometric);
  const Metres disk =
      optics::DiffractionBlur(diffraction.convention, *diffraction.wavelength, FNumber{working_f_number});
  return optics::TotalBlur(Metres{std::abs(geometric)}, disk).value;
}

Result<Ratio> ParseFNumberOf(const BlurText& text, const Decimal& focal_length) {
  if (!text.f_number.empty()) {
    auto number = ParseFNumber(text.f_number, "--f-number");
    if (!number) return PassOn(std::move(number));
    return Ratio{*number};
  }
  auto diameter = ParsePositiveLength(text.aperture_diameter, "--aperture-diameter");
  if (!diameter) return PassOn(std::move(diameter));
  return Ratio{focal_length, *diameter};
}

Result<Ratio> ParseExtensionOf(const BlurText& text, const Decimal& f, std::optional<From> from) {
  if (!text.focus.empty()) {
    const auto focus = ParseDepth(text.focus, "--focus");
    if (!focus) return std::unexpected(focus.error());
    const auto centred = FocusFromCentre(f, *focus, ScaleOf(from));
    if (!centred) return std::unexpected(centred.error());
    return *ExtensionFocusedAt(f, *centred);
  }
  const bool direct = !text.extension.empty();
  const auto length = direct ? ParseExactLength(text.extension, "--extension")
                             : ParsePositiveLength(text.sensor_distance, "--sensor-distance");
  if (!length) return std::unexpected(length.error());
  if (direct && !(f + *length).IsPositive()) {
    return Usage("--extension '" + text.extension + "' would put the sensor at or before the lens centre");
  }
  return Ratio{direct ? *length : *length - f};
}

Result<std::vector<Depth>> ParseObjects(const BlurText& text) {
  std::vector<Depth> objects;
  for (const std::string& at : text.at) {
    const auto depth = ParseDepth(at, "--at");
    if (!depth) return std::unexpected(depth.error());
    if (depth->value < 0.0) return Usage("--at '" + at + "': past infinity there are no subjects; write inf");
    objects.push_back(*depth);
  }
  return objects;
}

Result<std::vector<BlurAt>> LensBlur(const BlurText& text, const Diffraction& diffraction, std::optional<From> from) {
  const auto f = ParseFocalLength(text.focal_length);
  if (!f) return std::unexpected(f.error());
  const auto number = ParseFNumberOf(text, *f);
  if (!number) return std::unexpected(number.error());
  const auto extension = ParseExtensionOf(text, *f, from);
  if (!extension) return std::unexpected(extension.error());
  const auto objects = ParseObjects(text);
  if (!objects) return std::unexpected(objects.error());
  const auto e = extension->Value(), n = number->Value();
  if (!e || !n) return std::unexpected(e ? n.error() : e.error());
  const double working = *n * (1.0 + *e / f->Nearest().value());
  std::vector<BlurAt> rows;
  for (const Depth& object : *objects) {
    const auto centred = ObjectFromCentre(*f, Metres{*e}, object, ScaleOf(from));
    if (!centred) return std::unexpected(centred.error());
    const auto blur = SignedBlur({*f, *number, *extension}, *centred).Value();
    if (!blur) return std::unexpected(blur.error());
    BlurAt row{*centred, WithDiffraction(*blur, diffraction, working), *blur, std::nullopt};
    if (const auto image = ImageDepth(*f, *centred)) {
      const auto distance = image->Value();
      if (!distance) return std::unexpected(distance.error());
      row.image_distance = *distance;
    }
    rows.push_back(row);
  }
  return rows;
}

Result<std::vector<BlurAt>> HoleBlur(const BlurText& text, Model model, const Diffraction& diffraction,
                                     std::optional<From> from) {
  const auto distance = ParsePositiveLength(text.sensor_distance, "--sensor-distance");
  if (!distance) return std::unexpected(distance.error());
  auto diameter = Result<Decimal>(Decimal());
  if (!text.aperture_diameter.empty()) diameter = ParsePositiveLength(text.aperture_diameter, "--aperture-diameter");
  if (!diameter) return std::unexpected(diameter.error());
  const auto objects = ParseObjects(text);
  if (!objects) return std::unexpected(objects.error());
  const optics::Aperture hole{{diameter->Nearest().value()}, {distance->Nearest().value()}};
  std::vector<BlurAt> rows;
  for (const Depth& object : *objects) {
    // Without a lens "focal length plus extension" is simply where the sensor stands.
    const auto centred = ObjectFromCentre(*distance, Metres{0.0}, object, ScaleOf(from));
    if (!centred) return std::unexpected(centred.error());
    const optics::ObjectDepth place =
        centred->IsDistance() ? optics::ObjectDepth(Metres{centred->value}) : optics::ObjectDepth(centred->Vergence());
    const double geometric = model == Model::Pinhole ? 0.0 : -optics::Blur(hole, place).value;
    const double working = hole.diameter.value > 0.0 ? hole.sensor_distance / hole.diameter : 0.0;
    rows.push_back({*centred, WithDiffraction(geometric, diffraction, working), geometric, std::nullopt});
  }
  return rows;
}

Result<std::vector<BlurAt>> Compute(const BlurText& text, std::optional<From> from) {
  const auto model = ParseModel(text);
  if (!model) return std::unexpected(model.error());
  if (const auto checked = CheckOptions(text, *model); !checked) return std::unexpected(checked.error());
  const auto diffraction = ParseDiffraction(text, *model);
  if (!diffraction) return std::unexpected(diffraction.error());
  if (*model == Model::Thin || *model == Model::Diffraction) return LensBlur(text, *diffraction, from);
  return HoleBlur(text, *model, *diffraction, from);
}

proto::Json RowJson(const BlurAt& row) {
  const double vergence = row.object.Vergence().value;
  return {{"distanceM", row.object.IsDistance() ? proto::Json(row.object.value)
                        : vergence > 0.0        ? proto::NumberOrNull(1.0 / vergence)
                                                : proto::Json(nullptr)},
          {"vergenceD", vergence},
          {"blurUm", row.blur_m * 1e6},
          {"signedBlurUm", row.signed_blur_m * 1e6},
          {"imageDistanceMm", row.image_distance ? proto::Json(*row.image_distance * 1e3) : proto::Json(nullptr)}};
}

Outcome RunBlur(const BlurText& text, Session& session) {
  const auto rows = Compute(text, session.globals().from);
  if (!rows) return Refuse(rows);
  if (session.json()) {
    proto::Json answer = proto::Json::array();
    for (const BlurAt& row : *rows) answer.push_back(RowJson(row));
    session.PrintJson(answer);
    return Exit::Done;
  }
  std::vector<std::vector<std::string>> table{{"subject", "blur [um]", "signed [um]", "image at [mm]"}};
  for (const BlurAt& row : *rows) {
    table.push_back({DepthText(row.object.Vergence()), Short(row.blur_m * 1e6), Short(row.signed_blur_m * 1e6),
                     row.image_distance ? Short(*row.image_distance * 1e3, 6) : "none"});
  }
  session.PrintText(TableText(table));
  return Exit::Done;
}

}  // namespace

void AddBlur(CLI::App& root, Run& run) {
  auto text = std::make_shared<BlurText>();
  CLI::App* command = root.add_subcommand("blur", "blur of points at given depths")->group(kOffline);
  command->add_option("--focal-length", text->focal_length, "focal length, such as 50mm")->type_name("F");
  command->add_option("--f-number", text->f_number, "f-number, such as 2.8 or f/2.8")->type_name("N");
  command->add_option("--aperture-diameter", text->aperture_diameter, "diameter of the opening, instead of an f-number")
      ->type_name("A");
  command->add_option("--focus", text->focus, "distance or vergence in focus: 2m, 0.5D, inf")->type_name("D");
  command->add_option("--extension", text->extension, "sensor distance beyond the focal length, instead of --focus")
      ->type_name("E");
  command->add_option("--sensor-distance", text->sensor_distance, "lens centre to sensor, instead of --focus")
      ->type_name("Z");
  command
      ->add_option("--model", text->model,
                   "pinhole, aperture (a hole without a lens), thin (default) or diffraction (default with "
                   "--wavelength)")
      ->type_name("MODEL");
  command->add_option("--wavelength", text->wavelength, "count diffraction at this wavelength (550nm)")->type_name("L");
  command->add_option("--diffraction", text->diffraction, "its convention: airy (default) or mtf50")->type_name("KIND");
  command->add_option("--at", text->at, "distance or vergence of a point; repeat for more")
      ->required()
      ->allow_extra_args(false)
      ->type_name("D");
  command->callback([text, &run] { run = [text](Session& session) { return RunBlur(*text, session); }; });
}

}  // namespace lensd::cli
