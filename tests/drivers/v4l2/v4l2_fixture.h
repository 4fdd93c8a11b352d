// Lenses on a scripted kernel.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "drivers/v4l2/driver.h"
#include "open.h"
#include "scripted_kernel.h"

namespace lensd::drivers::v4l2 {

using drivers::Axis;
using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

inline constexpr const char* kCoil = "/dev/v4l-subdev3";
inline constexpr const char* kVideo = "/dev/video0";
inline constexpr const char* kBus = "/dev/i2c-10";

/// A DW9714 behind the kernel's own driver (section 3).
inline ScriptedNode CoilNode() {
  ScriptedNode node;
  node.controls[V4L2_CID_FOCUS_ABSOLUTE] = {.name = "Focus, Absolute"};
  return node;
}

/// A camera that focuses by itself unless told otherwise.
inline ScriptedNode VideoNode() {
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

}  // namespace lensd::drivers::v4l2
