// PNG files in and out (libpng): photographs, textures, depth maps, masks, snapshots.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"

namespace lensd::io {

/// A raster of unsigned samples, row-major, channels interleaved, no padding between rows.
struct Image {
  int width = 0;                       ///< px, >= 1
  int height = 0;                      ///< px, >= 1
  int channels = 1;                    ///< 1 (grey) or 3 (red, green, blue)
  int bits = 8;                        ///< 8 or 16 a sample
  std::vector<std::uint16_t> samples;  ///< width * height * channels values in [0, 2^bits - 1]
};

/// Reads a PNG of any colour type: palettes are expanded, fewer than 8 bits widened, alpha dropped.
/// Errors: Code::Io (cannot be opened), Code::BadData (not a PNG, damaged, or above 2^28 samples).
Result<Image> ReadPng(const std::string& path);

/// Encodes to PNG. Code::InvalidArgument where sizes do not fit together.
Result<std::vector<std::uint8_t>> EncodePng(const Image& image);

/// Writes a PNG through a temporary file and a rename, so that a reader never sees half of it. Code::Io.
Result<void> WritePng(const std::string& path, const Image& image);

/// Writes any bytes the same way: temporary file beside `path`, then rename. Code::Io.
Result<void> WriteFileAtomically(const std::string& path, const void* data, std::size_t size);

}  // namespace lensd::io
