// From an exposure to the samples the sensor gives.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <stop_token>
#include <vector>

#include "sim/camera/frame_grid.h"
#include "sim/camera/sensor_map.h"
#include "sim/mechanics/mechanics.h"
#include "sim/pictures.h"

namespace lensd::sim {

/// All that a frame depends on: made of the same shot, frames are the same bits.
struct Shot {
  Exposure exposure;              ///< as the frame will say
  Duration length{};              ///< as it really was
  double amplification = 1.0;     ///< of what the sensor has gathered
  std::vector<TrueState> states;  ///< of the lens during the exposure, equally long each
};

/// What the sensor gives: see drivers::Frame.
struct Samples {
  std::shared_ptr<const std::vector<std::uint16_t>> luminance;
  std::shared_ptr<const std::vector<std::uint16_t>> colour;  ///< null: a camera without
};

/// As the scene says, or without noise, shake, a sensor's flaws, glare and JPEG.
enum class Sensor { Real, Ideal };

/// Makes frames of one world, one at a time, on whichever thread asks; or gives those that the scene has prepared.
class FrameMaker {
 public:
  FrameMaker(std::shared_ptr<Mechanics> mechanics, std::shared_ptr<Pictures> pictures, Sensor sensor,
             std::uint64_t seed);

  /// What the lens and the faults make of an exposure that is over but not long past.
  Shot ShotOf(const Exposure& exposure) const;
  /// Cancelled: `stop` came. Other errors as Pictures::At().
  Result<Samples> Make(const Shot& shot, const std::stop_token& stop);

 private:
  const SensorMap& MapOf(Channel channel);
  /// What one sensor of the camera gives.
  Result<std::vector<std::uint16_t>> Exposed(const Shot& shot, Channel channel, const std::stop_token& stop);

  const std::shared_ptr<Mechanics> mechanics_;
  const std::shared_ptr<Pictures> pictures_;
  const CameraSettings camera_;
  const std::uint64_t seed_;
  std::map<Channel, SensorMap> maps_;  ///< made when first needed
  std::vector<float> light_;           ///< 1 is white; kept between frames, for its memory
};

}  // namespace lensd::sim
