// Axial colour: the lens focuses red, green and blue at different extensions.
#pragma once

#include <array>
#include <vector>

#include "sim/pictures.h"
#include "sim/scene.h"

namespace lensd::sim {

/// Light of one colour: its share of what the sensor sees, and how much more extension it needs than green.
struct ColourShare {
  double share;
  double extension_m;
};

/// What a sensor of the camera sees: a camera without colour all three, by Rec. 709 luminance.
inline std::vector<ColourShare> ColoursSeen(const Scene& scene, Channel channel) {
  const auto [red_um, blue_um] = scene.lens.colour_focus_um;
  const std::array<ColourShare, 3> all{{{0.2126, 1e-6 * red_um}, {0.7152, 0.0}, {0.0722, 1e-6 * blue_um}}};
  if (channel != Channel::Luminance) return {{1.0, all[static_cast<std::size_t>(channel) - 1].extension_m}};
  if (red_um == 0.0 && blue_um == 0.0) return {{1.0, 0.0}};
  return {all.begin(), all.end()};
}

}  // namespace lensd::sim
