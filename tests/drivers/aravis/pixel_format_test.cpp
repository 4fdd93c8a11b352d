// Buffers made by hand from the layouts that GigE Vision and PFNC state; nothing here shares code with the reader.
#include "pixel_format.h"

#include <arv.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace lensd::drivers::aravis {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Samples = std::vector<std::uint16_t>;

Samples Luma(const char* name, const Bytes& bytes, int width, int height, int padding = 0) {
  const PixelFormat* format = FindPixelFormat(std::string_view(name));
  if (format == nullptr) {
    ADD_FAILURE() << "no format " << name;
    return {};
  }
  auto luma = LumaOf(*format, bytes, width, height, padding);
  EXPECT_TRUE(luma.has_value()) << luma.error().message;
  return luma ? *luma : Samples{};
}

TEST(PixelFormat, CodesAreThoseOfTheLibrary) {
  const std::pair<const char*, std::uint32_t> known[] = {
      {"Mono8", ARV_PIXEL_FORMAT_MONO_8},
      {"Mono10", ARV_PIXEL_FORMAT_MONO_10},
      {"Mono10Packed", ARV_PIXEL_FORMAT_MONO_10_PACKED},
      {"Mono12", ARV_PIXEL_FORMAT_MONO_12},
      {"Mono12Packed", ARV_PIXEL_FORMAT_MONO_12_PACKED},
      {"Mono14", ARV_PIXEL_FORMAT_MONO_14},
      {"Mono16", ARV_PIXEL_FORMAT_MONO_16},
      {"BayerGR8", ARV_PIXEL_FORMAT_BAYER_GR_8},
      {"BayerRG8", ARV_PIXEL_FORMAT_BAYER_RG_8},
      {"BayerGB8", ARV_PIXEL_FORMAT_BAYER_GB_8},
      {"BayerBG8", ARV_PIXEL_FORMAT_BAYER_BG_8},
      {"BayerGR10", ARV_PIXEL_FORMAT_BAYER_GR_10},
      {"BayerRG10", ARV_PIXEL_FORMAT_BAYER_RG_10},
      {"BayerGB10", ARV_PIXEL_FORMAT_BAYER_GB_10},
      {"BayerBG10", ARV_PIXEL_FORMAT_BAYER_BG_10},
      {"BayerGR12", ARV_PIXEL_FORMAT_BAYER_GR_12},
      {"BayerRG12", ARV_PIXEL_FORMAT_BAYER_RG_12},
      {"BayerGB12", ARV_PIXEL_FORMAT_BAYER_GB_12},
      {"BayerBG12", ARV_PIXEL_FORMAT_BAYER_BG_12},
      {"BayerGR12Packed", ARV_PIXEL_FORMAT_BAYER_GR_12_PACKED},
      {"BayerRG12Packed", ARV_PIXEL_FORMAT_BAYER_RG_12_PACKED},
      {"BayerGB12Packed", ARV_PIXEL_FORMAT_BAYER_GB_12_PACKED},
      {"BayerBG12Packed", ARV_PIXEL_FORMAT_BAYER_BG_12_PACKED},
      {"BayerGR16", ARV_PIXEL_FORMAT_BAYER_GR_16},
      {"BayerRG16", ARV_PIXEL_FORMAT_BAYER_RG_16},
      {"BayerGB16", ARV_PIXEL_FORMAT_BAYER_GB_16},
      {"BayerBG16", ARV_PIXEL_FORMAT_BAYER_BG_16},
      {"RGB8", ARV_PIXEL_FORMAT_RGB_8_PACKED},
      {"BGR8", ARV_PIXEL_FORMAT_BGR_8_PACKED},
  };
  for (const auto& [name, code] : known) {
    const PixelFormat* format = FindPixelFormat(std::string_view(name));
    ASSERT_NE(format, nullptr) << name;
    EXPECT_EQ(format->code, code) << name;
  }
}

TEST(PixelFormat, CodesTellTheBitsInMemory) {
  // Bits 16 to 23 of every code are the bits a pixel takes.
  for (const PixelFormat& format : PixelFormats()) {
    EXPECT_EQ(BytesOf(format, 8, 1, 0), (format.code >> 16) & 0xff) << format.name;
    EXPECT_EQ(FindPixelFormat(format.code), FindPixelFormat(format.name)) << format.name;
  }
}

TEST(PixelFormat, WholeBytesAndWords) {
  EXPECT_EQ(Luma("Mono8", {0, 1, 254, 255}, 2, 2), (Samples{0, 1, 254, 255}));
  EXPECT_EQ(Luma("Mono10", {0x00, 0x00, 0xff, 0x03, 0x01, 0x02}, 3, 1), (Samples{0, 1023, 0x201}));
  EXPECT_EQ(Luma("Mono12", {0xbc, 0x0a, 0xff, 0x0f}, 1, 2), (Samples{0xabc, 4095}));
  EXPECT_EQ(Luma("Mono16", {0x34, 0x12, 0xff, 0xff}, 2, 1), (Samples{0x1234, 65535}));
}

