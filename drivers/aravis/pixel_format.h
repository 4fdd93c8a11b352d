// Pixel formats of GenICam cameras, reduced to luminance. Numbers are those of the Pixel Format Naming Convention.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace lensd::drivers::aravis {

/// How samples lie in memory.
enum class Packing {
  Bytes,        ///< 8 bits each
  Words,        ///< 16 bits each, little-endian, the value in the lower bits
  Lsb,          ///< back to back, the first sample in the lowest bits ("Mono10p", "Mono12p")
  GigePacked,   ///< two in three bytes: high bits, both low parts, high bits ("Mono10Packed", "Mono12Packed")
  Interleaved,  ///< three bytes a pixel
};

/// What a sample's place in the mosaic means for luminance.
enum class Colour { Mono, Bayer, Rgb, Bgr };

struct PixelFormat {
  std::uint32_t code = 0;  ///< as on the wire
  std::string_view name;   ///< as in the enumeration PixelFormat
  int bits = 8;            ///< significant bits a sample
  Packing packing = Packing::Bytes;
  Colour colour = Colour::Mono;
};

/// All formats that can be read.
std::span<const PixelFormat> PixelFormats();
/// nullptr: cannot be read.
const PixelFormat* FindPixelFormat(std::uint32_t code);
const PixelFormat* FindPixelFormat(std::string_view name);

/// Bytes of a picture, each line followed by `padding` bytes.
std::size_t BytesOf(const PixelFormat& format, int width, int height, int padding);

/// Luminance, row-major, of `format.bits` bits. A mosaic is averaged as drivers/pixels does it.
/// RGB is weighted as Rec. 709. Protocol: `data` is shorter than the picture.
Result<std::vector<std::uint16_t>> LumaOf(const PixelFormat& format, std::span<const std::uint8_t> data, int width,
                                          int height, int padding);

/// Makes red, green and blue of a picture that LumaOf() takes, whose bytes it copies; in the order and way of
/// drivers/pixels. Nothing: the format has no colour.
std::function<std::shared_ptr<const std::vector<std::uint16_t>>()> MakerOfColour(const PixelFormat& format,
                                                                                 std::span<const std::uint8_t> data,
                                                                                 int width, int height, int padding);

}  // namespace lensd::drivers::aravis
