// The driver v4l2 on the kernel's uvcvideo, before a simulated USB camera with a motorised lens: in the virtual bench.
// Order and state are asserted, never time.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cmath>

#include "drivers/hotplug/nodes.h"
#include "drivers/v4l2/driver.h"
#include "grating_scene.h"
#include "io/toml.h"
#include "sim/devices/uvc_camera.h"
#include "stand.h"

namespace lensd::drivers::v4l2 {
namespace {

using drivers::Axis;
using sim::devices::UvcCamera;
using sim::devices::UvcFaults;
using sim::devices::UvcModel;

constexpr const char* kSerial = "V4L2";

const MonotonicClock& Now() {
  static const MonotonicClock clock;
  return clock;
}

/// A grating before a lens whose whole travel takes half a second.
std::shared_ptr<const sim::Scene> TheScene() {
  sim::Scene scene = testing::GratingScene(64, 48, 2048);
  scene.camera.frame_rate_hz = 20;
  return std::make_shared<const sim::Scene>(std::move(scene));
}

/// One for all tests: the kernel takes a while to bind.
UvcCamera& TheCamera() {
  static const auto camera = UvcCamera::Create(TheScene(), Now(), sim::devices::UvcOptions{.serial = kSerial}).value();
  return *camera;
}

bool Eventually(const std::function<bool()>& done) {
  for (int i = 0; i < 1500; ++i) {
    if (done()) return true;
    usleep(20000);
  }
  return done();
}

std::string NodeOfCamera() {
  const auto nodes = drivers::hotplug::ListNodes("video4linux");
  if (!nodes) return "";
  for (const auto& node : *nodes) {
    if (node.serial == kSerial) return node.path;
  }
  return "";
}

Result<drivers::Device> OpenIt(const std::string& more = "") {
  if (auto plugged = TheCamera().Plug(); !plugged) return PassOn(plugged);
  TheCamera().SetFaults(UvcFaults{});
  if (!Eventually([] { return !NodeOfCamera().empty(); })) return Fail(Code::Timeout, "uvcvideo did not bind");
  return OpenV4l2(*io::ParseToml("serial = \"" + std::string(kSerial) + "\"\n" + more, "test.toml"), Now());
}

template <class Answer>
Answer Ask(const std::function<Answer(UvcModel&)>& question) {
  Answer answer{};
  TheCamera().Look([&](UvcModel& model) { answer = question(model); });
  return answer;
}
double TrueFocus() {
  return Ask<double>([](UvcModel& model) { return model.FocusPosition(); });
}

class UvcVideo : public ::testing::Test {
 protected:
  void Open(const std::string& more = "") {
    device = {};
    auto opened = OpenIt(more);
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    device = std::move(*opened);
    ASSERT_TRUE(device.lens && device.camera);
  }
  void MoveTo(double target) {
    const auto moved = device.lens->StartMove(Axis::Focus, Native{target});
    ASSERT_TRUE(moved.has_value()) << moved.error().message;
    ASSERT_TRUE(Eventually([&] { return TrueFocus() == target; })) << TrueFocus();
    const auto state = device.lens->Read();
    ASSERT_TRUE(state.has_value()) << state.error().message;
    EXPECT_EQ(state->axes[Axis::Focus]->position, Native{target});
    EXPECT_EQ(state->axes[Axis::Focus]->fault, "");
  }
  /// Detail in a picture taken after now.
  double Detail() {
    const Instant begin = Now().Now();
    double detail = -1.0;
    EXPECT_TRUE(Eventually([&] {
      const auto frame = device.camera->Poll();
      EXPECT_TRUE(frame.has_value()) << frame.error().message;
      if (!frame || !*frame || (*frame)->exposure_start < begin) return !frame;
      detail = 0.0;
      const auto& samples = *(*frame)->samples;
      for (std::size_t i = 4; i < samples.size(); ++i) detail += std::pow(samples[i] - samples[i - 4], 2.0);
      return true;
    }));
    return detail;
  }

  drivers::Device device;
};

/// Fact sheet v4l2_lens, section 1: uvcvideo passes the device's steps on. It answers readings from its cache, so that
/// a move looks done at once: no feedback.
TEST_F(UvcVideo, TheLensGoesWhereItIsTold) {
  Open();
  const auto& can = *device.lens->capabilities().axes[Axis::Focus];
  EXPECT_EQ(can.maximum, Native{1023});
  EXPECT_FALSE(can.follows());
  EXPECT_FALSE(can.direction) << "the kernel hands on what the camera means";
  EXPECT_TRUE(device.lens->capabilities().axes[Axis::Iris].has_value());
  for (const double target : {700.0, 1023.0, 0.0, 301.0}) ASSERT_NO_FATAL_FAILURE(MoveTo(target));
}

/// A configured speed makes the driver cut a move into writes, which can be stopped midway.
TEST_F(UvcVideo, StopsMidwayWhereASpeedIsGiven) {
  Open("focus_speed = 200\n");
  EXPECT_TRUE(device.lens->capabilities().axes[Axis::Focus]->can_stop);
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{TrueFocus() < 512.0 ? 1023.0 : 0.0}).has_value());
  const double start = TrueFocus();
  ASSERT_TRUE(Eventually([&] { return device.lens->Read().has_value() && std::abs(TrueFocus() - start) > 5.0; }));
  ASSERT_TRUE(device.lens->Stop(Axis::Focus).has_value());
  const auto state = device.lens->Read();
  ASSERT_TRUE(state.has_value());
  EXPECT_FALSE(state->axes[Axis::Focus]->moving);
  EXPECT_TRUE(Eventually([&] { return Native{TrueFocus()} == state->axes[Axis::Focus]->position; }));
}

