// From light to samples: what an image sensor does.
//
// Light in units of the full well becomes a mean number of electrons m. Photon and read noise together have variance
// V = m + r^2 and third cumulant m. With k = m/(6V), one normal draw z gives m + sqrt(V - 2k^2) z + k (z^2 - 1), which
// has that mean, that variance and very nearly that skewness. Below 16 electrons, where a continuous draw is too
// coarse, the photons are drawn exactly. Then the well fills up, the black level is added, gamma applied, and the
// result clipped and rounded to the nearest level. Only additions, multiplications, divisions and square roots of
// floats: the same bits in every build (a gamma other than 1 adds the C library's pow).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/scene.h"

namespace lensd::sim {

/// Samples of `light` (1: full well), scaled by `gain` first. `key` chooses the noise. What the well has gathered, its
/// noise included, is amplified before it is counted.
std::vector<std::uint16_t> Expose(const CameraSettings& camera, std::span<const float> light, float gain,
                                  std::uint64_t key, float amplification = 1.0f);

/// Rec. 709 luminance of red, green and blue samples: weighted as light, given as samples are.
std::vector<std::uint16_t> LuminanceOf(const CameraSettings& camera,
                                       const std::array<std::vector<std::uint16_t>, 3>& channels);

}  // namespace lensd::sim
