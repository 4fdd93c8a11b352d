// Colours drawn at random, written by the definition of each format, and read back.
#include "drivers/pixels/colour.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "drivers/pixels/jpeg.h"

namespace lensd::drivers::pixels {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Samples = std::vector<std::uint16_t>;
using Rgb = std::array<double, 3>;

/// Y'CbCr of 8 bits by the definition in ITU-R BT.601: luminance of 0.299 R and 0.114 B, the rest green, and the
/// differences from it over their greatest values.
std::array<std::uint8_t, 3> ToYuv(const Rgb& colour, bool limited) {
  const double luma = 0.299 * colour[0] + (1.0 - 0.299 - 0.114) * colour[1] + 0.114 * colour[2];
  const double blue = (colour[2] - luma) / 255.0 / (2.0 * (1.0 - 0.114));
  const double red = (colour[0] - luma) / 255.0 / (2.0 * (1.0 - 0.299));
  const auto byte = [](double value) { return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L)); };
  if (limited) return {byte(16.0 + luma / 255.0 * 219.0), byte(128.0 + 224.0 * blue), byte(128.0 + 224.0 * red)};
  return {byte(luma), byte(128.0 + 255.0 * blue), byte(128.0 + 255.0 * red)};
}

/// Blocks of 2 x 2 px share a colour, so that no format has to halve it.
class Blocks {
 public:
  Blocks(int width, int height, std::mt19937& random) : width_(width), height_(height) {
    std::uniform_real_distribution any(0.0, 255.0);
    for (int i = 0; i < (width + 1) / 2 * ((height + 1) / 2); ++i)
      colours_.push_back({any(random), any(random), any(random)});
  }
  const Rgb& At(int x, int y) const { return colours_[static_cast<std::size_t>(y / 2 * ((width_ + 1) / 2) + x / 2)]; }

  void ExpectIn(const RawFormat& format, const Bytes& bytes, std::size_t stride, double within) const {
    const auto maker = MakerOfColour(format, {bytes, width_, height_, stride});
    ASSERT_TRUE(maker);
    const auto read = maker();
    ASSERT_TRUE(read);
    ASSERT_EQ(read->size(), 3 * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
    std::size_t at = 0;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        for (const double channel : At(x, y)) ASSERT_NEAR((*read)[at++], channel, within) << x << ", " << y;
      }
    }
    // What lacks a byte at its end is no picture.
    const auto cut = MakerOfColour(format, {std::span(bytes).first(bytes.size() - 1), width_, height_, stride});
    EXPECT_FALSE(cut());
  }

  Bytes Packed(const RawFormat& format, std::size_t stride) const {
    Bytes bytes(stride * static_cast<std::size_t>(height_ - 1) + static_cast<std::size_t>((width_ + 1) / 2 * 4), 77);
    const std::size_t luma = format.packing == Packing::Yuyv ? 0 : 1, chroma = 1 - luma;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const auto [grey, blue, red] = ToYuv(At(x, y), format.limited);
        const std::size_t pair = static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x / 2 * 4);
        bytes[pair + luma + static_cast<std::size_t>(x % 2 * 2)] = grey;
        bytes[pair + chroma] = blue;
        bytes[pair + chroma + 2] = red;
      }
    }
    return bytes;
  }

  /// Luminance, then Cb and Cr of every block, in turns or in planes.
  Bytes Planar(const RawFormat& format, std::size_t stride) const {
    const std::size_t rows = static_cast<std::size_t>(height_), half_rows = (rows + 1) / 2;
    const std::size_t half_width = static_cast<std::size_t>((width_ + 1) / 2), plane = stride / 2;
    const bool planes = format.chroma == Chroma::Planes;
    Bytes bytes(stride * rows + (planes ? 2 * plane * half_rows : stride * (half_rows - 1) + 2 * half_width), 77);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const auto [grey, blue, red] = ToYuv(At(x, y), format.limited);
        const std::size_t column = static_cast<std::size_t>(x), row = static_cast<std::size_t>(y);
        bytes[row * stride + column] = grey;
        if (planes) {
          bytes[rows * stride + row / 2 * plane + column / 2] = blue;
          bytes[rows * stride + plane * half_rows + row / 2 * plane + column / 2] = red;
        } else {
          const std::size_t at = rows * stride + row / 2 * stride + column / 2 * 2;
          const bool blue_first = format.chroma == Chroma::CbCr;
          bytes[at] = blue_first ? blue : red;
          bytes[at + 1] = blue_first ? red : blue;
        }
      }
    }
    return bytes;
  }

  int width_, height_;
  std::vector<Rgb> colours_;
};

