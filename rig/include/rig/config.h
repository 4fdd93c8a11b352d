// How one lens is set up: the part of a [[lens]] section that is about optics and motion, not about the driver.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "base/clock.h"
#include "base/settings.h"
#include "base/units.h"
#include "drivers/api/device.h"
#include "drivers/api/lens.h"
#include "optics/focus_scale.h"

namespace lensd::rig {

/// How a step is divided so that an actuator that rings arrives at rest; see rig/motion/shaping.h.
enum class Shaper { None, Split, Zv, Zvd, Ramp };

/// What a remembered position is worth when lensd starts again; see rig/position_memory.h.
enum class Restore { Never, Always, NearZero, Conditional };

/// One axis: [lens.focus], [lens.iris], [lens.zoom], [lens.filter].
struct AxisConfig {
  AxisConfig() = default;                       // no aggregate: GCC 12 crashes on `{}` for a RigConfig otherwise
  std::optional<drivers::Direction> direction;  ///< of focus, as configured
  std::optional<drivers::Direction> seen;       ///< of focus, as a measurement of this lens has shown it
  std::optional<bool> approach_near;            ///< of focus: the side that its last motion goes toward; default near
  std::optional<double> backlash;   ///< native units to overshoot by when arriving from the other side; default unknown
  std::optional<Duration> settle;   ///< from standing still to a steady picture; default what the driver says
  std::optional<double> tolerance;  ///< native units; default one resolution
  std::optional<std::pair<Native, Native>> limits;  ///< soft limits; default what the device takes
  std::optional<double> speed;  ///< native units per second; default what the driver says, or the whole range in 60 s
  double deadband = 0.0;        ///< native units: a target this near is reached already
  int retries = 2;              ///< commands repeated where it came to rest beyond `tolerance`
  bool settle_by_readback = false;    ///< settled when the readings stand still, instead of after `settle`
  double repeatability = 0.0;         ///< native units: how far a steady readback may be from the mechanism it measures
  std::optional<double> lost_travel;  ///< part of all travel since the reference that may have been lost unnoticed
  std::optional<double> check_reference_every;  ///< native units of travel, after which the reference is searched anew
  bool home_on_demand = false;  ///< the reference is searched before the first move, where nothing tells the position
  std::optional<double> sag;    ///< native units, without feedback only: how far from the command; default `tolerance`
  Duration latency = Duration::zero();  ///< readings may be this much older than they say
  Restore restore = Restore::Never;
  bool keep = false;           ///< of focus: brought back where another program moved it; for who drives the rig
  std::optional<Native> park;  ///< where it goes when lensd ends; default nowhere
  Shaper shaper = Shaper::None;
  double ring_hz = 0.0;       ///< of the actuator, damping included; above 0 where there is a shaper
  double ring_damping = 0.0;  ///< of critical, below 1
};

/// What to do about a lens that gets warm: [lens.temperature]. What the calibration knows counts where nothing is said.
struct TemperatureConfig {
  bool compensate = false;                         ///< correct positions, and follow the temperature while idle
  std::optional<Metres> metres_per_degree;         ///< extension gained per degree at one focus position
  std::optional<Celsius> reference;                ///< where that is 0
  double minimum_move = 4.0;                       ///< native units of focus: smaller corrections wait
  std::pair<Celsius, Celsius> range{-40.0, 80.0};  ///< readings outside are left out
  double most_per_minute = 5.0;                    ///< degrees: readings that change faster are left out
};

/// When focus is corrected by itself, once an autofocus has reached it: [lens.refocus].
struct RefocusConfig {
  std::optional<Duration> every;       ///< since the last search
  std::optional<Celsius> temperature;  ///< a change of so much since the last correction
  enum class OnFilter { Ignore, Shift, Search };
  OnFilter filter = OnFilter::Ignore;                    ///< what another filter calls for
  std::optional<double> sharpness_loss;                  ///< the share of the sharpness reached
  Duration look_every = std::chrono::seconds(10);        ///< frames for that
  Duration minimum_interval = std::chrono::seconds(60);  ///< between two corrections
  std::optional<Metres> move_within;  ///< extension: moves by what was learned where that is so sure; nothing: searches
};

/// Everything a rig is told.
struct RigConfig {
  std::optional<drivers::NominalOptics> optics;  ///< from [lens.optics]; otherwise the driver's, if it knows
  double pupil_factor = 1.0;                     ///< exit over entrance pupil diameter, for the planner
  bool use_learned_slope = true;                 ///< autofocus goes by the slope of blur that earlier runs showed
  optics::FocusScale scale;                      ///< where configured distances start
  double focal_length_tolerance = 0.0;           ///< relative; enters every bound that a focal length enters
  std::optional<Metres> wavelength;              ///< of the light in use, where the calibration depends on it
  std::optional<std::string> calibration_path;   ///< of [lens.optics]; the rig's maker reads it
  TemperatureConfig temperature;
  std::optional<RefocusConfig> refocus;  ///< for who drives the rig
  drivers::PerAxis<AxisConfig> axes;
};

/// Why it would go unnoticed that another program has moved focus of this lens (AxisConfig::keep); empty: it would not.
std::string WhyFocusIsNotKept(const drivers::Capabilities& lens);

/// Who has to say what optics a lens has: [lens.optics], where there is one, or the driver, which knows.
enum class NominalFrom { Configuration, Driver };

/// Takes the keys of RigConfig (distance_from, optics, focus, iris, zoom, filter, temperature, refocus) out of a
/// [[lens]] table, leaving the others to the caller, who calls lens.Finish(). What is wrong inside a sub-table is the
/// error; what is wrong with the keys themselves is recorded in `lens`.
Result<RigConfig> ReadRigConfig(SettingsReader& lens, NominalFrom nominal = NominalFrom::Configuration);

}  // namespace lensd::rig
