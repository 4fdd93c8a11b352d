// What a camera makes of its samples before it gives them away: a tone curve, sharpening, JPEG.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/scene.h"

namespace lensd::sim {

/// From samples of 16 bits to those of camera.bits. Tone and sharpening round once, at the end; JPEG works on what came
/// of that, as encoders do.
std::vector<std::uint16_t> Finished(const CameraSettings& camera, const std::vector<std::uint16_t>& deep);

/// What baseline JPEG keeps of samples of 8 bits: the discrete cosine transform of 8 x 8 blocks (ITU-T T.81, A.3.3),
/// its values rounded to multiples of the table of luminance (K.1), which `quality`, 1 to 100, scales as the
/// Independent JPEG Group's encoder does. The last row and column go on beyond the frame.
std::vector<std::uint16_t> ThroughJpeg(int width, int height, const std::vector<std::uint16_t>& samples, int quality);

}  // namespace lensd::sim
