// Pictures of 8 bits a sample into JPEG and back.
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

struct DecodedJpeg {
  std::vector<std::uint8_t> samples;  ///< as EncodeJpeg() takes them
  /// The picture is whole all the same: bytes too many before a marker, no end marker, or a header that is not quite as
  /// the standard has it.
  bool flawed = false;
};

/// A picture of a camera, with or without its Huffman tables. `channels` as in EncodeJpeg(). From any thread. Protocol:
/// not the width and height claimed, or "damaged: " and the decoder's words, where it is no JPEG picture or a part of
/// it is lost. A bit that fell over on the way and still makes sense to the decoder goes unnoticed.
Result<DecodedJpeg> DecodeJpeg(std::span<const std::uint8_t> bytes, int width, int height, int channels);

}  // namespace lensd::drivers::pixels
