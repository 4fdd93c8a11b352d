// Lens controls, voice coils and the media graph, on a scripted kernel: no packaged kernel module has a lens
// sub-device, an ancillary link or a chip that can be read. Sections are those of the V4L2 lens fact sheet.
#include "drivers/v4l2/driver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "open.h"
#include "scripted_kernel.h"
#include "stand.h"

namespace lensd::v4l2 {
namespace {

using drivers::Axis;
using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kCoil = "/dev/v4l-subdev3";
constexpr const char* kVideo = "/dev/video0";
constexpr const char* kBus = "/dev/i2c-10";

/// A DW9714 behind the kernel's own driver (section 3).
ScriptedNode CoilNode() {
  ScriptedNode node;
  node.controls[V4L2_CID_FOCUS_ABSOLUTE] = {.name = "Focus, Absolute"};
  return node;
}

/// A camera that focuses by itself unless told otherwise.
ScriptedNode VideoNode() {
  ScriptedNode node;
  node.video = true;
  node.controls[V4L2_CID_FOCUS_ABSOLUTE] = {.name = "Focus, Absolute", .maximum = 250, .step = 5};
  node.controls[V4L2_CID_FOCUS_AUTO] = {
      .name = "Focus, Automatic Continuous", .maximum = 1, .value = 1, .type = V4L2_CTRL_TYPE_BOOLEAN};
  node.controls[V4L2_CID_IRIS_ABSOLUTE] = {
      .name = "Iris, Absolute", .minimum = 280, .maximum = 2200, .flags = V4L2_CTRL_FLAG_WRITE_ONLY, .value = 280};
  return node;
}

class V4l2Lens : public ::testing::Test {
 protected:
  void Open(const Config& config) {
    auto opened = OpenOn(kernel, config, clock);
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    device = std::move(*opened);
    ASSERT_NE(device.lens, nullptr);
  }
  void OpenCoil() {
    kernel.nodes[kCoil] = CoilNode();
    Open({.device = kCoil});
  }
  drivers::AxisState Focus() {
    const auto state = device.lens->Read();
    EXPECT_TRUE(state.has_value()) << state.error().message;
    return state ? *state->axes[Axis::Focus] : drivers::AxisState();
  }
  std::vector<std::int64_t> FocusWrites(const char* path) {
    std::vector<std::int64_t> values;
    for (const auto& [id, value] : kernel.nodes[path].writes) {
      if (id == V4L2_CID_FOCUS_ABSOLUTE) values.push_back(value);
    }
    return values;
  }

  ScriptedKernel kernel;
  SteppedClock clock;
  drivers::Device device;
};

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
  EXPECT_FALSE(can.feedback);
  EXPECT_EQ(can.settle, milliseconds(10));
  EXPECT_FALSE(device.lens->capabilities().axes[Axis::Iris].has_value());
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
  node.events.push_back(ControlChanged(V4L2_CID_FOCUS_AUTO, V4L2_EVENT_CTRL_CH_VALUE, 1));
  EXPECT_THAT(Focus().fault, HasSubstr("autofocus"));
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{50}).has_value());
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

// ---- the media graph (section 5) ----

media_v2_entity Entity(std::uint32_t id, const char* name, std::uint32_t function) {
  media_v2_entity entity{};
  entity.id = id;
  std::strncpy(entity.name, name, sizeof entity.name - 1);
  entity.function = function;
  return entity;
}
media_v2_interface SubdevInterface(std::uint32_t id, std::uint32_t minor) {
  media_v2_interface interface{};
  interface.id = id;
  interface.intf_type = MEDIA_INTF_T_V4L_SUBDEV;
  interface.devnode.major = 81;
  interface.devnode.minor = minor;
  return interface;
}
media_v2_link Link(std::uint32_t source, std::uint32_t sink, std::uint32_t kind) {
  media_v2_link link{};
  link.source_id = source;
  link.sink_id = sink;
  link.flags = kind;
  return link;
}

class MediaGraph : public V4l2Lens {
 protected:
  /// Two sensors, each with its lens.
  void SetUp() override {
    ScriptedNode& media = kernel.nodes["/dev/media0"];
    media.entities = {
        Entity(1, "imx219 10-0010", MEDIA_ENT_F_CAM_SENSOR), Entity(2, "dw9714 10-000c", MEDIA_ENT_F_LENS),
        Entity(3, "imx219 11-0010", MEDIA_ENT_F_CAM_SENSOR), Entity(4, "dw9714 11-000c", MEDIA_ENT_F_LENS)};
    media.interfaces = {SubdevInterface(100, 5), SubdevInterface(101, 6)};
    media.links = {Link(100, 2, MEDIA_LNK_FL_INTERFACE_LINK), Link(101, 4, MEDIA_LNK_FL_INTERFACE_LINK),
                   Link(1, 2, MEDIA_LNK_FL_ANCILLARY_LINK), Link(3, 4, MEDIA_LNK_FL_ANCILLARY_LINK)};
    kernel.texts["/sys/dev/char/81:5/uevent"] = "MAJOR=81\nMINOR=5\nDEVNAME=v4l-subdev3\n";
    kernel.texts["/sys/dev/char/81:6/uevent"] = "MAJOR=81\nMINOR=6\nDEVNAME=v4l-subdev4\n";
    kernel.nodes["/dev/v4l-subdev3"] = CoilNode();
    kernel.nodes["/dev/v4l-subdev4"] = CoilNode();
  }
  ScriptedNode& media() { return kernel.nodes["/dev/media0"]; }
};

