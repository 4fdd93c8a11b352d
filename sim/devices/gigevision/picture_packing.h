// Samples into the pixel formats the simulated camera offers.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace lensd::sim {

/// Bits a pixel takes in a format, from its code.
inline unsigned BitsPerPixel(std::uint32_t format) {
  return (format >> 16) & 0xffu;
}

/// `samples` of `bits` bits in the format of that code; colours are all alike. Empty: no such format here.
std::vector<std::uint8_t> Pack(std::span<const std::uint16_t> samples, int bits, std::uint32_t format);

}  // namespace lensd::sim
