// The formats of pictures that this driver reads: their names, how descriptors name them, and what their bytes mean.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/pixels/luma.h"

namespace lensd::drivers::uvc {

enum class PixelFormat { Grey16, Grey12, Grey10, Grey8, Yuyv, Mjpeg };

struct PixelFormatInfo {
  PixelFormat format;
  std::string_view name;  ///< in configurations and messages
  std::array<std::string_view, 2>
      codes;         ///< four letters that begin its GUID; empty: none (MJPEG has a descriptor type)
  int bytes_per_px;  ///< of MJPEG at most
  pixels::RawFormat raw;
};

/// In order of preference: luminance alone before colour, many bits before few, raw before compressed.
std::span<const PixelFormatInfo> PixelFormats();
const PixelFormatInfo& InfoOf(PixelFormat format);
/// By the GUID of an uncompressed format's descriptor; nullptr: not one of them.
const PixelFormatInfo* FormatOfGuid(std::span<const std::uint8_t, 16> guid);

}  // namespace lensd::drivers::uvc
