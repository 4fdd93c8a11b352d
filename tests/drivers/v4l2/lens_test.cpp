// Lens controls, voice coils and the media graph, on a scripted kernel: no packaged kernel module has a lens
// sub-device, an ancillary link or a chip that can be read. Sections are those of the V4L2 lens fact sheet.
#include "drivers/v4l2/driver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stand.h"
#include "v4l2_fixture.h"

namespace lensd::drivers::v4l2 {
namespace {

/// Section 3: opening powers the coil and the last close parks it, so one handle lives as long as the lens.
TEST_F(V4l2Lens, HoldsTheNodeOpenForLife) {
  OpenCoil();
  EXPECT_EQ(kernel.nodes[kCoil].opened, 1);
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{300}).has_value());
  clock.Advance(milliseconds(100));
  Focus();
  EXPECT_EQ(kernel.nodes[kCoil].closed, 0);
  device = {};
  EXPECT_EQ(kernel.nodes[kCoil].opened, 1);
  EXPECT_EQ(kernel.nodes[kCoil].closed, 1);
}

TEST_F(V4l2Lens, ACoilHasNoFeedbackAndSettlesByTime) {
  OpenCoil();
  const auto& can = *device.lens->capabilities().axes[Axis::Focus];
  EXPECT_EQ(can.minimum, Native{0});
  EXPECT_EQ(can.maximum, Native{1023});
  EXPECT_FALSE(can.follows());
  EXPECT_EQ(can.settle, milliseconds(10));
  EXPECT_FALSE(device.lens->capabilities().axes[Axis::Iris].has_value());
}

/// Section 1: V4L2 has larger values nearer; uvcvideo hands on whatever the camera means.
TEST_F(V4l2Lens, TheDirectionIsThatOfTheStandardWhereTheKernelKeepsToIt) {
  OpenCoil();
  const auto direction = [&] { return device.lens->capabilities().axes[Axis::Focus]->direction; };
  ASSERT_TRUE(direction());
  EXPECT_EQ(direction()->direction, drivers::Direction::NearPositive);
  EXPECT_EQ(direction()->by, "the V4L2 standard");
  for (const char* driver : {"scripted", "uvcvideo"}) {
    device = {};
    kernel.nodes[kVideo] = VideoNode();
    kernel.nodes[kVideo].driver = driver;
    Open({.device = kVideo, .parts = Parts::Lens});
    EXPECT_EQ(direction().has_value(), driver == std::string("scripted"));
    EXPECT_FALSE(device.lens->capabilities().axes[Axis::Iris]->direction) << "it is of focus";
  }
}

/// Section 3: full-scale jumps click the coil: long moves are ramped, as the kernel does, at 16 codes a millisecond.
TEST_F(V4l2Lens, RampsLongMoves) {
  OpenCoil();
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{100}).has_value());
  for (int i = 0; i < 5; ++i) {
    clock.Advance(milliseconds(2));
    EXPECT_EQ(Focus().moving, i < 3) << i;
  }
  EXPECT_THAT(FocusWrites(kCoil), ElementsAre(0, 32, 64, 96, 100));
}

TEST_F(V4l2Lens, StopsMidRamp) {
  OpenCoil();
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{1000}).has_value());
  clock.Advance(milliseconds(10));
  EXPECT_TRUE(Focus().moving);
  ASSERT_TRUE(device.lens->Stop(Axis::Focus).has_value());
  clock.Advance(milliseconds(100));
  EXPECT_FALSE(Focus().moving);
  EXPECT_EQ(Focus().position, Native{160});
}

/// Section 2: integers are clamped without a word. Found by reading back, once the number stands still.
TEST_F(V4l2Lens, FindsSilentClamping) {
  kernel.nodes[kCoil] = CoilNode();
  kernel.nodes[kCoil].controls[V4L2_CID_FOCUS_ABSOLUTE].applied = [](std::int64_t code) {
    return std::min<std::int64_t>(code, 800);
  };
  Open({.device = kCoil});
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{1000}).has_value());
  clock.Advance(milliseconds(70));
  EXPECT_TRUE(Focus().moving);
  clock.Advance(milliseconds(400));
  Focus();
  const auto state = Focus();
  EXPECT_FALSE(state.moving);
  EXPECT_EQ(state.position, Native{800});
  EXPECT_EQ(state.fault, "it took 800 instead of 1000");
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{700}).has_value());
  clock.Advance(milliseconds(70));
  Focus();
  EXPECT_EQ(Focus().fault, "");
  EXPECT_EQ(Focus().position, Native{700});
}

