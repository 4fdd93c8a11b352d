// The media graph, and a voice coil on a bus, on a scripted kernel. Sections are those of the V4L2 lens fact sheet.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "v4l2_fixture.h"

namespace lensd::drivers::v4l2 {
namespace {

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

}  // namespace
}  // namespace lensd::drivers::v4l2
