// Raw pictures, as cameras send them, to luminance samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/result.h"

namespace lensd::drivers::pixels {

/// How the samples of a picture lie in memory.
enum class Packing {
  Bytes,  ///< one byte a sample; of planar YUV (NV12, I420) the first plane
  Words,  ///< 16 bits a sample, little-endian, the `bits` lowest count
  Csi2,   ///< MIPI CSI-2: 10, 12 or 14 bits, the high bytes of 4, 2 or 4 samples first, then their low bits
  Yuyv,   ///< 4:2:2, luminance first
  Uyvy,   ///< 4:2:2, luminance second
  Jpeg,   ///< one JPEG picture, with or without its Huffman tables; stride and bits do not matter
};

/// Colours of the 2 x 2 samples that a mosaic begins with, row by row. None: every sample is luminance.
enum class Mosaic { None, Rggb, Grbg, Gbrg, Bggr };

/// What follows the luminance plane of Packing::Bytes: nothing that is known, Cb and Cr of 2 x 2 pixels in turns, Cr
/// and Cb in turns, or a plane of each.
enum class Chroma { None, CbCr, CrCb, Planes };

struct RawFormat {
  Packing packing = Packing::Bytes;
  int bits = 8;  ///< significant bits a sample, 8 to 16; 8 but for Words and Csi2
  Mosaic mosaic = Mosaic::None;
  bool limited = false;  ///< luminance in 16..235 of 8 bits, to be stretched to 0..255
  Chroma chroma = Chroma::None;
};

struct RawPicture {
  std::span<const std::uint8_t> bytes;
  int width = 0;           ///< px
  int height = 0;          ///< px
  std::size_t stride = 0;  ///< bytes from row to row; 0: rows without padding
  /// Bytes that the device says a picture has, padding after the last row included; 0: it does not say.
  std::size_t declared = 0;
};

/// Bytes of a row without padding; 0 for Jpeg.
std::size_t RowBytes(const RawFormat& format, int width);

/// Turns a mosaic of width * height samples, whatever the order of its colours, into luminance: (R + 2G + B)/4 out of
/// the 2 x 2 samples that begin at each pixel, or end there at the right and lower edge. Less than 2 x 2 is left as it
/// is.
void AverageMosaic(std::vector<std::uint16_t>& samples, int width, int height);

/// Unpacks what is not JPEG: width * height samples as the sensor has them, row-major. Protocol: too few bytes, or
/// more than its rows take.
Result<std::vector<std::uint16_t>> Unpack(const RawFormat& format, const RawPicture& picture);

/// Converts pictures. One thread at a time.
class LumaReader {
 public:
  /// width * height luminance samples of format.bits bits, row-major, without padding. A mosaic becomes (R + 2G + B)/4
  /// at each pixel, out of the 2 x 2 samples that begin there: whatever the order of colours, each such square has all
  /// of them, and a flat colour stays flat. The picture is thereby half a pixel off, and an edge one pixel softer.
  /// Protocol: too few bytes or too many, not the width and height claimed, or a JPEG of which a part is lost.
  /// InvalidArgument: a format that cannot be.
  Result<std::shared_ptr<const std::vector<std::uint16_t>>> Read(const RawFormat& format, const RawPicture& picture);

  /// The picture read last is whole, but its bytes were not quite as they should be: DecodedJpeg::flawed.
  bool flawed() const { return flawed_; }

 private:
  Result<std::vector<std::uint16_t>> ReadJpeg(const RawPicture& picture);

  bool flawed_ = false;
};

}  // namespace lensd::drivers::pixels
