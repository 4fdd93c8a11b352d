// Raw pictures to red, green and blue, for eyes: what measures needs luminance alone (luma.h).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "drivers/pixels/luma.h"

namespace lensd::drivers::pixels {

/// Whether pictures of this format have colour that MakerOfColour() can find.
bool HasColour(const RawFormat& format);

/// Red, green, blue of each pixel out of the 2 x 2 samples of a mosaic that luminance is averaged of there
/// (AverageMosaic()), green being the mean of its two: so (R + 2G + B)/4 of a pixel is its luminance. As the sensor has
/// them, without a white balance. A mosaic below 2 x 2 px is grey.
std::vector<std::uint16_t> ColourOfMosaic(const std::vector<std::uint16_t>& samples, int width, int height,
                                          Mosaic mosaic);

/// Copies what is needed of a picture now and makes its colours when called: 3 * width * height samples of format.bits
/// bits; null where the bytes hold no such picture. YUV by ITU-R BT.601 (what UVC 1.5 and V4L2 take for granted), to
/// the range that luminance has. Nothing: the format has no colour. The maker may be called from any thread.
std::function<std::shared_ptr<const std::vector<std::uint16_t>>()> MakerOfColour(const RawFormat& format,
                                                                                 const RawPicture& picture);

}  // namespace lensd::drivers::pixels
