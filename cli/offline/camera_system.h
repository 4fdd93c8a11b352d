// The options that describe one of the lecture's camera systems: pinhole, bare aperture, thin lens, thin lens with
// diffraction.
#pragma once

#include <optional>
#include <string>

#include "cli/lens_options.h"
#include "optics/diffraction.h"

namespace CLI {
class App;
}

namespace lensd::cli {

enum class CameraModel { Pinhole, Aperture, Thin, Diffraction };

/// The options as written.
struct SystemText {
  std::string focal_length, f_number, aperture_diameter, focus, extension, sensor_distance, model, wavelength;
  std::string blur_limit, pixel;  ///< of --focus hyperfocal, where the command takes it
  std::string diffraction = "airy";
};
void AddSystemOptions(CLI::App& command, SystemText& text);
/// --blur-limit and --pixel, for --focus hyperfocal.
void AddHyperfocalOptions(CLI::App& command, SystemText& text);
/// `--pixel`; nothing where it was left out.
Result<std::optional<Decimal>> ParsePixel(const std::string& text);

/// An opening `diameter` wide with a sensor `sensor_distance` behind it, and a lens in it or none. Exact.
struct CameraSystem {
  CameraModel model = CameraModel::Thin;
  std::optional<Decimal> focal_length;  ///< of the lens
  Rational diameter = 0;                ///< 0: a pinhole whose size was not said
  Rational sensor_distance;             ///< > 0
  std::optional<Metres> wavelength;     ///< counts diffraction
  optics::DiffractionConvention convention = optics::DiffractionConvention::Airy;

  /// Geometric, positive behind the plane in focus; a pinhole has none.
  Rational SignedBlur(const Place& at) const;
  /// Z_s/A; the diameter must not be 0.
  Rational WorkingFNumber() const { return sensor_distance / diameter; }
  /// Diameter of the disk with diffraction in it where that is counted.
  Result<double> BlurDisk(const Rational& geometric) const;
  /// A subject's depth from the lens centre, wherever its distance was measured from.
  Result<Depth> FromCentre(const Depth& object, std::optional<From> from) const;
};

/// Reads the options. Fails where the model lacks one, or has no use for it: without a lens nothing is focused.
Result<CameraSystem> ReadSystem(const SystemText& text, std::optional<From> from);

/// A real subject's depth: past infinity there are none.
Result<Depth> ParseObject(const std::string& text, std::string_view option);

}  // namespace lensd::cli
