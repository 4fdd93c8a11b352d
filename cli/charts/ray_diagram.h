// The way of light from points through a lens or a hole to the sensor, as a drawing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/units.h"
#include "io/svg.h"

namespace lensd::cli {

/// A point whose light is followed through the edge and the centre of the opening.
struct RayPoint {
  std::string name;              ///< "subject"; its distance is written behind it
  Dioptres vergence;             ///< from the lens centre; 0: infinitely far; below 0: light that converges
  bool off_axis = false;         ///< drawn above the axis, as high as the opening is wide
  std::optional<Metres> blur{};  ///< diameter of its disk on the sensor; none: no disk is drawn
};

/// What the light goes through.
struct RaySystem {
  std::string title;
  std::optional<Metres> focal_length{};     ///< > 0; none: no lens in the opening
  std::optional<Metres> diameter{};         ///< of the opening; 0: a pinhole; none: it was not said
  std::optional<Metres> sensor_distance{};  ///< > 0, from the lens centre; none: there is a lens, and one point
  Metres principal_gap{0.0};                ///< above 0 both principal planes are drawn
  std::vector<RayPoint> points{};           ///< few: each has a colour and three labels
};

/// Lens or hole, principal planes where they are apart, points, their images (dashed rays lead to virtual ones), plane
/// in focus, sensor and blur disks. Order along the axis and the ratios of the disks to each other are true; what is
/// not to scale is said below. All numbers are those of the system, none is read off the drawing.
io::Chart RayDiagram(const RaySystem& system);

}  // namespace lensd::cli
