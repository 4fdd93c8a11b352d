// Pictures survive writing and reading; what is no whole PNG is refused.
#include "io/png.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace lensd::io {
namespace {

std::string TemporaryPath(const std::string& name) {
  return (std::filesystem::temp_directory_path() / ("lensd-" + std::to_string(::getpid()) + "-" + name)).string();
}

class PngRoundTrip : public ::testing::TestWithParam<std::pair<int, int>> {};

TEST_P(PngRoundTrip, KeepsEverySample) {
  const auto [bits, channels] = GetParam();
  Image image{.width = 37, .height = 11, .channels = channels, .bits = bits, .samples = {}};
  for (int i = 0; i < image.width * image.height * channels; ++i) {
    image.samples.push_back(static_cast<std::uint16_t>((i * 2654435761u) >> (32 - bits)));
  }
  const std::string path = TemporaryPath("trip.png");
  ASSERT_TRUE(WritePng(path, image).has_value());
  const auto back = ReadPng(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(back.has_value()) << back.error().message;
  EXPECT_EQ(back->bits, bits);
  EXPECT_EQ(back->channels, channels);
  EXPECT_EQ(back->width, image.width);
  EXPECT_EQ(back->samples, image.samples);
}
INSTANTIATE_TEST_SUITE_P(Kinds, PngRoundTrip,
                         ::testing::Values(std::pair{8, 1}, std::pair{8, 3}, std::pair{16, 1}, std::pair{16, 3}));

TEST(Png, RefusesWhatIsNotAPng) {
  const std::string path = TemporaryPath("text.png");
  std::ofstream(path) << "hello, this is text";
  const auto read = ReadPng(path);
  std::filesystem::remove(path);
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, Code::BadData);
}

TEST(Png, RefusesADamagedFile) {
  Image image{.width = 64, .height = 64, .channels = 1, .bits = 8, .samples = std::vector<std::uint16_t>(64 * 64, 9)};
  auto encoded = EncodePng(image);
  ASSERT_TRUE(encoded.has_value());
  encoded->resize(encoded->size() / 2);
  const std::string path = TemporaryPath("half.png");
  ASSERT_TRUE(WriteFileAtomically(path, encoded->data(), encoded->size()).has_value());
  const auto read = ReadPng(path);
  std::filesystem::remove(path);
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, Code::BadData);
}

TEST(Png, SaysWhenTheFolderIsNotThere) {
  Image image{.width = 1, .height = 1, .channels = 1, .bits = 8, .samples = {0}};
  const auto written = WritePng("/nonexistent/a.png", image);
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error().code, Code::Io);
}

}  // namespace
}  // namespace lensd::io
