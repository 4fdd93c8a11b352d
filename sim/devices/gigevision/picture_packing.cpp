// Simulated samples in the pixel formats that the simulated camera offers.
#include "picture_packing.h"

namespace lensd::sim {
namespace {

enum Format : std::uint32_t {
  kMono8 = 0x01080001,
  kMono10 = 0x01100003,
  kMono12 = 0x01100005,
  kMono12Packed = 0x010C0006,
  kMono12p = 0x010C0047,
  kMono16 = 0x01100007,
  kBayerRG8 = 0x01080009,
  kRgb8 = 0x02180014,
};

unsigned Depth(std::uint32_t format) {
  switch (format) {
    case kMono10:
      return 10;
    case kMono12:
    case kMono12Packed:
    case kMono12p:
      return 12;
    case kMono16:
      return 16;
    default:
      return 8;
  }
}

/// The same light with another number of bits.
unsigned Rescale(unsigned sample, int from, unsigned to) {
  const auto bits = static_cast<unsigned>(from);
  return to >= bits ? sample << (to - bits) : sample >> (bits - to);
}

}  // namespace

std::vector<std::uint8_t> Pack(std::span<const std::uint16_t> samples, int bits, std::uint32_t format) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(samples.size() * BitsPerPixel(format) / 8 + 3);
  const auto put = [&](unsigned byte) { bytes.push_back(static_cast<std::uint8_t>(byte & 0xffu)); };
  unsigned first = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const unsigned v = Rescale(samples[i], bits, Depth(format));
    switch (format) {
      case kMono8:
      case kBayerRG8:
        put(v);
        break;
      case kRgb8:
        put(v), put(v), put(v);
        break;
      case kMono10:
      case kMono12:
      case kMono16:
        put(v), put(v >> 8);
        break;
      case kMono12Packed:
      case kMono12p:
        if (i % 2 == 0) {
          first = v;
          if (i + 1 == samples.size())
            put(format == kMono12p ? v : v >> 4), put(format == kMono12p ? v >> 8 : v & 0xfu);
        } else if (format == kMono12p) {
          put(first), put(first >> 8 | v << 4), put(v >> 4);
        } else {
          put(first >> 4), put((first & 0xfu) | (v & 0xfu) << 4), put(v >> 4);
        }
        break;
      default:
        return {};
    }
  }
  return bytes;
}

}  // namespace lensd::sim
