// The camera of the driver v4l2 on the kernel's vivid, and its voice coil on the kernel's i2c-stub: in the virtual
// bench.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <numeric>

#include "drivers/pixels/colour.h"
#include "drivers/v4l2/driver.h"
#include "formats.h"
#include "io/toml.h"
#include "open.h"
#include "stand.h"

namespace lensd::drivers::v4l2 {
namespace {

using drivers::Axis;
using std::chrono::milliseconds;

constexpr const char* kSingle = "/dev/video0";  // single-planar
constexpr const char* kMulti = "/dev/video1";   // multi-planar

/// A control of vivid by its name, as a person would set it.
class Vivid {
 public:
  explicit Vivid(const char* path) : fd_(open(path, O_RDWR)) {
    v4l2_query_ext_ctrl query{};
    for (query.id = V4L2_CTRL_FLAG_NEXT_CTRL; ioctl(fd_, VIDIOC_QUERY_EXT_CTRL, &query) == 0;
         query.id |= V4L2_CTRL_FLAG_NEXT_CTRL) {
      ids_[query.name] = query.id;
    }
  }
  Vivid(const Vivid&) = delete;
  Vivid& operator=(const Vivid&) = delete;
  ~Vivid() { close(fd_); }
  void Set(const std::string& name, int value) const {
    v4l2_control control{ids_.at(name), value};
    ASSERT_EQ(ioctl(fd_, VIDIOC_S_CTRL, &control), 0) << name << ": " << std::strerror(errno);
  }
  std::vector<std::string> Formats(std::uint32_t type) const {
    std::vector<std::string> names;
    v4l2_fmtdesc one{};
    one.type = type;
    for (; ioctl(fd_, VIDIOC_ENUM_FMT, &one) == 0; ++one.index) names.push_back(NameOfFormat(one.pixelformat));
    return names;
  }

