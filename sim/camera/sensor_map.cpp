// One factor a pixel, worked out once; every draw depends on the scene's flaw_seed alone.
#include "sim/camera/sensor_map.h"

#include <algorithm>
#include <cmath>

#include "sim/camera/noise.h"

namespace lensd::sim {
namespace {

constexpr double kSmallest = 0.3;   // of dirt_px and of dirt_loss
constexpr double kLeastHot = 0.1;   // of the well
constexpr float kLeastGain = 0.0f;  // five sigmas below 1 are below 0 from a prnu of 0.2 on

/// Even in [low, high).
double Even(std::uint64_t key, double low, double high) {
  return low + (high - low) * static_cast<double>(Mix(key) >> 11) * 0x1p-53;
}

/// What a disk out of focus hides of the light at that distance from its middle, of what it hides there.
double ShadowAt(double distance, double radius) {
  const double in = std::clamp(1.5 - distance / radius, 0.0, 1.0);
  return in * in * (3.0 - 2.0 * in);
}

}  // namespace

SensorMap::SensorMap(const CameraSettings& camera, double vignetting, Channel channel) : camera_(camera) {
  const SensorFlaws& flaws = camera.flaws;
  if (vignetting == 0.0 && !flaws.any()) return;
  gain_.assign(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), 1.0f);
  if (vignetting > 0.0) Vignette(vignetting);
  AddDirt();
  AddPixels(channel);
}

void SensorMap::Vignette(double at_corner) {
  // cos^4 = 1/(1 + tan^2)^2, and the tangent grows evenly from the middle to the corner.
  const double corner = 1.0 / std::sqrt(1.0 - at_corner) - 1.0;
  const double middle_x = 0.5 * camera_.width, middle_y = 0.5 * camera_.height;
  const double half_diagonal_2 = middle_x * middle_x + middle_y * middle_y;
  for (int y = 0; y < camera_.height; ++y) {
    for (int x = 0; x < camera_.width; ++x) {
      const double dx = x + 0.5 - middle_x, dy = y + 0.5 - middle_y;
      const double spread = 1.0 + corner * (dx * dx + dy * dy) / half_diagonal_2;
      gain_[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) + static_cast<std::size_t>(x)] *=
          static_cast<float>(1.0 / (spread * spread));
    }
  }
}

void SensorMap::AddDirt() {
  const SensorFlaws& flaws = camera_.flaws;
  for (int i = 0; i < flaws.dirt; ++i) {
    const std::uint64_t key = Mix(Mix(flaws.seed) + static_cast<std::uint64_t>(i));
    const double middle_x = Even(key, 0.0, camera_.width), middle_y = Even(key + 1, 0.0, camera_.height);
    const double radius = 0.5 * flaws.dirt_px * Even(key + 2, kSmallest, 1.0);
    const double loss = flaws.dirt_loss * Even(key + 3, kSmallest, 1.0);
    const auto first = [&](double middle) { return std::max(0, static_cast<int>(middle - 1.5 * radius)); };
    const auto end = [&](double middle, int size) {
      return std::min(size, static_cast<int>(middle + 1.5 * radius) + 1);
    };
    for (int y = first(middle_y); y < end(middle_y, camera_.height); ++y) {
      for (int x = first(middle_x); x < end(middle_x, camera_.width); ++x) {
        const double shadow = ShadowAt(std::hypot(x + 0.5 - middle_x, y + 0.5 - middle_y), radius);
        gain_[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) + static_cast<std::size_t>(x)] *=
            static_cast<float>(1.0 - loss * shadow);
      }
    }
  }
}

void SensorMap::AddPixels(Channel channel) {
  const SensorFlaws& flaws = camera_.flaws;
  const std::uint64_t key = Mix(~flaws.seed ^ (static_cast<std::uint64_t>(channel) << 56));
  if (flaws.prnu > 0.0) {
    std::vector<float> draws(gain_.size());
    FillNormals(key, draws);
    for (std::size_t i = 0; i < gain_.size(); ++i) {
      gain_[i] *= std::max(1.0f + static_cast<float>(flaws.prnu) * draws[i], kLeastGain);
    }
  }
  if (flaws.hot_pixels == 0.0) return;
  for (std::size_t i = 0; i < gain_.size(); ++i) {
    const std::uint64_t own = Mix(key + 1) + 2 * i;
    if (Even(own, 0.0, 1.0) >= flaws.hot_pixels) continue;
    hot_.push_back({i, static_cast<float>(Even(own + 1, kLeastHot, 1.0))});
  }
}

void SensorMap::Apply(std::span<float> light, float hot_light) const {
  if (gain_.empty()) return;
  for (std::size_t i = 0; i < light.size(); ++i) light[i] *= gain_[i];
  for (const HotPixel& hot : hot_) light[hot.index] += hot.of_well * hot_light;
}

}  // namespace lensd::sim
