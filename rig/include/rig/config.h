// How one lens is set up: the part of a [[lens]] section that is about optics and motion, not about the driver.
#pragma once

#include <chrono>
#include <optional>
#include <utility>

#include "base/clock.h"
#include "base/settings.h"
#include "base/units.h"
#include "drivers/api/device.h"
#include "drivers/api/lens.h"

namespace lensd::rig {

/// From which point a distance is measured.
enum class DistanceFrom { Lens, Sensor, Front };

/// One axis: [lens.focus], [lens.iris], [lens.zoom], [lens.filter].
struct AxisConfig {
  bool near_positive = true;  ///< focus: larger native positions focus nearer
  bool approach_near = true;  ///< the last motion always goes toward near (iris, zoom: toward larger positions)
  double backlash = 0.0;      ///< native units taken up by arriving from the approach side; 0: none known
  Duration settle{std::chrono::milliseconds(0)};    ///< after the motor stands still
  std::optional<double> tolerance;                  ///< native units; default one resolution
  std::optional<std::pair<Native, Native>> limits;  ///< soft limits; default what the device takes
  std::optional<double> speed;                      ///< native units per second; default the whole range in 10 s
};

/// Everything a rig is told.
struct RigConfig {
  std::optional<drivers::NominalOptics> optics;  ///< from [lens.optics]; otherwise the driver's, if it knows
  DistanceFrom distance_from = DistanceFrom::Lens;
  double principal_gap_m = 0.0;  ///< between the principal planes, for distances from the sensor
  drivers::PerAxis<AxisConfig> axes;
};

/// Takes the keys of RigConfig (distance_from, optics, focus, iris, zoom, filter) out of a [[lens]] table, leaving the
/// others to the caller, who calls lens.Finish(). What is wrong is recorded in `lens`.
RigConfig ReadRigConfig(SettingsReader& lens);

}  // namespace lensd::rig
