// Pictures of 8 bits a sample into JPEG.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"

namespace lensd::drivers::pixels {

/// A baseline JPEG, for eyes: `samples` are width * height * channels bytes, row-major, without padding; channels is 1
/// (grey) or 3 (red, green, blue). `quality` is from 1 to 100. From any thread. InvalidArgument: sizes that do not fit
/// together or that JPEG does not know (65,535 px a side). Internal: no encoder to be had.
Result<std::vector<std::uint8_t>> EncodeJpeg(std::span<const std::uint8_t> samples, int width, int height, int channels,
                                             int quality);

}  // namespace lensd::drivers::pixels