/// A device that shows where it is while it travels counts as moving until it stands still.
TEST_F(V4l2Lens, FollowsADeviceThatTravels) {
  kernel.nodes[kVideo] = VideoNode();
  auto& focus = kernel.nodes[kVideo].controls[V4L2_CID_FOCUS_ABSOLUTE];
  focus.applied = [](std::int64_t) { return 0; };
  Open({.device = kVideo});
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{200}).has_value());
  for (int at = 0; at < 200; at += 20) {
    focus.value = at;
    clock.Advance(milliseconds(200));
    ASSERT_TRUE(Focus().moving) << at;
  }
  focus.value = 200;
  EXPECT_FALSE(Focus().moving);
  EXPECT_EQ(Focus().fault, "");
}

TEST_F(V4l2Lens, SwitchesTheDevicesAutofocusOffFirstAndBackAfter) {
  kernel.nodes[kVideo] = VideoNode();
  Open({.device = kVideo});
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{100}).has_value());
  device = {};
  const auto& writes = kernel.nodes[kVideo].writes;
  ASSERT_EQ(writes.size(), 3u);
  EXPECT_EQ(writes[0], (std::pair<std::uint32_t, std::int64_t>{V4L2_CID_FOCUS_AUTO, 0}));
  EXPECT_EQ(writes[1], (std::pair<std::uint32_t, std::int64_t>{V4L2_CID_FOCUS_ABSOLUTE, 100}));
  EXPECT_EQ(writes[2], (std::pair<std::uint32_t, std::int64_t>{V4L2_CID_FOCUS_AUTO, 1}));
  EXPECT_EQ(kernel.nodes[kVideo].closed, 1);
}

TEST_F(V4l2Lens, LeavesAnAutofocusAloneThatIsOff) {
  kernel.nodes[kVideo] = VideoNode();
  kernel.nodes[kVideo].controls[V4L2_CID_FOCUS_AUTO].value = 0;
  Open({.device = kVideo});
  device = {};
  EXPECT_TRUE(kernel.nodes[kVideo].writes.empty());
}

v4l2_event ControlChanged(std::uint32_t id, std::uint32_t changes, std::int32_t value) {
  v4l2_event event{};
  event.type = V4L2_EVENT_CTRL;
  event.id = id;
  event.u.ctrl.changes = changes;
  event.u.ctrl.value = value;
  return event;
}

/// Section 2: events tell what another program does.
TEST_F(V4l2Lens, HearsWhatOthersDo) {
  kernel.nodes[kVideo] = VideoNode();
  Open({.device = kVideo});
  auto& node = kernel.nodes[kVideo];
  node.controls[V4L2_CID_FOCUS_AUTO].value = 1;
  node.events.push_back(ControlChanged(V4L2_CID_FOCUS_AUTO, V4L2_EVENT_CTRL_CH_VALUE, 1));
  EXPECT_THAT(Focus().fault, HasSubstr("autofocus"));
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{50}).has_value());
  EXPECT_EQ(node.controls[V4L2_CID_FOCUS_AUTO].value, 0) << "the newest command takes focus again";
  EXPECT_EQ(Focus().fault, "");
  node.events.push_back(ControlChanged(V4L2_CID_FOCUS_ABSOLUTE, V4L2_EVENT_CTRL_CH_RANGE, 0));
  EXPECT_THAT(Focus().fault, HasSubstr("range"));
  // The iris cannot be read: the event is all there is.
  node.events.push_back(ControlChanged(V4L2_CID_IRIS_ABSOLUTE, V4L2_EVENT_CTRL_CH_VALUE, 560));
  EXPECT_EQ(device.lens->Read()->axes[Axis::Iris]->position, Native{560});
}

TEST_F(V4l2Lens, ReadsWhereAnotherProgramHasPutIt) {
  OpenCoil();
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{10}).has_value());
  clock.Advance(milliseconds(10));
  Focus();
  Focus();
  kernel.nodes[kCoil].controls[V4L2_CID_FOCUS_ABSOLUTE].value = 77;
  EXPECT_EQ(Focus().position, Native{77});
  EXPECT_EQ(Focus().fault, "");
}

