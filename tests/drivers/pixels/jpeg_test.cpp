// What was encoded comes back but for what JPEG loses.
#include "drivers/pixels/jpeg.h"

#include <gtest/gtest.h>
#include <turbojpeg.h>

namespace lensd::drivers::pixels {
namespace {

std::vector<std::uint8_t> Decoded(const std::vector<std::uint8_t>& jpeg, int width, int height, int format) {
  std::vector<std::uint8_t> samples(static_cast<std::size_t>(width * height * tjPixelSize[format]));
  const tjhandle decoder = tjInitDecompress();
  EXPECT_EQ(tjDecompress2(decoder, jpeg.data(), jpeg.size(), samples.data(), width, 0, height, format, 0), 0);
  tjDestroy(decoder);
  return samples;
}

TEST(Jpeg, GreyAndColourComeBack) {
  constexpr int kWidth = 37, kHeight = 21;
  std::vector<std::uint8_t> grey, colour;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      grey.push_back(static_cast<std::uint8_t>(5 * x + y));
      colour.insert(colour.end(), {static_cast<std::uint8_t>(5 * x), static_cast<std::uint8_t>(10 * y), 40});
    }
  }
  const auto grey_file = EncodeJpeg(grey, kWidth, kHeight, 1, 85);
  const auto colour_file = EncodeJpeg(colour, kWidth, kHeight, 3, 85);
  ASSERT_TRUE(grey_file && colour_file);
  const auto grey_back = Decoded(*grey_file, kWidth, kHeight, TJPF_GRAY);
  const auto colour_back = Decoded(*colour_file, kWidth, kHeight, TJPF_RGB);
  for (std::size_t i = 0; i < grey.size(); ++i) EXPECT_NEAR(grey_back[i], grey[i], 6) << i;
  for (std::size_t i = 0; i < colour.size(); ++i) EXPECT_NEAR(colour_back[i], colour[i], 12) << i;
}

TEST(Jpeg, RefusesWhatDoesNotFitTogether) {
  const std::vector<std::uint8_t> samples(12);
  EXPECT_TRUE(EncodeJpeg(samples, 4, 3, 1, 85));
  for (const auto& [width, height, channels, quality] :
       {std::tuple{4, 4, 1, 85}, {0, 3, 1, 85}, {4, 3, 2, 85}, {4, 3, 1, 0}, {70000, 1, 1, 85}}) {
    const auto refused = EncodeJpeg(samples, width, height, channels, quality);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, Code::InvalidArgument);
  }
}

}  // namespace
}  // namespace lensd::drivers::pixels
