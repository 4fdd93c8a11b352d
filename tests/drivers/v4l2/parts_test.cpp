// One bad part costs that part: the tables of tests/drivers/one-bad-part, and tables that are drawn with defects on
// random parts. Which parts are healthy is known from the draw.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "open.h"
#include "table_kernel.h"
#include "test_level.h"

namespace lensd::drivers::v4l2 {
namespace {

using drivers::Axis;
using ::testing::HasSubstr;

constexpr std::uint32_t kFocus = V4L2_CID_FOCUS_ABSOLUTE, kZoom = V4L2_CID_ZOOM_ABSOLUTE,
                        kIris = V4L2_CID_IRIS_ABSOLUTE;

struct Case {
  const char* table;
  const char* left_out;  ///< "": a part that is not the focus costs nothing
};
class OneBadPart : public ::testing::TestWithParam<Case> {};

TEST_P(OneBadPart, FocusWorks) {
  TableKernel kernel;
  SteppedClock clock;
  kernel.ReadTable(std::string(PARTS_FOLDER "/") + GetParam().table);
  ASSERT_EQ(kernel.controls.size(), 2u);
  const auto device = OpenOn(kernel, {.device = "/dev/video0"}, clock);
  ASSERT_TRUE(device.has_value()) << device.error().message;
  ASSERT_NE(device->lens, nullptr);
  EXPECT_NE(device->camera, nullptr);
  ASSERT_TRUE(device->lens->StartMove(Axis::Focus, Native{100.0}).has_value());
  EXPECT_EQ(kernel.controls[kFocus].value, 100);
  EXPECT_TRUE(device->lens->Read().has_value());
  const std::string part = GetParam().left_out;
  EXPECT_EQ(device->findings.left_out().size(), part.empty() ? 0u : 1u);
  EXPECT_EQ(device->findings.doubts().size(), part.empty() ? 1u : 0u);
  if (part.empty()) return;
  ASSERT_NE(device->findings.Of(part), nullptr);
  EXPECT_NE(device->findings.Of(part)->reason, "");
}

INSTANTIATE_TEST_SUITE_P(V4l2, OneBadPart,
                         ::testing::Values(Case{"autofocus-cannot-be-set.ctl", ""},
                                           Case{"exposure-reversed.ctl", "exposure"}, Case{"gain-reversed.ctl", "gain"},
                                           Case{"zoom-65535-as-minus-1.ctl", "zoom"}, Case{"zoom-reversed.ctl", "zoom"},
                                           Case{"zoom-unreadable.ctl", "zoom"}));

TEST(V4l2Parts, PicturesThatCannotBeReadLeaveTheLens) {
  for (const std::uint32_t code : {V4L2_PIX_FMT_H264, V4L2_PIX_FMT_BGR24, V4L2_PIX_FMT_NV16}) {
    TableKernel kernel;
    SteppedClock clock;
    kernel.controls[kFocus] = {.maximum = 250, .step = 5};
    kernel.pictures.code = code;
    const auto device = OpenOn(kernel, {.device = "/dev/video0"}, clock);
    ASSERT_TRUE(device.has_value()) << device.error().message;
    EXPECT_EQ(device->camera, nullptr);
    ASSERT_NE(device->findings.Of("camera"), nullptr);
    EXPECT_THAT(device->findings.Of("camera")->reason, HasSubstr("no picture format of this device can be read"));
    // Where the configuration asks for pictures, their lack is an error.
    EXPECT_FALSE(OpenOn(kernel, {.device = "/dev/video0", .format = "GREY"}, clock).has_value());
    EXPECT_FALSE(OpenOn(kernel, {.device = "/dev/video0", .parts = Parts::Camera}, clock).has_value());
  }
}

TEST(V4l2Parts, OfADeviceOfNoUseTheErrorSaysWhyOfEachPart) {
  TableKernel kernel;
  SteppedClock clock;
  kernel.controls[kFocus] = {.minimum = 100, .maximum = 1};
  kernel.controls[kZoom] = {.maximum = 100, .get = {EIO, -1}};
  kernel.pictures.code = V4L2_PIX_FMT_H264;
  const auto device = OpenOn(kernel, {.device = "/dev/video0"}, clock);
  ASSERT_FALSE(device.has_value());
  for (const char* said : {"focus (", "from 100 to 1", "zoom (", "Input/output error", "camera (", "picture format"}) {
    EXPECT_THAT(device.error().message, HasSubstr(said));
  }
}

// ---- drawn --------------------------------------------------------------------------------------------------------

enum class Health { Absent, Healthy, Ill };

struct Part {
  const char* name;
  std::uint32_t id;
  std::optional<Axis> axis{};
  Health health = Health::Absent;
  std::string defect{};
};

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}