 private:
  const int fd_;
  std::map<std::string, std::uint32_t> ids_;
};

Result<drivers::Device> OpenText(const std::string& toml, const Clock& clock) {
  return OpenV4l2(*io::ParseToml(toml, "test.toml"), clock);
}

std::string On(const char* path, const std::string& rest = "") {
  return "device = \"" + std::string(path) + "\"\n" + rest;
}

std::optional<drivers::Frame> NextFrame(drivers::Camera& camera) {
  for (int i = 0; i < 2000; ++i) {
    auto frame = camera.Poll();
    EXPECT_TRUE(frame.has_value()) << frame.error().message;
    if (!frame || *frame) return frame ? *frame : std::nullopt;
    usleep(5000);
  }
  ADD_FAILURE() << "no frame came";
  return std::nullopt;
}

/// One frame, by opening, streaming and closing.
std::optional<drivers::Frame> Grab(const std::string& toml) {
  const MonotonicClock clock;
  auto device = OpenText(toml, clock);
  EXPECT_TRUE(device.has_value()) << device.error().message;
  if (!device || !device->camera) return std::nullopt;
  const auto started = device->camera->Start();
  EXPECT_TRUE(started.has_value()) << started.error().message;
  if (!started) return std::nullopt;
  return NextFrame(*device->camera);
}

/// vivid's patterns by number, without its clock and counters over them.
constexpr int kBlack = 5, kWhite = 6, kGreyRamp = 20;
void ShowPattern(const char* path, int pattern) {
  const Vivid vivid(path);
  vivid.Set("OSD Text Mode", 2);
  vivid.Set("Test Pattern", pattern);
}

double Mean(const drivers::Frame& frame) {
  return std::accumulate(frame.samples->begin(), frame.samples->end(), 0.0) /
         static_cast<double>(frame.samples->size());
}

/// Every format that vivid offers and this driver knows shows black as black, white as white, and a ramp that rises.
void ExpectPictures(const char* path, std::uint32_t type, const std::vector<std::string>& must_have) {
  const auto offered = Vivid(path).Formats(type);
  for (const std::string& name : must_have) EXPECT_THAT(offered, ::testing::Contains(name));
  int known = 0;
  for (const std::string& name : offered) {
    if (!RawFormatOf(FormatNamed(name))) continue;
    SCOPED_TRACE(name);
    ++known;
    const std::string toml = On(path, "format = \"" + name + "\"\n");
    ShowPattern(path, kBlack);
    const auto black = Grab(toml);
    ShowPattern(path, kWhite);
    const auto white = Grab(toml);
    ShowPattern(path, kGreyRamp);
    const auto ramp = Grab(toml);
    ASSERT_TRUE(black && white && ramp);
    const double full = (1 << black->bits) - 1;
    EXPECT_EQ(black->width, 640);
    EXPECT_EQ(black->height, 360);
    EXPECT_LE(Mean(*black), 0.01 * full);
    EXPECT_GE(Mean(*white), 0.98 * full);
    // Grey rises from left to right on every row, by a pixel at a time.
    const auto row = ramp->samples->begin() + 180 * 640;
    EXPECT_LT(row[20], 0.1 * full);
    EXPECT_GT(row[619], 0.9 * full);
    int falls = 0;
    for (int x = 21; x < 620; ++x) falls += row[x] + 0.02 * full < row[x - 1] ? 1 : 0;
    EXPECT_EQ(falls, 0);
  }
  EXPECT_GE(known, static_cast<int>(must_have.size()));
}

/// In every format that vivid offers in one plane and that has colour, red is red, green green and blue blue.
TEST(Vivid, ColoursAreThoseShown) {
  constexpr int kRed = 7;  // then green, then blue
  int known = 0;
  for (const std::string& name : Vivid(kSingle).Formats(V4L2_BUF_TYPE_VIDEO_CAPTURE)) {
    const auto raw = RawFormatOf(FormatNamed(name));
    if (!raw || !drivers::pixels::HasColour(*raw)) continue;
    SCOPED_TRACE(name);
    ++known;
    for (std::size_t shown = 0; shown < 3; ++shown) {
      ShowPattern(kSingle, kRed + static_cast<int>(shown));
      const auto frame = Grab(On(kSingle, "format = \"" + name + "\"\n"));
      ASSERT_TRUE(frame && frame->colour);
      const auto colour = frame->colour();
      ASSERT_TRUE(colour);
      const double full = (1 << frame->bits) - 1;
      const std::size_t middle = (180 * 640 + 320) * 3;
      for (std::size_t channel = 0; channel < 3; ++channel) {
        EXPECT_NEAR((*colour)[middle + channel] / full, channel == shown ? 1.0 : 0.0, 0.04) << shown << channel;
      }
    }
  }
  EXPECT_GE(known, 18);
}

TEST(Vivid, PicturesInEveryFormatOnOnePlane) {
  ExpectPictures(kSingle, V4L2_BUF_TYPE_VIDEO_CAPTURE,
                 {"YUYV", "NV12", "GREY", "Y10", "Y12", "Y16", "BA81", "GBRG", "GRBG", "RGGB", "BG10", "RG10", "BG12",
                  "RG12", "BYR2", "RG16"});
}

TEST(Vivid, PicturesInSeveralPlanes) {
  ExpectPictures(kMulti, V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE, {"YUYV", "NM12", "GREY"});
}

TEST(Vivid, SizeAndRateAsConfigured) {
  const MonotonicClock clock;
  const auto device =
      OpenText(On(kSingle, "format = \"GREY\"\nwidth = 320\nheight = 180\nframe_rate_hz = 25\n"), clock);
  ASSERT_TRUE(device.has_value()) << device.error().message;
  EXPECT_EQ(device->camera->capabilities().width, 320);
  EXPECT_EQ(device->camera->capabilities().height, 180);
  EXPECT_DOUBLE_EQ(device->camera->capabilities().frame_rate_hz, 25.0);
  EXPECT_EQ(device->lens, nullptr);
}

TEST(Vivid, RefusesWhatItHasNot) {
  const MonotonicClock clock;
  EXPECT_EQ(CodeOf(OpenText(On(kSingle, "format = \"H264\"\n"), clock)), Code::Unsupported);
  EXPECT_EQ(CodeOf(OpenText(On(kSingle, "format = \"MJPG\"\n"), clock)), Code::Unsupported);
  EXPECT_EQ(CodeOf(OpenText(On(kSingle, "width = 333\nheight = 222\n"), clock)), Code::Unsupported);
  EXPECT_EQ(CodeOf(OpenText(On(kSingle, "parts = \"lens\"\n"), clock)), Code::Unsupported);
  EXPECT_EQ(CodeOf(OpenText(On("/dev/video9"), clock)), Code::Disconnected);
  EXPECT_EQ(CodeOf(OpenText(On("/dev/null"), clock)), Code::Unsupported);
}

TEST(Vivid, AnotherProgramStreams) {
  const MonotonicClock clock;
  const auto first = OpenText(On(kSingle), clock);
  const auto second = OpenText(On(kSingle), clock);
  ASSERT_TRUE(first && second);
  ASSERT_TRUE(first->camera->Start().has_value());
  EXPECT_EQ(CodeOf(second->camera->Start()), Code::Busy);
  EXPECT_TRUE(NextFrame(*first->camera).has_value());
  ASSERT_TRUE(first->camera->Stop().has_value());
  EXPECT_TRUE(second->camera->Start().has_value());
}

/// The kernel's stamps: of the exposure's end, or of its start, where the driver says so.
TEST(Vivid, TimesAreTheKernels) {
  const MonotonicClock clock;
  for (const bool at_start : {false, true}) {
    Vivid(kSingle).Set("Timestamp Source", at_start ? 1 : 0);
    const auto device =
        OpenText(On(kSingle, "format = \"GREY\"\nwidth = 320\nheight = 180\nframe_rate_hz = 10\n"), clock);
    ASSERT_TRUE(device.has_value()) << device.error().message;
    const Instant before = clock.Now();
    ASSERT_TRUE(device->camera->Start().has_value());
    const auto frame = NextFrame(*device->camera);
    ASSERT_TRUE(frame.has_value());
    EXPECT_GT(frame->exposure_end, before);
    EXPECT_LE(frame->exposure_end, clock.Now());
    // No exposure time is known: a whole period may have been exposed, and after a stamp at the end it may have been
    // read out. vivid hands a frame over at its start.
    if (at_start) {
      EXPECT_LE(frame->exposure_end - frame->exposure_start, milliseconds(100));
    } else {
      EXPECT_EQ(frame->exposure_end - frame->exposure_start, milliseconds(200));
    }
  }
  Vivid(kSingle).Set("Timestamp Source", 0);
}

TEST(Vivid, CountsTheFramesItLost) {
  Vivid vivid(kSingle);
  const MonotonicClock clock;
  const auto device = OpenText(On(kSingle, "format = \"GREY\"\nwidth = 320\nheight = 180\n"), clock);
  ASSERT_TRUE(device.has_value());
  ASSERT_TRUE(device->camera->Start().has_value());
  const auto first = NextFrame(*device->camera);
  // The rig does not ask for so long that the buffers run out: the newest of what was kept comes next, then fresh ones.
  sleep(3);
  const auto second = NextFrame(*device->camera);
  const auto third = NextFrame(*device->camera);
  ASSERT_TRUE(first && second && third);
  EXPECT_GT(second->sequence, first->sequence);
  EXPECT_GT(third->sequence, second->sequence);
  EXPECT_GT(third->exposure_start, second->exposure_start);
}

TEST(Vivid, IsFoundByTheProbe) {
  const auto found = ProbeV4l2();
  ASSERT_TRUE(found.has_value()) << found.error().message;
  ASSERT_EQ(found->size(), 2u);
  for (const auto& device : *found) {
    EXPECT_TRUE(device.camera);
    EXPECT_FALSE(device.lens);
    EXPECT_EQ(device.problem, "");
    const auto settings = io::ParseToml(device.config, "probe");
    ASSERT_TRUE(settings.has_value()) << device.config;
    const MonotonicClock clock;
    const auto opened = OpenV4l2(*settings, clock);
    EXPECT_TRUE(opened.has_value()) << opened.error().message;
  }
}

/// vivid can play a device that is pulled out; it comes back when the last program lets go of it.
class VividStand final : public contract::RealStand {
 public:
  Result<drivers::Device> Open() override {
    return OpenText(On(kSingle, "format = \"GREY\"\nwidth = 320\nheight = 180\nframe_rate_hz = 25\n"), clock());
  }
  bool Unplug() override {
    holder_.emplace(kSingle);
    holder_->Set("Disconnect", 1);
    return true;
  }
  void Plug() override { holder_.reset(); }