TEST(PixelFormat, BackToBackBits) {
  // 0x155, 0x2aa, 0x3ff, 0x001: 10 bits each, the first in the lowest bits.
  EXPECT_EQ(Luma("Mono10p", {0x55, 0xa9, 0xfa, 0x7f, 0x00}, 4, 1), (Samples{0x155, 0x2aa, 0x3ff, 0x001}));
  // 0xabc, 0x123.
  EXPECT_EQ(Luma("Mono12p", {0xbc, 0x3a, 0x12}, 2, 1), (Samples{0xabc, 0x123}));
  // Three pixels a line: the second line begins in the middle of a byte.
  EXPECT_EQ(Luma("Mono12p", {0xbc, 0x3a, 0x12, 0xff, 0x0f, 0x00, 0x56, 0x84, 0x07}, 3, 2),
            (Samples{0xabc, 0x123, 0xfff, 0x000, 0x456, 0x078}));
}

TEST(PixelFormat, TwoInThreeBytes) {
  // GigE Vision: the high bits, both low parts (first sample in the lower half), the high bits.
  EXPECT_EQ(Luma("Mono12Packed", {0xab, 0x3c, 0x12}, 2, 1), (Samples{0xabc, 0x123}));
  // 0x155 = 0x55 and 01; 0x2aa = 0xaa and 10.
  EXPECT_EQ(Luma("Mono10Packed", {0x55, 0x21, 0xaa}, 2, 1), (Samples{0x155, 0x2aa}));
  // An odd number of pixels ends after two bytes.
  EXPECT_EQ(Luma("Mono12Packed", {0xab, 0x3c, 0x12, 0xfe, 0x0d}, 3, 1), (Samples{0xabc, 0x123, 0xfed}));
}

TEST(PixelFormat, PaddedLines) {
  EXPECT_EQ(Luma("Mono8", {1, 2, 99, 3, 4, 99}, 2, 2, 1), (Samples{1, 2, 3, 4}));
  EXPECT_EQ(Luma("Mono12p", {0xbc, 0x3a, 0x12, 99, 99, 0xff, 0x0f, 0x00, 99, 99}, 2, 2, 2),
            (Samples{0xabc, 0x123, 0xfff, 0x000}));
}

TEST(PixelFormat, MosaicsBecomeTheMeanOfFour) {
  // R 100, G 40 and 60, B 20: (100 + 40 + 60 + 20) / 4 = 55, whichever pixel begins.
  const Bytes rg = {100, 40, 100, 40, 60, 20, 60, 20, 100, 40, 100, 40};
  EXPECT_EQ(Luma("BayerRG8", rg, 4, 3), Samples(12, 55));
  // One bright blue pixel is seen by the four squares that hold it, and those mirrored onto it.
  const Bytes spot = {0, 0, 0, 0, 80, 0, 0, 0, 0};
  EXPECT_EQ(Luma("BayerGR8", spot, 3, 3), (Samples{20, 20, 20, 20, 20, 20, 20, 20, 20}));
  EXPECT_EQ(Luma("BayerBG12p", {0x64, 0x80, 0x02, 0x3c, 0x40, 0x01}, 2, 2), Samples(4, 55));
  EXPECT_EQ(Luma("BayerGB16", {0x10, 0x27, 0x10, 0x27, 0x10, 0x27, 0x10, 0x27}, 2, 2), Samples(4, 10000));
}

TEST(PixelFormat, ColoursWeighAsRec709) {
  // 0.2126 R + 0.7152 G + 0.0722 B, to one level.
  const Bytes rgb = {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255, 10, 20, 30};
  const Samples luma = Luma("RGB8", rgb, 5, 1);
  const double expected[] = {54.2, 182.4, 18.4, 255.0, 18.6};
  for (std::size_t i = 0; i < luma.size(); ++i) EXPECT_NEAR(luma[i], expected[i], 1.0) << i;
  EXPECT_EQ(Luma("BGR8", {0, 0, 255}, 1, 1), Luma("RGB8", {255, 0, 0}, 1, 1));
}

TEST(PixelFormat, ShortPicturesAreRefused) {
  for (const PixelFormat& format : PixelFormats()) {
    const std::size_t whole = BytesOf(format, 7, 5, 0);
    EXPECT_TRUE(LumaOf(format, Bytes(whole), 7, 5, 0).has_value()) << format.name;
    const auto shorter = LumaOf(format, Bytes(whole - 1), 7, 5, 0);
    ASSERT_FALSE(shorter.has_value()) << format.name;
    EXPECT_EQ(shorter.error().code, Code::Protocol);
  }
  EXPECT_FALSE(LumaOf(PixelFormats().front(), Bytes(8), 0, 1, 0).has_value());
}

}  // namespace
}  // namespace lensd::drivers::aravis