/// Section 1: an iris in hundredths of f-numbers, write-only on some drivers.
TEST_F(V4l2Lens, AWriteOnlyIrisInFNumbers) {
  kernel.nodes[kVideo] = VideoNode();
  Config config{.device = kVideo};
  config.axes[Axis::Iris] = {.unit = drivers::NativeUnit::FNumber, .scale = 0.01};
  Open(config);
  const auto& can = *device.lens->capabilities().axes[Axis::Iris];
  EXPECT_EQ(can.unit, drivers::NativeUnit::FNumber);
  EXPECT_DOUBLE_EQ(can.minimum.value, 2.8);
  EXPECT_DOUBLE_EQ(can.maximum.value, 22.0);
  EXPECT_DOUBLE_EQ(can.resolution, 0.01);
  EXPECT_FALSE(can.can_stop);
  // Where it stands before the first command is not known.
  EXPECT_FALSE(device.lens->Read()->axes[Axis::Iris]->homed);
  ASSERT_TRUE(device.lens->StartMove(Axis::Iris, Native{5.6}).has_value());
  EXPECT_EQ(kernel.nodes[kVideo].controls[V4L2_CID_IRIS_ABSOLUTE].value, 560);
  EXPECT_TRUE(device.lens->Read()->axes[Axis::Iris]->homed);
  EXPECT_DOUBLE_EQ(device.lens->Read()->axes[Axis::Iris]->position.value, 5.6);
}

TEST_F(V4l2Lens, TargetsFallOnTheControlsGrid) {
  kernel.nodes[kVideo] = VideoNode();
  Open({.device = kVideo});
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{102}).has_value());
  EXPECT_EQ(kernel.nodes[kVideo].controls[V4L2_CID_FOCUS_ABSOLUTE].value, 100);
}

/// Section 2: what each errno means.
TEST_F(V4l2Lens, ErrorsOfTheKernel) {
  OpenCoil();
  const std::pair<int, Code> cases[] = {{EIO, Code::Protocol},        {EREMOTEIO, Code::Protocol},
                                        {ETIMEDOUT, Code::Timeout},   {EBUSY, Code::Busy},
                                        {ERANGE, Code::OutOfRange},   {EACCES, Code::Busy},
                                        {ENODEV, Code::Disconnected}, {ENXIO, Code::Disconnected}};
  for (const auto& [error, code] : cases) {
    kernel.nodes[kCoil].failing[VIDIOC_S_EXT_CTRLS] = error;
    const auto moved = device.lens->StartMove(Axis::Focus, Native{10});
    ASSERT_FALSE(moved.has_value()) << error;
    EXPECT_EQ(moved.error().code, code) << error;
    EXPECT_THAT(moved.error().message, HasSubstr(kCoil));
  }
  kernel.nodes[kCoil].failing.clear();
  EXPECT_EQ(Focus().position, Native{0});
  EXPECT_FALSE(Focus().moving);
}

TEST_F(V4l2Lens, RefusesNodesThatAreNoLens) {
  kernel.nodes[kCoil] = {};
  EXPECT_EQ(OpenOn(kernel, {.device = kCoil}, clock).error().code, Code::Unsupported);
  EXPECT_EQ(OpenOn(kernel, {.device = "/dev/video7"}, clock).error().code, Code::Disconnected);
  kernel.nodes[kCoil].controls[V4L2_CID_FOCUS_ABSOLUTE] = {.name = "Focus", .flags = V4L2_CTRL_FLAG_READ_ONLY};
  EXPECT_EQ(OpenOn(kernel, {.device = kCoil}, clock).error().code, Code::Unsupported);
  EXPECT_EQ(kernel.nodes[kCoil].opened, kernel.nodes[kCoil].closed);
}

// ---- the contract ----

template <class MakeNode>
class ScriptedStand : public contract::SteppedStand {
 public:
  ScriptedStand() { kernel_.nodes["/dev/node"] = MakeNode()(); }
  Result<drivers::Device> Open() override { return OpenOn(kernel_, MakeNode::Configured(), clock_); }
  bool Unplug() override { return kernel_.nodes["/dev/node"].gone = true; }
  void Plug() override { kernel_.nodes["/dev/node"].gone = false; }

 private:
  ScriptedKernel kernel_;
};
struct MakeCoil {
  ScriptedNode operator()() const { return CoilNode(); }
  static Config Configured() { return {.device = "/dev/node"}; }
};
struct MakeVideo {
  ScriptedNode operator()() const { return VideoNode(); }
  static Config Configured() { return {.device = "/dev/node"}; }
};
/// A bus that cannot read the chip back.
struct MakeSmbusChip {
  ScriptedNode operator()() const {
    ScriptedNode bus;
    bus.functions = I2C_FUNC_SMBUS_EMUL;
    bus.address = 0x0c;
    return bus;
  }
  static Config Configured() { return {.i2c_bus = "/dev/node", .chip = "dw9714"}; }
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(V4l2Coil, LensContract, contract::Stands<ScriptedStand<MakeCoil>>());
INSTANTIATE_TEST_SUITE_P(V4l2Video, LensContract, contract::Stands<ScriptedStand<MakeVideo>>());
INSTANTIATE_TEST_SUITE_P(V4l2Dw9714, LensContract, contract::Stands<ScriptedStand<MakeSmbusChip>>());

}  // namespace lensd::drivers::v4l2