 private:
  std::optional<Vivid> holder_;
};

/// What the stub has been sent: a register per high byte.
class I2cStub {
 public:
  I2cStub() : fd_(open("/dev/i2c-0", O_RDWR)) { EXPECT_EQ(ioctl(fd_, I2C_SLAVE, 0x0c), 0); }
  I2cStub(const I2cStub&) = delete;
  I2cStub& operator=(const I2cStub&) = delete;
  ~I2cStub() { close(fd_); }
  int At(int high) const {
    i2c_smbus_data data{};
    i2c_smbus_ioctl_data request{I2C_SMBUS_READ, static_cast<__u8>(high), I2C_SMBUS_BYTE_DATA, &data};
    EXPECT_EQ(ioctl(fd_, I2C_SMBUS, &request), 0);
    return data.byte;
  }

 private:
  const int fd_;
};

constexpr const char* kCoil = "i2c_bus = 0\ni2c_address = 0x0c\nchip = \"dw9714\"\n";

/// V4L2 lens fact sheet, section 3: big-endian (code << 4) | S, S = 0.
TEST(I2cStub, BytesOfACode) {
  const MonotonicClock clock;
  const auto device = OpenText(std::string(kCoil) + "focus_speed = 0\n", clock);
  ASSERT_TRUE(device.has_value()) << device.error().message;
  const I2cStub stub;
  for (const int code : {1023, 512, 291}) {
    ASSERT_TRUE(device->lens->StartMove(Axis::Focus, Native{static_cast<double>(code)}).has_value());
    EXPECT_EQ(stub.At(code >> 4), (code & 0xf) << 4) << code;
  }
}

TEST(I2cStub, ABusWithoutTheChip) {
  const MonotonicClock clock;
  EXPECT_EQ(CodeOf(OpenText("i2c_bus = 0\ni2c_address = 0x20\nchip = \"dw9714\"\n", clock)), Code::Disconnected);
  EXPECT_EQ(CodeOf(OpenText("i2c_bus = 7\nchip = \"dw9714\"\n", clock)), Code::Disconnected);
  EXPECT_EQ(CodeOf(OpenText("i2c_bus = \"/dev/null\"\nchip = \"dw9714\"\n", clock)), Code::Unsupported);
}

class CoilStand final : public contract::RealStand {
 public:
  Result<drivers::Device> Open() override { return OpenText(kCoil, clock()); }
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(Vivid, CameraContract, contract::Stands<VividStand>());
INSTANTIATE_TEST_SUITE_P(I2cStub, LensContract, contract::Stands<CoilStand>());

}  // namespace lensd::drivers::v4l2
