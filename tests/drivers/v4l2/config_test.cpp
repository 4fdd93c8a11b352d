// The configuration keys and the picture formats of the driver v4l2.
#include "config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "formats.h"
#include "io/toml.h"

namespace lensd::drivers::v4l2 {
namespace {

using drivers::Axis;

Result<Config> Read(const std::string& toml) {
  const auto settings = io::ParseToml(toml, "test.toml");
  EXPECT_TRUE(settings.has_value()) << settings.error().message;
  return ReadConfig(*settings);
}

TEST(V4l2Config, Reads) {
  const auto config = Read(
      "i2c_bus = 10\ni2c_address = 0x18\nchip = \"dw9714\"\nfocus_unit = \"dioptres\"\nfocus_scale = 0.01\n"
      "focus_speed = 20\nfocus_settle_ms = 12\n");
  ASSERT_TRUE(config.has_value()) << config.error().message;
  EXPECT_EQ(config->i2c_bus, "/dev/i2c-10");
  EXPECT_EQ(config->i2c_address, 0x18);
  EXPECT_EQ(config->axes[Axis::Focus].unit, drivers::NativeUnit::Dioptres);
  EXPECT_EQ(config->axes[Axis::Focus].scale, 0.01);
  EXPECT_EQ(config->axes[Axis::Focus].speed, 20.0);
  EXPECT_EQ(config->axes[Axis::Focus].settle, std::chrono::milliseconds(12));
  EXPECT_FALSE(config->axes[Axis::Iris].speed.has_value());
}

TEST(V4l2Config, Refuses) {
  const std::pair<const char*, const char*> cases[] = {
      {"device = \"/dev/video0\"\nserial = \"A\"", "says twice"},
      {"sensor = \"imx219\"\ni2c_bus = 1\nchip = \"dw9714\"", "says twice"},
      {"i2c_bus = 1", "which chip"},
      {"i2c_bus = 1\nchip = \"dw9999\"", "which chip"},
      {"chip = \"dw9714\"", "i2c_bus, which is missing"},
      {"i2c_bus = 1\nchip = \"dw9714\"\ni2c_address = 0x90", "i2c_address"},
      {"format = \"NV12-32\"", "four letters"},
      {"width = 640", "height"},
      {"focus_unit = \"furlongs\"", "focus_unit"},
      {"focus_scale = 0", "focus_scale"},
      {"colour = 1", "colour"},
  };
  for (const auto& [toml, part] : cases) {
    const auto config = Read(toml);
    ASSERT_FALSE(config.has_value()) << toml;
    EXPECT_EQ(config.error().code, Code::BadData);
    EXPECT_THAT(config.error().message, ::testing::HasSubstr(part)) << toml;
    EXPECT_THAT(config.error().message, ::testing::HasSubstr("test.toml")) << toml;
  }
}

TEST(V4l2Formats, NamesAreCodes) {
  EXPECT_EQ(FormatNamed("YUYV"), static_cast<std::uint32_t>(V4L2_PIX_FMT_YUYV));
  EXPECT_EQ(FormatNamed("Y16"), static_cast<std::uint32_t>(V4L2_PIX_FMT_Y16));
  EXPECT_EQ(NameOfFormat(V4L2_PIX_FMT_Y10), "Y10");
  EXPECT_EQ(NameOfFormat(V4L2_PIX_FMT_SRGGB10P), "pRAA");
}

TEST(V4l2Formats, KnowsAndPrefers) {
  for (const char* name : {"GREY", "Y10", "Y12", "Y16", "YUYV", "NV12", "MJPG", "RGGB", "RG10", "RG12", "RG14", "RG16",
                           "pRAA", "pRCC", "pREE"}) {
    EXPECT_TRUE(RawFormatOf(FormatNamed(name)).has_value()) << name;
  }
  EXPECT_FALSE(RawFormatOf(FormatNamed("H264")).has_value());
  EXPECT_EQ(BestOf({V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_GREY}),
            static_cast<std::uint32_t>(V4L2_PIX_FMT_GREY));
  EXPECT_EQ(BestOf({V4L2_PIX_FMT_H264}), std::nullopt);
}

}  // namespace
}  // namespace lensd::drivers::v4l2