  int Below(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  int Error() {
    constexpr std::array kErrors = {EBUSY, EIO, EPIPE, ETIMEDOUT, ERANGE, EREMOTEIO, EPROTO, EACCES};
    return kErrors[static_cast<std::size_t>(Below(kErrors.size()))];
  }

  /// Some order of a range that can be used, read and set: whatever else is odd about it.
  TableControl Healthy() {
    TableControl control;
    control.minimum = Below(3) == 0 ? -Below(500) : Below(500);
    control.maximum = control.minimum + 10 + Below(1000);
    control.step = static_cast<std::uint64_t>(Below(10));  // 0 means that the driver does not say
    control.value = control.minimum + Below(static_cast<int>(control.maximum - control.minimum) + 1);
    const int odd = Below(6);
    if (odd == 0) control.value = control.maximum + 1 + Below(100);  // it stands outside its own range
    if (odd == 1) control.get = {Error(), 1};                        // asked once more it answers
    if (odd == 2) control.query = {Error(), 1};
    if (odd == 3) control.flags = V4L2_CTRL_FLAG_INACTIVE;
    return control;
  }

  TableControl Ill(std::string& defect) {
    TableControl control = Healthy();
    control.get = control.query = {};
    switch (Below(8)) {
      case 0:
        defect = "reversed";
        std::swap(control.minimum, control.maximum);
        break;
      case 1:
        defect = "65535 as -1";
        control.minimum = 0;
        control.maximum = -1;
        break;
      case 2:
        defect = "fixed";
        control.maximum = control.minimum;
        break;
      case 3:
        defect = "step larger than the range";
        control.step = static_cast<std::uint64_t>(control.maximum - control.minimum) + 1 + Below(1000);
        break;
      case 4:
        defect = "unreadable";
        control.get = {Below(4) == 0 ? EINVAL : Error(), -1};
        break;
      case 5:
        defect = "no answer to what it is";
        control.query = {Error(), -1};
        break;
      case 6:
        defect = "cannot be set";
        control.flags |= V4L2_CTRL_FLAG_READ_ONLY;
        break;
      default:
        defect = "beyond 32 bits";
        control.maximum = std::int64_t{1} << (40 + Below(20));
    }
    return control;
  }

  Health health() {
    const int of_ten = Below(10);
    return of_ten < 3 ? Health::Absent : of_ten < 6 ? Health::Healthy : Health::Ill;
  }

  void Pictures(TableKernel& kernel, Part& camera) {
    camera.health = Below(2) == 0 ? Health::Healthy : Health::Ill;
    constexpr std::array kGood = {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_Y16};
    constexpr std::array kBad = {V4L2_PIX_FMT_H264, V4L2_PIX_FMT_BGR24, V4L2_PIX_FMT_NV16, V4L2_PIX_FMT_HEVC};
    const auto some = [&](const auto& codes) { return codes[static_cast<std::size_t>(Below(4))]; };
    kernel.pictures.code = camera.health == Health::Healthy ? some(kGood) : some(kBad);
    if (camera.health == Health::Healthy) return;
    if (Below(3) == 0) kernel.pictures.get_format = {Below(2) == 0 ? EINVAL : Error(), -1};
    if (Below(3) == 0) kernel.pictures.width = 0;
    if (Below(5) == 0) kernel.capability = {Error(), -1};
  }

  /// An automatism that is there, is of no use, or says that it is on.
  void Automatism(TableKernel& kernel, std::uint32_t id) {
    const int kind = Below(6);
    if (kind == 0) return;
    TableControl control{.type = V4L2_CTRL_TYPE_BOOLEAN, .maximum = 1, .value = Below(2)};
    if (kind == 1) control.query = {Error(), -1};
    if (kind == 2) control.get = {Error(), -1};
    if (kind == 3) control.set = {Error(), -1};
    if (kind == 4) std::swap(control.minimum, control.maximum);
    kernel.controls[id] = control;
  }

 private:
  std::mt19937 random_;
};

/// Every healthy axis goes where it is sent, and is read there.
void Drive(const drivers::Device& device, const Part& part, TableKernel& kernel, Draw& draw, SteppedClock& clock) {
  ASSERT_NE(device.lens, nullptr);
  const auto& can = device.lens->capabilities().axes[*part.axis];
  ASSERT_TRUE(can.has_value());
  TableControl& control = kernel.controls[part.id];
  const std::int64_t step = control.step == 0 ? 1 : static_cast<std::int64_t>(control.step);
  const std::int64_t target =
      control.minimum + draw.Below(static_cast<int>((control.maximum - control.minimum) / step)) * step;
  ASSERT_TRUE(device.lens->StartMove(*part.axis, Native{static_cast<double>(target)}).has_value());
  clock.Advance(std::chrono::seconds(1));
  EXPECT_EQ(control.value, target);
  const auto state = device.lens->Read();
  ASSERT_TRUE(state.has_value()) << state.error().message;
  ASSERT_TRUE(state->axes[*part.axis].has_value());
  EXPECT_EQ(state->axes[*part.axis]->position, Native{static_cast<double>(target)});
  EXPECT_EQ(state->axes[*part.axis]->fault, "");
}

void CheckPart(const drivers::Device& device, const Part& part) {
  const drivers::LeftOut* left_out = device.findings.Of(part.name);
  EXPECT_EQ(left_out != nullptr, part.health == Health::Ill) << (left_out != nullptr ? left_out->reason : "");
  EXPECT_TRUE(left_out == nullptr || !left_out->reason.empty());
  if (part.axis && device.lens) {
    EXPECT_EQ(device.lens->capabilities().axes[*part.axis].has_value(), part.health == Health::Healthy);
  }
}

void PlayOne(unsigned seed) {
  Draw draw(seed);
  TableKernel kernel;
  SteppedClock clock;
  std::vector<Part> parts = {{"focus", kFocus, Axis::Focus}, {"iris", kIris, Axis::Iris}, {"zoom", kZoom, Axis::Zoom}};
  Part exposure{"exposure", V4L2_CID_EXPOSURE_ABSOLUTE}, gain{"gain", V4L2_CID_GAIN}, camera{"camera", 0};
  std::string drawn;
  const auto draw_control = [&](Part& part) {
    part.health = draw.health();
    if (part.health == Health::Healthy) kernel.controls[part.id] = draw.Healthy();
    if (part.health == Health::Ill) kernel.controls[part.id] = draw.Ill(part.defect);
    drawn += std::string(" ") + part.name + "=" +
             (part.health == Health::Absent    ? "absent"
              : part.health == Health::Healthy ? "healthy"
                                               : part.defect);
  };
  for (Part& part : parts) draw_control(part);
  draw_control(exposure);
  draw_control(gain);
  draw.Pictures(kernel, camera);
  draw.Automatism(kernel, V4L2_CID_FOCUS_AUTO);
  draw.Automatism(kernel, V4L2_CID_EXPOSURE_AUTO);
  SCOPED_TRACE("seed " + std::to_string(seed) + ":" + drawn +
               (camera.health == Health::Healthy ? " camera=healthy" : " camera=ill"));
  const auto device = OpenOn(kernel, {.device = "/dev/video0"}, clock);
  const bool any_axis = std::ranges::count(parts, Health::Healthy, &Part::health) > 0;
  if (!any_axis && camera.health == Health::Ill) {
    ASSERT_FALSE(device.has_value());
    for (const Part& part : parts) {
      EXPECT_THAT(device.error().message, HasSubstr(part.health == Health::Ill ? part.name : ""));
    }
    EXPECT_THAT(device.error().message, HasSubstr("camera ("));
    return;
  }
  ASSERT_TRUE(device.has_value()) << device.error().message;
  EXPECT_EQ(device->camera != nullptr, camera.health == Health::Healthy);
  for (const Part& part : parts) {
    SCOPED_TRACE(part.name);
    CheckPart(*device, part);
    if (part.health == Health::Healthy) Drive(*device, part, kernel, draw, clock);
  }
  CheckPart(*device, camera);
  if (!device->camera) {
    for (const Part& part : {exposure, gain}) {
      EXPECT_EQ(device->findings.Of(part.name) != nullptr, part.health != Health::Absent) << part.name;
    }
    return;
  }
  CheckPart(*device, exposure);
  CheckPart(*device, gain);
  EXPECT_EQ(device->camera->capabilities().can_set_exposure, exposure.health == Health::Healthy);
  EXPECT_EQ(device->camera->capabilities().gain.has_value(), gain.health == Health::Healthy);
  EXPECT_TRUE(device->camera->ReadExposure().has_value());
  if (gain.health == Health::Healthy) {
    const auto wanted = static_cast<double>(kernel.controls[gain.id].minimum);
    EXPECT_TRUE(device->camera->SetGain(wanted).has_value());
    EXPECT_EQ(kernel.controls[gain.id].value, kernel.controls[gain.id].minimum);
  }
}

TEST(V4l2Parts, DrawnDefectsCostThePartsThatHaveThem) {
  const long count = testing::ByLevel(300, 3'000, 1'000'000);
  for (long i = 0; i < count && !::testing::Test::HasFailure(); ++i) PlayOne(static_cast<unsigned>(i));
}

}  // namespace
}  // namespace lensd::drivers::v4l2
