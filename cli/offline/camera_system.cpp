// Reads a camera system from the command line. Which options go together depends on the model: a lens is focused, a
// hole only stands before its sensor.
#include "cli/offline/camera_system.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>

namespace lensd::cli {
namespace {

namespace thin_lens = optics::thin_lens;

std::unexpected<Error> Usage(std::string message) {
  return Fail(Code::InvalidArgument, std::move(message));
}

Result<CameraModel> ParseModel(const SystemText& text) {
  if (text.model.empty()) return text.wavelength.empty() ? CameraModel::Thin : CameraModel::Diffraction;
  const std::string_view names[] = {"pinhole", "aperture", "thin", "diffraction"};
  const auto* found = std::ranges::find(names, text.model);
  if (found == std::end(names)) {
    return Usage("--model '" + text.model + "': say pinhole, aperture, thin or diffraction");
  }
  const auto model = static_cast<CameraModel>(found - names);
  if (model == CameraModel::Thin && !text.wavelength.empty()) {
    return Usage("--wavelength has no part in the thin model; say --model diffraction");
  }
  return model;
}

Result<void> ReadDiffraction(const SystemText& text, CameraSystem& system) {
  if (text.diffraction == "mtf50") system.convention = optics::DiffractionConvention::Mtf50;
  if (text.diffraction != "mtf50" && text.diffraction != "airy") {
    return Usage("--diffraction '" + text.diffraction + "': say airy or mtf50");
  }
  if (text.wavelength.empty() && system.model != CameraModel::Diffraction) return {};
  const auto wavelength = ParsePositiveLength(text.wavelength.empty() ? "550nm" : text.wavelength, "--wavelength");
  if (!wavelength) return PassOn(wavelength);
  system.wavelength = Metres{wavelength->Nearest().value()};
  return {};
}

Result<void> ReadLensOpening(const SystemText& text, CameraSystem& system) {
  if (text.focal_length.empty()) return Usage("--focal-length is required, such as 50mm");
  if (text.f_number.empty() == text.aperture_diameter.empty()) {
    return Usage("give the opening once: --f-number or --aperture-diameter, such as --f-number 2.8");
  }
  auto f = ParseFocalLength(text.focal_length);
  if (!f) return PassOn(f);
  system.focal_length = *f;
  const bool by_number = !text.f_number.empty();
  const auto opening = by_number ? ParseFNumber(text.f_number, "--f-number")
                                 : ParsePositiveLength(text.aperture_diameter, "--aperture-diameter");
  if (!opening) return PassOn(opening);
  system.diameter = by_number ? Rational(f->ToRational() / opening->ToRational()) : opening->ToRational();
  return {};
}

/// The depth in focus at the hyperfocal distance: everything from half of it to infinity is blurred by at most the
/// limit.
Result<Rational> HyperfocalDistance(const SystemText& text, const CameraSystem& system) {
  if (text.blur_limit.empty()) {
    return Usage("--focus hyperfocal needs --blur-limit: the blur that still counts as sharp, such as 20um");
  }
  const auto pixel = ParsePixel(text.pixel);
  if (!pixel) return PassOn(pixel);
  const auto limit = ParseBlurLimit(text.blur_limit, *pixel, "--blur-limit");
  if (!limit) return PassOn(limit);
  const Rational f = system.focal_length->ToRational();
  return thin_lens::Hyperfocal<Rational>(f, f / system.diameter, limit->ToRational());
}

Result<void> ReadLensPlane(const SystemText& text, std::optional<From> from, CameraSystem& system) {
  const int planes = !text.focus.empty() + !text.extension.empty() + !text.sensor_distance.empty();
  if (planes != 1)
    return Usage("say where the sensor stands, once: --focus, --extension or --sensor-distance, such as --focus 2m");
  const Rational f = system.focal_length->ToRational();
  if (text.focus == "hyperfocal") {
    const auto distance = HyperfocalDistance(text, system);
    if (!distance) return PassOn(distance);
    system.sensor_distance = f + thin_lens::Extension<Rational>(f, Place{*distance, 1});
  } else if (!text.focus.empty()) {
    const auto focus = ParseDepth(text.focus, "--focus");
    if (!focus) return PassOn(focus);
    const auto centred = FocusFromCentre(*system.focal_length, *focus, ScaleOf(from));
    if (!centred) return PassOn(centred);
    system.sensor_distance = f + thin_lens::Extension(f, PlaceOf(*centred));
  } else {
    const bool direct = !text.extension.empty();
    const auto length = direct ? ParseExactLength(text.extension, "--extension")
                               : ParsePositiveLength(text.sensor_distance, "--sensor-distance");
    if (!length) return PassOn(length);
    system.sensor_distance = length->ToRational() + (direct ? f : Rational(0));
  }
  if (system.sensor_distance > 0) return {};
  return Usage((text.focus.empty() ? "--extension '" + text.extension : "--focus '" + text.focus) +
               "' would put the sensor at or before the lens centre");
}

Result<void> ReadHole(const SystemText& text, CameraSystem& system) {
  if (!text.focal_length.empty() || !text.focus.empty() || !text.extension.empty() || !text.f_number.empty()) {
    return Usage(
        "without a lens nothing is focused: give --sensor-distance and --aperture-diameter, not --focal-length, "
        "--f-number, --focus or --extension");
  }
  if (text.sensor_distance.empty())
    return Usage("--model " + text.model + " needs --sensor-distance, such as --sensor-distance 50mm");
  const auto distance = ParsePositiveLength(text.sensor_distance, "--sensor-distance");
  if (!distance) return PassOn(distance);
  system.sensor_distance = distance->ToRational();
  const bool needs_hole = system.model == CameraModel::Aperture || system.wavelength;
  if (needs_hole && text.aperture_diameter.empty()) {
    return Usage("--model " + text.model + " needs --aperture-diameter, such as --aperture-diameter 0.3mm");
  }
  if (text.aperture_diameter.empty()) return {};
  const auto diameter = ParsePositiveLength(text.aperture_diameter, "--aperture-diameter");
  if (!diameter) return PassOn(diameter);
  system.diameter = diameter->ToRational();
  return {};
}

}  // namespace

Rational CameraSystem::SignedBlur(const Place& at) const {
  if (model == CameraModel::Pinhole) return 0;
  if (!focal_length) return thin_lens::SignedBlurOfHole(diameter, sensor_distance, at);
  const Rational f = focal_length->ToRational();
  return thin_lens::SignedBlur<Rational>({f, f / diameter, sensor_distance - f}, at);
}

Result<double> CameraSystem::BlurDisk(const Rational& geometric) const {
  const auto blur = Rounded(abs(geometric));
  if (!blur || !wavelength) return blur;
  const auto working = Rounded(WorkingFNumber());
  if (!working) return working;
  return optics::TotalBlur(Metres{*blur}, optics::DiffractionBlur(convention, *wavelength, FNumber{*working})).value;
}

Result<Depth> CameraSystem::FromCentre(const Depth& object, std::optional<From> from) const {
  if (!object.IsDistance() || ScaleOf(from).from == optics::DistanceFrom::Lens) return object;
  const auto stands = Rounded(sensor_distance);
  if (!stands) return PassOn(stands);
  // Focal length plus extension is where the sensor stands, with a lens and without one.
  return ObjectFromCentre(Decimal::Shortest(*stands), Metres{0.0}, object, ScaleOf(from));
}

Result<CameraSystem> ReadSystem(const SystemText& text, std::optional<From> from) {
  const auto model = ParseModel(text);
  if (!model) return PassOn(model);
  CameraSystem system;
  system.model = *model;
  Result<void> read = ReadDiffraction(text, system);
  const bool lens = *model == CameraModel::Thin || *model == CameraModel::Diffraction;
  if (read) read = lens ? ReadLensOpening(text, system) : ReadHole(text, system);
  if (read && lens) read = ReadLensPlane(text, from, system);
  if (!read) return PassOn(read);
  return system;
}

Result<std::optional<Decimal>> ParsePixel(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto pitch = ParsePositiveLength(text, "--pixel");
  if (!pitch) return PassOn(pitch);
  return *pitch;
}

Result<Depth> ParseObject(const std::string& text, std::string_view option) {
  auto depth = ParseDepth(text, option);
  if (depth && depth->value < 0.0) return Wrong(option, text, "past infinity there are no subjects; write inf");
  return depth;
}

void AddSystemOptions(CLI::App& command, SystemText& text) {
  const auto add = [&command](const char* name, std::string& place, const char* type, const char* help) {
    command.add_option(name, place, help)->type_name(type)->group("The camera");
  };
  add("--model", text.model, "MODEL",
      "pinhole, aperture (a hole without a lens), thin (default) or diffraction (default with --wavelength)");
  add("--focal-length", text.focal_length, "F", "focal length, such as 50mm");
  add("--f-number", text.f_number, "N", "f-number, such as 2.8 or f/2.8");
  add("--aperture-diameter", text.aperture_diameter, "A", "diameter of the opening, instead of an f-number");
  add("--focus", text.focus, "D", "distance or vergence in focus: 2m, 0.5D, inf; hyperfocal with blur");
  add("--extension", text.extension, "E", "sensor distance beyond the focal length, instead of --focus");
  add("--sensor-distance", text.sensor_distance, "Z", "lens centre or hole to sensor, instead of --focus");
  add("--wavelength", text.wavelength, "L", "count diffraction at this wavelength (550nm)");
  add("--diffraction", text.diffraction, "KIND", "how the diffraction blur is measured: airy (default) or mtf50");
}

void AddHyperfocalOptions(CLI::App& command, SystemText& text) {
  command.add_option("--blur-limit", text.blur_limit, "blur that still counts as sharp, for --focus hyperfocal")
      ->type_name("C");
  command.add_option("--pixel", text.pixel, "size of a pixel; blur is then given in pixels too")->type_name("LENGTH");
}

}  // namespace lensd::cli
