// What each pixel makes of the light that falls on it, the same in every frame: the lens' natural vignetting, dirt on
// the cover glass, pixels of different gain, hot pixels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim/pictures.h"
#include "sim/scene.h"

namespace lensd::sim {

/// Off-axis light falls off as the fourth power of the cosine of its angle (Kingslake, Optical System Design, ch. 8).
/// Dirt is a disk out of focus: even in the middle, its edge as wide as its radius. Gains are normal, hot pixels even
/// from 0.1 to 1 of the well.
class SensorMap {
 public:
  /// For one sensor of the camera; a camera with colour has one a channel, under the same dirt.
  SensorMap(const CameraSettings& camera, double vignetting, Channel channel);

  /// `light` of the whole frame; `hot_light` is the light that would gather as much as a full well of dark current.
  void Apply(std::span<float> light, float hot_light) const;

 private:
  struct HotPixel {
    std::size_t index;
    float of_well;
  };
  void Vignette(double at_corner);
  void AddDirt();
  void AddPixels(Channel channel);

  CameraSettings camera_;
  std::vector<float> gain_;  ///< empty: 1 everywhere
  std::vector<HotPixel> hot_;
};

}  // namespace lensd::sim
