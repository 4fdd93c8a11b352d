// What only a simulated device can tell and do: how things truly are, faults on demand, pictures without noise.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "base/clock.h"
#include "base/result.h"
#include "base/units.h"
#include "drivers/api/camera.h"
#include "drivers/api/lens.h"

namespace lensd::drivers {

/// Where the mechanism stands and what the optics do, whatever the device says of itself.
struct SimulatedTruth {
  Instant at{};
  PerAxis<std::optional<Native>> positions;  ///< none: there is no such axis
  double extension_m = 0.0;
  double f_number = 0.0;
  double focal_length_m = 0.0;
  double focal_plane_d = 0.0;         ///< of the plane in focus, from the lens centre; negative past infinity
  std::optional<double> blur_m = {};  ///< where a vergence was asked for; positive behind the plane in focus
  std::size_t pictures_bytes = 0;     ///< of rendered pictures that are remembered now, whatever `at` is
};

/// Something that is to go wrong from now on.
struct SimulatedFault {
  std::string kind;
  std::optional<Axis> axis;       ///< focus if none is given; kinds that are not of one axis take no notice
  std::optional<Duration> lasts;  ///< > 0; none: from now on
  std::optional<double> steps;    ///< of a jump, in native units
  std::optional<double> factor;   ///< of a wrong exposure (>= 0), or the part of each move that is lost (0 to 1)
  std::optional<double> by_c{};   ///< of warmth and of a wrong temperature, in degrees
};

/// Outlives its device; any thread. Nothing that a device with faults does not tell depends on it.
class Simulation : public std::enable_shared_from_this<Simulation> {
 public:
  virtual ~Simulation() = default;
  /// Now if `at` is none. With a vergence (1/m, from the lens centre), its blur as well. OutOfRange: an instant to
  /// come, or one too long past.
  virtual Result<SimulatedTruth> TruthAt(std::optional<Instant> at, std::optional<double> vergence_d) = 0;
  /// InvalidArgument: no such kind, or a number outside its range. Unsupported: the lens has no such axis.
  virtual Result<void> Inject(const SimulatedFault& fault) = 0;
  /// What the camera would give for the exposure that ends now if it had neither noise nor shake. Slow; one at a time.
  /// Cancelled: `stop` came.
  virtual Result<Frame> Render(const std::stop_token& stop) = 0;
};

}  // namespace lensd::drivers
