// Blur over depth as a picture, of any camera model.
#pragma once

#include <optional>
#include <string>

#include "cli/offline/camera_system.h"
#include "io/svg.h"

namespace lensd::cli {

/// "50 mm f/2.8", "hole 0.3 mm wide, sensor at 50 mm": for titles.
std::string SystemName(const CameraSystem& system);

/// In which unit blur is drawn: pixels where their size is known, else micrometres.
struct BlurUnit {
  std::optional<double> pixel_um;

  double Of(double um) const { return pixel_um ? um / *pixel_um : um; }
  std::string Name() const { return pixel_um ? "px" : "um"; }
};

/// Axes and the curve of blur between two vergences, `far` < `near`, and the plane in focus where it lies between. The
/// caller adds the title and what it knows besides. OutOfRange: what doubles do not hold.
Result<io::Chart> BlurOverDepth(const CameraSystem& system, Dioptres far, Dioptres near, BlurUnit unit);

}  // namespace lensd::cli