TEST_F(MediaGraph, FindsTheLensOfEachSensor) {
  Open({.sensor = "imx219 11-0010"});
  EXPECT_EQ(kernel.nodes["/dev/v4l-subdev4"].opened, 1);
  EXPECT_EQ(kernel.nodes["/dev/v4l-subdev3"].opened, 0);
  Open({.sensor = "10-0010"});
  EXPECT_EQ(kernel.nodes["/dev/v4l-subdev3"].opened, 1);
  EXPECT_EQ(media().opened, media().closed);
}

TEST_F(MediaGraph, OlderKernelsHaveNoAncillaryLinks) {
  media().links.resize(2);
  const auto unclear = OpenOn(kernel, {.sensor = "imx219 10-0010"}, clock);
  ASSERT_FALSE(unclear.has_value());
  EXPECT_THAT(unclear.error().message, HasSubstr("knows no lens"));
  // With one of each it can only be that.
  media().entities.resize(2);
  Open({.sensor = "imx219"});
  EXPECT_EQ(kernel.nodes["/dev/v4l-subdev3"].opened, 1);
}

TEST_F(MediaGraph, SaysWhatThereIs) {
  auto failed = OpenOn(kernel, {.sensor = "ov5640"}, clock);
  ASSERT_FALSE(failed.has_value());
  EXPECT_EQ(failed.error().code, Code::Disconnected);
  EXPECT_THAT(failed.error().message, HasSubstr("imx219 11-0010"));
  failed = OpenOn(kernel, {.sensor = "imx219"}, clock);
  ASSERT_FALSE(failed.has_value());
  EXPECT_EQ(failed.error().code, Code::InvalidArgument);
  media().links.erase(media().links.begin());
  failed = OpenOn(kernel, {.sensor = "imx219 10-0010"}, clock);
  ASSERT_FALSE(failed.has_value());
  EXPECT_THAT(failed.error().message, HasSubstr("no device node"));
}

// ---- a voice coil on a bus (section 3) ----

class Dw9714 : public V4l2Lens {
 protected:
  void SetUp() override {
    ScriptedNode& bus = kernel.nodes[kBus];
    bus.functions = I2C_FUNC_I2C | I2C_FUNC_SMBUS_EMUL;
    bus.address = 0x0c;
    bus.answer = {0x12, 0x30};
  }
  static Config Configured() { return {.i2c_bus = kBus, .i2c_address = 0x0c, .chip = "dw9714"}; }
  ScriptedNode& bus() { return kernel.nodes[kBus]; }
};

/// Section 3: two bytes, big-endian, (code << 4) | S with S = 0.
TEST_F(Dw9714, Bytes) {
  Config config = Configured();
  config.axes[Axis::Focus].speed = 0.0;
  Open(config);
  for (const double code : {0.0, 1.0, 16.0, 512.0, 1023.0}) {
    ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{code}).has_value());
  }
  const std::vector<std::vector<std::uint8_t>> sent = {
      {0x00, 0x00}, {0x00, 0x10}, {0x01, 0x00}, {0x20, 0x00}, {0x3f, 0xf0}};
  EXPECT_EQ(bus().sent, sent);
}

TEST_F(Dw9714, ReadsTheCodeItHoldsAndWritesNothingWhenOpened) {
  Open(Configured());
  EXPECT_EQ(Focus().position, Native{0x123});
  EXPECT_TRUE(Focus().homed);
  EXPECT_TRUE(bus().sent.empty());
}

TEST_F(Dw9714, OnABusWithoutPlainTransfersItsPositionIsUnknownUntilCommanded) {
  bus().functions = I2C_FUNC_SMBUS_EMUL;
  Open(Configured());
  EXPECT_FALSE(Focus().homed);
  // From an unknown place there is no ramp.
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{512}).has_value());
  EXPECT_EQ(bus().sent.size(), 1u);
  EXPECT_TRUE(Focus().homed);
  EXPECT_EQ(Focus().position, Native{512});
}

TEST_F(Dw9714, RefusesABusWithoutTheChip) {
  Config config = Configured();
  config.i2c_address = 0x0d;
  EXPECT_EQ(OpenOn(kernel, config, clock).error().code, Code::Disconnected);
  bus().failing[I2C_SLAVE] = EBUSY;
  EXPECT_EQ(OpenOn(kernel, Configured(), clock).error().code, Code::Busy);
  bus().functions = 0;
  EXPECT_EQ(OpenOn(kernel, Configured(), clock).error().code, Code::Unsupported);
  EXPECT_EQ(bus().opened, bus().closed);
}

TEST_F(Dw9714, AChipThatStopsAnsweringIsDisconnected) {
  Open(Configured());
  bus().address = 0x55;
  EXPECT_EQ(device.lens->Read().error().code, Code::Disconnected);
  EXPECT_EQ(device.lens->StartMove(Axis::Focus, Native{5}).error().code, Code::Disconnected);
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

}  // namespace lensd::v4l2