TEST_F(UvcVideo, ItsAutomaticsAreOffWhileOpenAndRestored) {
  ASSERT_TRUE(OpenIt().has_value());
  const auto automatic = [] { return Ask<bool>([](UvcModel& model) { return model.auto_focus(); }); };
  const auto exposure_mode = [] { return Ask<int>([](UvcModel& model) { return model.ae_mode(); }); };
  EXPECT_TRUE(automatic());
  const int mode = exposure_mode();
  Open();
  EXPECT_FALSE(automatic());
  ASSERT_TRUE(device.camera->SetExposure(std::chrono::milliseconds(5)).has_value());
  EXPECT_EQ(exposure_mode(), 1);  // manual
  device = {};
  EXPECT_TRUE(automatic());
  EXPECT_EQ(exposure_mode(), mode);
}

/// Section 2: EACCES. Real kernel behaviour: focus cannot be set while the camera focuses by itself. The newest command
/// counts, and takes focus from the camera again.
TEST_F(UvcVideo, AnotherProgramSwitchesAutofocusOn) {
  Open();
  ASSERT_NO_FATAL_FAILURE(MoveTo(100));
  const int other = open(NodeOfCamera().c_str(), O_RDWR);
  ASSERT_GE(other, 0);
  v4l2_control control{V4L2_CID_FOCUS_AUTO, 1};
  ASSERT_EQ(ioctl(other, VIDIOC_S_CTRL, &control), 0);
  const auto state = device.lens->Read();
  ASSERT_TRUE(state.has_value());
  EXPECT_THAT(state->axes[Axis::Focus]->fault, ::testing::HasSubstr("autofocus"));
  ASSERT_NO_FATAL_FAILURE(MoveTo(200));
  ASSERT_EQ(ioctl(other, VIDIOC_G_CTRL, &control), 0);
  EXPECT_EQ(control.value, 0);
  close(other);
}

TEST_F(UvcVideo, ARefusedSettingIsAnErrorAndLeftBehind) {
  Open();
  ASSERT_NO_FATAL_FAILURE(MoveTo(300));
  TheCamera().SetFaults(UvcFaults{.stall = 1});
  EXPECT_FALSE(device.lens->StartMove(Axis::Focus, Native{600}).has_value());
  ASSERT_NO_FATAL_FAILURE(MoveTo(500));
}

/// Pictures depend on the focus written, in both formats of the camera.
TEST_F(UvcVideo, PicturesShowTheFocus) {
  for (const char* format : {"YUYV", "MJPG"}) {
    SCOPED_TRACE(format);
    Open("format = \"" + std::string(format) + "\"\n");
    ASSERT_TRUE(device.camera->Start().has_value());
    const auto detail_at = [&](double focus) {
      MoveTo(focus);
      return Detail();
    };
    // 25 mm focused at 1 m: 0.641 mm of the 1.6 mm of extension.
    const double sharp = detail_at(410), blurred = detail_at(1000);
    EXPECT_GT(sharp, 2.0 * blurred);
    EXPECT_GT(detail_at(410), 2.0 * blurred);
  }
}

TEST_F(UvcVideo, IsFoundByTheProbeBySerialNumber) {
  ASSERT_TRUE(OpenIt().has_value());
  const auto found = ProbeV4l2();
  ASSERT_TRUE(found.has_value()) << found.error().message;
  ASSERT_EQ(found->size(), 1u);
  EXPECT_TRUE(found->front().lens && found->front().camera);
  EXPECT_EQ(found->front().serial, kSerial);
  EXPECT_EQ(found->front().config, "serial = \"V4L2\"\n");
}

class UvcVideoStand : public contract::RealStand {
 public:
  explicit UvcVideoStand(const char* format) : format_(format) {}
  ~UvcVideoStand() override { Plug(); }
  Result<drivers::Device> Open() override {
    const std::string keys = "format = \"" + std::string(format_) + "\"\n";
    if (!unplugged_) return OpenIt(keys);
    return OpenV4l2(*io::ParseToml("serial = \"" + std::string(kSerial) + "\"\n" + keys, "test.toml"), clock());
  }
  bool Unplug() override {
    unplugged_ = true;
    TheCamera().Unplug();
    return Eventually([] { return NodeOfCamera().empty(); });
  }
  void Plug() override { unplugged_ = false; }
  Duration LookEvery() const override { return std::chrono::milliseconds(20); }

 private:
  const char* const format_;
  bool unplugged_ = false;
};
struct YuyvStand : UvcVideoStand {
  YuyvStand() : UvcVideoStand("YUYV") {}
};
struct MjpegStand : UvcVideoStand {
  MjpegStand() : UvcVideoStand("MJPG") {}
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(UvcVideo, LensContract, contract::Stands<YuyvStand>());
INSTANTIATE_TEST_SUITE_P(UvcVideoYuyv, CameraContract, contract::Stands<YuyvStand>());
INSTANTIATE_TEST_SUITE_P(UvcVideoMjpeg, CameraContract, contract::Stands<MjpegStand>());

}  // namespace lensd::drivers::v4l2
