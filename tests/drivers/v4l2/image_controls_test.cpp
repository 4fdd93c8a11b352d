// Exposure and gain of a capture node on a scripted kernel: ranges as told, automatisms off first, and what the kernel
// makes of a value.
#include "image_controls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <utility>

#include "scripted_kernel.h"

namespace lensd::drivers::v4l2 {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

constexpr const char* kCamera = "/dev/video2";

/// Exposure 0.3 to 499.8 ms in steps of 0.5 ms, gain 16 to 250 in steps of 4, both automatic at first.
ScriptedNode CameraNode() {
  ScriptedNode node;
  node.controls[V4L2_CID_EXPOSURE_AUTO] = {
      .name = "Auto Exposure", .maximum = 3, .value = V4L2_EXPOSURE_APERTURE_PRIORITY, .type = V4L2_CTRL_TYPE_MENU};
  node.controls[V4L2_CID_EXPOSURE_ABSOLUTE] = {.name = "Exposure Time, Absolute",
                                               .minimum = 3,
                                               .maximum = 5000,
                                               .step = 5,
                                               .flags = V4L2_CTRL_FLAG_INACTIVE,
                                               .value = 33};
  node.controls[V4L2_CID_AUTOGAIN] = {
      .name = "Gain, Automatic", .maximum = 1, .value = 1, .type = V4L2_CTRL_TYPE_BOOLEAN};
  node.controls[V4L2_CID_GAIN] = {.name = "Gain", .minimum = 16, .maximum = 250, .step = 4, .value = 20};
  return node;
}

class V4l2Image : public ::testing::Test {
 protected:
  ScriptedNode& node() { return kernel_.nodes[kCamera]; }
  /// With the automatisms' keeper, which gives back what it took when it goes.
  ImageControls& Open(ScriptedNode scripted) {
    node() = std::move(scripted);
    auto opened = Node::Open(kernel_, kCamera);
    EXPECT_TRUE(opened.has_value());
    const auto shared = std::make_shared<const Node>(*std::move(opened));
    auto found = ImageControls::Find(shared, std::make_shared<Automatics>(shared), findings_);
    EXPECT_TRUE(found.has_value());
    controls_.emplace(*std::move(found));
    return *controls_;
  }

  ScriptedKernel kernel_;
  std::optional<ImageControls> controls_;
  drivers::Findings findings_;
};

TEST_F(V4l2Image, TellsItsRanges) {
  CameraCapabilities can;
  Open(CameraNode()).Describe(can);
  EXPECT_TRUE(can.can_set_exposure);
  EXPECT_EQ(can.shortest_exposure, microseconds(300));
  EXPECT_EQ(can.longest_exposure, microseconds(499'800));  // 5000 is between two steps
  EXPECT_EQ(can.exposure_step, microseconds(500));
  ASSERT_TRUE(can.gain.has_value());
  EXPECT_EQ(can.gain->lowest, 16.0);
  EXPECT_EQ(can.gain->highest, 248.0);
  EXPECT_EQ(can.gain->step, 4.0);
  EXPECT_EQ(can.gain->unit, GainUnit::Native);
}

TEST_F(V4l2Image, SetsBothAndGivesTheAutomatismsBack) {
  ImageControls& controls = Open(CameraNode());
  ASSERT_TRUE(controls.SetExposure(microseconds(8'100)).has_value());
  ASSERT_TRUE(controls.SetGain(101.0).has_value());
  EXPECT_THAT(node().writes,
              ElementsAre(Pair(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL), Pair(V4L2_CID_EXPOSURE_ABSOLUTE, 83),
                          Pair(V4L2_CID_AUTOGAIN, 0), Pair(V4L2_CID_GAIN, 100)));
  EXPECT_EQ(controls.exposure(), microseconds(8'300));
  node().controls[V4L2_CID_EXPOSURE_ABSOLUTE].flags = 0;
  const auto now = controls.Read();
  ASSERT_TRUE(now.has_value());
  EXPECT_EQ(now->exposure, microseconds(8'300));
  EXPECT_EQ(now->gain, 100.0);
  node().writes.clear();
  controls_.reset();
  EXPECT_THAT(node().writes,
              ElementsAre(Pair(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY), Pair(V4L2_CID_AUTOGAIN, 1)));
}

TEST_F(V4l2Image, WhatAnAutomatismKeepsToItselfIsNotTold) {
  ImageControls& controls = Open(CameraNode());
  EXPECT_EQ(controls.Read()->exposure, std::nullopt);
  EXPECT_EQ(controls.Read()->gain, 20.0);
  node().controls[V4L2_CID_EXPOSURE_ABSOLUTE].flags |= V4L2_CTRL_FLAG_VOLATILE;  // the driver asks its device
  EXPECT_EQ(controls.Read()->exposure, microseconds(3'300));
}

TEST_F(V4l2Image, ASensorsAnalogueGainWhereThereIsNoOther) {
  ScriptedNode sensor;
  sensor.controls[V4L2_CID_ANALOGUE_GAIN] = {.name = "Analogue Gain", .maximum = 240};
  ImageControls& controls = Open(std::move(sensor));
  CameraCapabilities can;
  controls.Describe(can);
  EXPECT_FALSE(can.can_set_exposure);
  EXPECT_EQ(controls.SetExposure(milliseconds(5)).error().code, Code::Unsupported);
  ASSERT_TRUE(controls.SetGain(240.0).has_value());
  EXPECT_THAT(node().writes, ElementsAre(Pair(V4L2_CID_ANALOGUE_GAIN, 240)));
}

TEST_F(V4l2Image, ACameraWithoutBoth) {
  ScriptedNode fixed;
  fixed.controls[V4L2_CID_GAIN] = {.name = "Gain", .flags = V4L2_CTRL_FLAG_READ_ONLY};
  ImageControls& controls = Open(std::move(fixed));
  CameraCapabilities can;
  controls.Describe(can);
  EXPECT_FALSE(can.gain.has_value());
  EXPECT_EQ(controls.SetGain(1.0).error().code, Code::Unsupported);
  EXPECT_EQ(controls.Read()->gain, std::nullopt);
  EXPECT_THAT(node().writes, IsEmpty());
}

TEST_F(V4l2Image, AnotherValueThanWasSetIsNotTakenForIt) {
  ScriptedNode stubborn = CameraNode();
  stubborn.controls[V4L2_CID_GAIN].applied = [](std::int64_t) { return 16; };
  stubborn.controls[V4L2_CID_EXPOSURE_ABSOLUTE].applied = [](std::int64_t) { return 333; };
  ImageControls& controls = Open(std::move(stubborn));
  const auto gain = controls.SetGain(100.0);
  ASSERT_FALSE(gain.has_value());
  EXPECT_EQ(gain.error().code, Code::OutOfRange);
  EXPECT_THAT(gain.error().message, ::testing::HasSubstr("16 instead of 100"));
  EXPECT_EQ(controls.SetExposure(milliseconds(8)).error().code, Code::OutOfRange);
  EXPECT_EQ(controls.exposure(), microseconds(33'300));  // what its frames have
  node().gone = true;
  EXPECT_EQ(controls.SetGain(100.0).error().code, Code::Disconnected);
}

}  // namespace
}  // namespace lensd::drivers::v4l2
