// What every camera promises, whatever drives it.
#include <algorithm>

#include "open_files.h"
#include "stand.h"

namespace lensd {

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CameraContract);

TEST_P(CameraContract, SaysWhatItIs) {
  const drivers::CameraCapabilities& can = camera().capabilities();
  EXPECT_NE(can.driver, "");
  EXPECT_NE(can.model, "");
  EXPECT_GT(can.width, 0);
  EXPECT_GT(can.height, 0);
  EXPECT_GE(can.bits, 8);
  EXPECT_LE(can.bits, 16);
  EXPECT_GE(can.pixel_um, 0.0);
  EXPECT_GE(can.frame_rate_hz, 0.0);
  const drivers::Region& region = can.focus_region;
  EXPECT_TRUE(region.x >= 0.0 && region.y >= 0.0 && region.width > 0.0 && region.height > 0.0);
  EXPECT_TRUE(region.x + region.width <= 1.0 && region.y + region.height <= 1.0);
}

TEST_P(CameraContract, StreamsOnlyBetweenStartAndStop) {
  EXPECT_EQ(CodeOf(camera().Poll()), Code::InvalidArgument);
  ASSERT_TRUE(camera().Stop().has_value());
  auto started = camera().Start();
  ASSERT_TRUE(started.has_value()) << started.error().message;
  EXPECT_TRUE(camera().Start().has_value());
  EXPECT_TRUE(Next().has_value());
  ASSERT_TRUE(camera().Stop().has_value());
  EXPECT_TRUE(camera().Stop().has_value());
  EXPECT_EQ(CodeOf(camera().Poll()), Code::InvalidArgument);
  started = camera().Start();
  ASSERT_TRUE(started.has_value()) << started.error().message;
  EXPECT_TRUE(Next().has_value());
}

TEST_P(CameraContract, FramesAreWhatTheyClaim) {
  const Instant before = stand_->clock().Now();
  ASSERT_TRUE(camera().Start().has_value());
  std::optional<drivers::Frame> last;
  for (int i = 0; i < 5; ++i) {
    const auto frame = Next();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->width, camera().capabilities().width);
    EXPECT_EQ(frame->height, camera().capabilities().height);
    EXPECT_EQ(frame->bits, camera().capabilities().bits);
    EXPECT_GT(frame->gamma, 0.0);
    ASSERT_NE(frame->samples, nullptr);
    ASSERT_EQ(frame->samples->size(), static_cast<std::size_t>(frame->width) * static_cast<std::size_t>(frame->height));
    EXPECT_LE(*std::ranges::max_element(*frame->samples), (1 << frame->bits) - 1);
    EXPECT_LE(frame->exposure_start, frame->exposure_end);
    EXPECT_LE(frame->exposure_end, stand_->clock().Now());
    if (last) {
      EXPECT_GT(frame->sequence, last->sequence);
      EXPECT_GT(frame->exposure_start, last->exposure_start);
    } else {
      EXPECT_GE(frame->exposure_end, before);
    }
    last = frame;
  }
}

TEST_P(CameraContract, SetsTheExposureOrSaysItCannot) {
  EXPECT_EQ(CodeOf(camera().SetExposure(Duration::zero())), Code::OutOfRange);
  const auto set = camera().SetExposure(std::chrono::milliseconds(5));
  if (!camera().capabilities().can_set_exposure) {
    EXPECT_EQ(CodeOf(set), Code::Unsupported);
    return;
  }
  ASSERT_TRUE(set.has_value()) << set.error().message;
  const auto now = camera().ReadExposure();
  ASSERT_TRUE(now.has_value()) << now.error().message;
  ASSERT_TRUE(now->exposure.has_value());
  EXPECT_NEAR(static_cast<double>(now->exposure->count()), 5e6, 1e5);
  ASSERT_TRUE(camera().Start().has_value());
  EXPECT_TRUE(Next().has_value());
}

TEST_P(CameraContract, SetsTheGainOrSaysItCannot) {
  const auto& gain = camera().capabilities().gain;
  if (!gain) {
    EXPECT_EQ(CodeOf(camera().SetGain(1.0)), Code::Unsupported);
    return;
  }
  const double middle = 0.5 * (gain->lowest + gain->highest);
  const auto set = camera().SetGain(middle);
  ASSERT_TRUE(set.has_value()) << set.error().message;
  const auto now = camera().ReadExposure();
  ASSERT_TRUE(now.has_value()) << now.error().message;
  ASSERT_TRUE(now->gain.has_value());
  EXPECT_NEAR(*now->gain, middle, 0.5);
  EXPECT_EQ(CodeOf(camera().SetGain(gain->highest + 1.0)), Code::OutOfRange);
  EXPECT_EQ(CodeOf(camera().SetGain(gain->lowest - 1.0)), Code::OutOfRange);
}

TEST_P(CameraContract, IsDestroyedWhileStreamingAndReopensWithoutLeaks) {
  ASSERT_TRUE(camera().Start().has_value());
  EXPECT_TRUE(Next().has_value());
  Close();
  const int open_files = testing::OpenFiles();
  for (int i = 0; i < 3; ++i) {
    ASSERT_NO_FATAL_FAILURE(Open());
    const auto started = camera().Start();
    ASSERT_TRUE(started.has_value()) << started.error().message;
    EXPECT_TRUE(Next().has_value());
    Close();
  }
  EXPECT_EQ(testing::OpenFiles(), open_files);
}

TEST_P(CameraContract, UnpluggedWhileStreamingIsDisconnected) {
  ASSERT_TRUE(camera().Start().has_value());
  EXPECT_TRUE(Next().has_value());
  if (!stand_->Unplug()) GTEST_SKIP() << "this stand cannot unplug its device";
  EXPECT_TRUE(Until([&] {
    const auto frame = camera().Poll();
    return !frame && frame.error().code == Code::Disconnected;
  })) << "Poll() never said Disconnected";
  EXPECT_EQ(CodeOf(camera().Poll()), Code::Disconnected);
  Close();
  stand_->Plug();
  ASSERT_NO_FATAL_FAILURE(Open());
  ASSERT_TRUE(camera().Start().has_value());
  EXPECT_TRUE(Next().has_value());
}

TEST_P(CameraContract, TheLensMovesWhileItStreams) {
  if (!device_.lens || !device_.lens->capabilities().axes[drivers::Axis::Focus]) {
    GTEST_SKIP() << "a camera without a focus";
  }
  const auto& can = *lens().capabilities().axes[drivers::Axis::Focus];
  if (can.needs_home) GTEST_SKIP() << "a focus to be homed first";
  ASSERT_TRUE(camera().Start().has_value());
  EXPECT_TRUE(Next().has_value());
  const auto moved = lens().StartMove(drivers::Axis::Focus, can.maximum);
  ASSERT_TRUE(moved.has_value()) << moved.error().message;
  EXPECT_TRUE(Next().has_value());
  EXPECT_TRUE(lens().Read().has_value());
  EXPECT_TRUE(Next().has_value());
}

}  // namespace lensd