/// A step of a chroma byte is 1.8 of 255 in blue: half of it and its neighbours' rounding.
constexpr double kRounding = 2.6;

TEST(Colour, YuvOfAnySizeAndStride) {
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    const int width = 1 + static_cast<int>(random() % 17), height = 1 + static_cast<int>(random() % 9);
    const Blocks blocks(width, height, random);
    const std::size_t stride = static_cast<std::size_t>((width + 1) / 2 * 4) + 4 * (random() % 3);
    for (const bool limited : {false, true}) {
      for (const Packing packing : {Packing::Yuyv, Packing::Uyvy}) {
        const RawFormat format{.packing = packing, .limited = limited};
        blocks.ExpectIn(format, blocks.Packed(format, stride), stride, kRounding);
      }
      for (const Chroma chroma : {Chroma::CbCr, Chroma::CrCb, Chroma::Planes}) {
        const RawFormat format{.limited = limited, .chroma = chroma};
        blocks.ExpectIn(format, blocks.Planar(format, stride), stride, kRounding);
      }
    }
  }
}

TEST(Colour, JpegIsDecoded) {
  std::mt19937 random(6);
  const int width = 64, height = 32;
  Bytes rgb;
  const Rgb left{220, 60, 30}, right{20, 90, 210};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const double channel : x < width / 2 ? left : right) rgb.push_back(static_cast<std::uint8_t>(channel));
    }
  }
  const auto jpeg = EncodeJpeg(rgb, width, height, 3, 100);
  ASSERT_TRUE(jpeg);
  const RawFormat format{.packing = Packing::Jpeg};
  const auto read = MakerOfColour(format, {*jpeg, width, height})();
  ASSERT_TRUE(read);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    EXPECT_NEAR((*read)[3 * 8 + channel], left[channel], 3.0);
    EXPECT_NEAR((*read)[3 * 56 + channel], right[channel], 3.0);
  }
  EXPECT_FALSE(MakerOfColour(format, {*jpeg, width, height + 1})());
  EXPECT_FALSE(MakerOfColour(format, {Bytes{1, 2, 3}, width, height})());
}

/// Of "GRBG" and the like: the colour of the sample at a place.
int ChannelAt(std::string_view order, int x, int y) {
  return static_cast<int>(std::string_view("RGB").find(order[static_cast<std::size_t>(y % 2 * 2 + x % 2)]));
}

TEST(Colour, MosaicsOfEveryOrder) {
  const std::pair<std::string_view, Mosaic> orders[] = {
      {"RGGB", Mosaic::Rggb}, {"GRBG", Mosaic::Grbg}, {"GBRG", Mosaic::Gbrg}, {"BGGR", Mosaic::Bggr}};
  for (const auto& [order, mosaic] : orders) {
    Bytes flat;
    const std::array<std::uint8_t, 3> colour = {200, 100, 40};
    for (int i = 0; i < 35; ++i) flat.push_back(colour[static_cast<std::size_t>(ChannelAt(order, i % 7, i / 7))]);
    const auto read = MakerOfColour({.mosaic = mosaic}, {flat, 7, 5})();
    ASSERT_TRUE(read);
    for (std::size_t i = 0; i < read->size(); ++i) EXPECT_EQ((*read)[i], colour[i % 3]) << order << " " << i;
  }
}

TEST(Colour, OfAMosaicWeighsToItsLuminance) {
  std::mt19937 random(7);
  for (const Mosaic mosaic : {Mosaic::Rggb, Mosaic::Grbg, Mosaic::Gbrg, Mosaic::Bggr}) {
    const int width = 9, height = 6;
    Samples samples(static_cast<std::size_t>(width * height));
    for (auto& sample : samples) sample = static_cast<std::uint16_t>(random() % 4096);
    const auto colour = ColourOfMosaic(samples, width, height, mosaic);
    AverageMosaic(samples, width, height);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      EXPECT_NEAR((colour[3 * i] + 2.0 * colour[3 * i + 1] + colour[3 * i + 2]) / 4.0, samples[i], 1.0);
    }
  }
}

TEST(Colour, LuminanceHasNone) {
  EXPECT_FALSE(HasColour({}));
  EXPECT_FALSE(HasColour({Packing::Words, 12}));
  EXPECT_FALSE(MakerOfColour({Packing::Words, 16}, {Bytes(8), 2, 2}));
  EXPECT_EQ(ColourOfMosaic({9}, 1, 1, Mosaic::Bggr), (Samples{9, 9, 9}));
}

}  // namespace
}  // namespace lensd::drivers::pixels
