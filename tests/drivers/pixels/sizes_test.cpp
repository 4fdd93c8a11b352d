// Bytes of a picture against the rows that they are said to be.
#include "drivers/pixels/sizes.h"

#include <gtest/gtest.h>

#include <random>

#include "drivers/pixels/luma.h"

namespace lensd::drivers::pixels {
namespace {

TEST(Sizes, NoByteTooFewAndNoneTooMany) {
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    const int width = 1 + static_cast<int>(random() % 300), height = 1 + static_cast<int>(random() % 200);
    const std::size_t row = static_cast<std::size_t>(width) * (1 + random() % 2), gap = random() % 3 * (random() % 40);
    const Rows rows{width, height, row, row + gap, 0};
    const std::size_t whole = rows.stride * static_cast<std::size_t>(height);
    EXPECT_FALSE(WhyNotRows(whole, rows));
    EXPECT_FALSE(WhyNotRows(whole - gap, rows)) << "the last row may lack its gap";
    EXPECT_TRUE(WhyNotRows(whole + 1, rows));
    EXPECT_TRUE(WhyNotRows(whole - gap - 1, rows));
  }
}

TEST(Sizes, AFormatIsNamed) {
  const Rows mono{64, 48, 64, 64, 0};
  EXPECT_EQ(WhyNotRows(64 * 48 * 3, mono),
            "9216 bytes came where 64 x 48 pixels take 48 rows of 64 bytes: three bytes a pixel: this looks like RGB");
  EXPECT_NE(WhyNotRows(64 * 48 * 4, mono)->find("RGBA"), std::string::npos);
  EXPECT_NE(WhyNotRows(64 * 48 * 2, mono)->find("YUYV or 16 bits"), std::string::npos);
  EXPECT_NE(WhyNotRows(64 * 48 * 3 / 2, mono)->find("NV12"), std::string::npos);
  EXPECT_NE(WhyNotRows(64 * 48, {64, 48, 128, 128, 0})->find("mono8"), std::string::npos);
  EXPECT_NE(WhyNotRows(64 * 48 + 1, mono)->find("1 too many"), std::string::npos);
  EXPECT_NE(WhyNotRows(64 * 48 - 1, mono)->find("missing"), std::string::npos);
}

TEST(Sizes, ADeviceMaySayThatItPads) {
  const std::vector<std::uint8_t> bytes(64 * 48 * 3, 7);
  const auto read = [&](std::size_t size, std::size_t declared, RawFormat format) {
    LumaReader reader;
    return reader.Read(format, {std::span(bytes).first(size), 64, 48, 64, declared}).has_value();
  };
  EXPECT_TRUE(read(64 * 48, 0, {}));
  EXPECT_FALSE(read(64 * 48 + 1, 0, {}));
  EXPECT_TRUE(read(64 * 48 + 512, 64 * 48 + 512, {}));
  EXPECT_FALSE(read(64 * 48 + 513, 64 * 48 + 512, {}));
  EXPECT_FALSE(read(64 * 48 + 1, 64 * 48 + 1, {})) << "no device pads by one byte";
  EXPECT_FALSE(read(64 * 48 * 3, 64 * 48 * 3, {})) << "three bytes a pixel are no padding";
  EXPECT_TRUE(read(64 * 48 * 3 / 2, 0, {.chroma = Chroma::CbCr}));
  EXPECT_TRUE(read(64 * 48 * 3 / 2, 0, {.chroma = Chroma::Planes}));
}

}  // namespace
}  // namespace lensd::drivers::pixels
