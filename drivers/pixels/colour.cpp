// Mosaics, YUV and JPEG to red, green and blue.
#include "drivers/pixels/colour.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "drivers/pixels/jpeg.h"

namespace lensd::drivers::pixels {
namespace {

using Values = std::vector<std::uint16_t>;

/// ITU-R BT.601, 2.5: what a unit of Cb or Cr, seen from 128, adds.
constexpr double kCrToRed = 1.402, kCbToGreen = -0.344136, kCrToGreen = -0.714136, kCbToBlue = 1.772;
constexpr double kLimitedLuma = 255.0 / 219.0, kLimitedChroma = 255.0 / 224.0;

struct Yuv {
  std::uint8_t luma, blue, red;
};

void PutRgb(Yuv pixel, bool limited, std::uint16_t* out) {
  const double luma = limited ? (pixel.luma - 16) * kLimitedLuma : pixel.luma;
  const double scale = limited ? kLimitedChroma : 1.0;
  const double blue = (pixel.blue - 128) * scale, red = (pixel.red - 128) * scale;
  const auto put = [&](int channel, double value) {
    out[channel] = static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0, 255.0)));
  };
  put(0, luma + kCrToRed * red);
  put(1, luma + kCbToGreen * blue + kCrToGreen * red);
  put(2, luma + kCbToBlue * blue);
}

/// Where a picture's luminance and its two differences lie: bytes from the first of a row, and from pixel to pixel.
struct Layout {
  struct Plane {
    std::size_t offset, stride, step;
  };
  Plane luma, blue, red;
  std::size_t bytes = 0;  ///< needed
  int rows_a_chroma = 1;
};

std::optional<Layout> LayoutOf(const RawFormat& format, const RawPicture& picture) {
  const std::size_t stride = std::max(picture.stride, RowBytes(format, picture.width));
  const auto rows = static_cast<std::size_t>(picture.height);
  const std::size_t luma = stride * rows, half_rows = (rows + 1) / 2;
  const std::size_t row = RowBytes(format, picture.width), packed = stride * (rows - 1) + (row + 3) / 4 * 4;
  if (format.packing == Packing::Yuyv) return Layout{{0, stride, 2}, {1, stride, 4}, {3, stride, 4}, packed, 1};
  if (format.packing == Packing::Uyvy) return Layout{{1, stride, 2}, {0, stride, 4}, {2, stride, 4}, packed, 1};
  if (format.packing != Packing::Bytes) return std::nullopt;
  const auto in_turns = luma + stride * (half_rows - 1) + (row + 1) / 2 * 2;
  switch (format.chroma) {
    case Chroma::None:
      return std::nullopt;
    case Chroma::CbCr:
      return Layout{{0, stride, 1}, {luma, stride, 2}, {luma + 1, stride, 2}, in_turns, 2};
    case Chroma::CrCb:
      return Layout{{0, stride, 1}, {luma + 1, stride, 2}, {luma, stride, 2}, in_turns, 2};
    case Chroma::Planes: {
      const std::size_t half = (stride + 1) / 2, second = luma + half * half_rows;
      return Layout{{0, stride, 1}, {luma, half, 1}, {second, half, 1}, second + half * half_rows, 2};
    }
  }
  return std::nullopt;
}

std::shared_ptr<const Values> FromYuv(const RawFormat& format, const RawPicture& picture) {
  const auto layout = LayoutOf(format, picture);
  if (!layout || picture.bytes.size() < layout->bytes) return nullptr;
  const auto width = static_cast<std::size_t>(picture.width), height = static_cast<std::size_t>(picture.height);
  const auto at = [&](const Layout::Plane& plane, std::size_t x, std::size_t y) {
    return picture.bytes[plane.offset + y * plane.stride + x * plane.step];
  };
  Values colours(3 * width * height);
  for (std::size_t y = 0; y < height; ++y) {
    const std::size_t chroma_y = y / static_cast<std::size_t>(layout->rows_a_chroma);
    for (std::size_t x = 0; x < width; ++x) {
      const Yuv pixel{at(layout->luma, x, y), at(layout->blue, x / 2, chroma_y), at(layout->red, x / 2, chroma_y)};
      PutRgb(pixel, format.limited, colours.data() + 3 * (y * width + x));
    }
  }
  return std::make_shared<const Values>(std::move(colours));
}

std::shared_ptr<const Values> FromJpeg(const RawPicture& picture) {
  const auto decoded = DecodeJpeg(picture.bytes, picture.width, picture.height, 3);
  if (!decoded) return nullptr;
  return std::make_shared<const Values>(decoded->samples.begin(), decoded->samples.end());
}

std::shared_ptr<const Values> FromMosaic(const RawFormat& format, const RawPicture& picture) {
  const auto samples = Unpack(format, picture);
  if (!samples) return nullptr;
  return std::make_shared<const Values>(ColourOfMosaic(*samples, picture.width, picture.height, format.mosaic));
}

}  // namespace

bool HasColour(const RawFormat& format) {
  return format.mosaic != Mosaic::None || format.chroma != Chroma::None || format.packing == Packing::Yuyv ||
         format.packing == Packing::Uyvy || format.packing == Packing::Jpeg;
}

std::vector<std::uint16_t> ColourOfMosaic(const std::vector<std::uint16_t>& samples, int width, int height,
                                          Mosaic mosaic) {
  Values colours(3 * samples.size());
  const bool too_small = width < 2 || height < 2 || mosaic == Mosaic::None;
  const int red_x = mosaic == Mosaic::Grbg || mosaic == Mosaic::Bggr ? 1 : 0;
  const int red_y = mosaic == Mosaic::Gbrg || mosaic == Mosaic::Bggr ? 1 : 0;
  const auto at = [&](int x, int y) {
    return samples[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  };
  auto out = colours.begin();
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, out += 3) {
      if (too_small) {
        std::fill_n(out, 3, at(x, y));
        continue;
      }
      const int left = std::min(x, width - 2), top = std::min(y, height - 2);
      const int dx = (left ^ red_x) & 1, dy = (top ^ red_y) & 1;  // of the red sample in the square
      out[0] = at(left + dx, top + dy);
      out[1] = static_cast<std::uint16_t>((at(left + 1 - dx, top + dy) + at(left + dx, top + 1 - dy) + 1) / 2);
      out[2] = at(left + 1 - dx, top + 1 - dy);
    }
  }
  return colours;
}

std::function<std::shared_ptr<const Values>()> MakerOfColour(const RawFormat& format, const RawPicture& picture) {
  if (!HasColour(format) || picture.width < 1 || picture.height < 1) return nullptr;
  const auto kept = std::make_shared<const std::vector<std::uint8_t>>(picture.bytes.begin(), picture.bytes.end());
  return [format, kept, picture] {
    RawPicture copy = picture;
    copy.bytes = *kept;
    if (format.packing == Packing::Jpeg) return FromJpeg(copy);
    return format.mosaic != Mosaic::None ? FromMosaic(format, copy) : FromYuv(format, copy);
  };
}

}  // namespace lensd::drivers::pixels
