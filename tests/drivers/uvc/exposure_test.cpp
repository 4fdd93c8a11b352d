// Exposure and gain, byte for byte (UVC 1.1 sections 4.2.2.1.4 and 4.2.2.3).
#include <chrono>

#include "bytes_fixture.h"

namespace lensd::drivers::uvc {
namespace {

TEST_F(UvcBytes, Section2ExposureInUnitsOf100us) {
  VideoFunction function;
  function.streams.push_back({1, {{1, PixelFormat::Yuyv, 1, 0, {{1, 64, 48, 333333, {333333}, false}}}}, {}});
  Begin(1u << 3 | 1u << 1, function);
  wire_->ExpectIn("A1 86 00 04 00 01 01 00", "03");
  wire_->ExpectIn("A1 82 00 04 00 01 04 00", "01 00 00 00");
  wire_->ExpectIn("A1 83 00 04 00 01 04 00", "10 27 00 00");
  wire_->ExpectIn("A1 84 00 04 00 01 04 00", "01 00 00 00");
  wire_->ExpectIn("A1 81 00 04 00 01 04 00", "64 00 00 00");
  auto camera = UvcCamera::Open(session_, {}, findings_);
  ASSERT_TRUE(camera.has_value()) << camera.error().message;
  const CameraCapabilities& can = (*camera)->capabilities();
  EXPECT_TRUE(can.can_set_exposure);
  EXPECT_EQ(can.shortest_exposure, std::chrono::microseconds(100));
  EXPECT_EQ(can.longest_exposure, std::chrono::seconds(1));
  EXPECT_EQ(can.exposure_step, std::chrono::microseconds(100));
  EXPECT_FALSE(can.gain.has_value());
  EXPECT_EQ((*camera)->SetGain(1.0).error().code, Code::Unsupported);
  wire_->ExpectIn("A1 81 00 02 00 01 01 00", "08");
  wire_->ExpectIn("A1 84 00 02 00 01 01 00", "0F");
  wire_->ExpectOut("21 01 00 02 00 01 01 00", "01");
  wire_->ExpectOut("21 01 00 04 00 01 04 00", "FA 00 00 00");
  EXPECT_TRUE((*camera)->SetExposure(std::chrono::milliseconds(25)).has_value());
  const auto too_long = (*camera)->SetExposure(std::chrono::seconds(2));  // without a word on the wire
  ASSERT_FALSE(too_long.has_value());
  EXPECT_EQ(too_long.error().code, Code::OutOfRange);
  EXPECT_EQ(too_long.error().facts->minimum, 0.1);
  EXPECT_EQ(too_long.error().facts->maximum, 1000.0);
  wire_->ExpectOut("21 01 00 02 00 01 01 00", "08");
  camera->reset();
  session_.reset();
}

/// Section 4.2.2.3.4: selector 4 of a processing unit, two bytes.
TEST_F(UvcBytes, GainOfTheProcessingUnitThatTheTerminalFeeds) {
  VideoFunction function;
  function.streams.push_back({1, {{1, PixelFormat::Yuyv, 1, 0, {{1, 64, 48, 333333, {333333}, false}}}}, {}});
  function.units = {{5, 9, 1u << 9}, {6, 1, 0}, {7, 1, 1u << 9}};
  Begin(0, function);
  wire_->ExpectIn("A1 86 00 04 00 07 01 00", "03");
  wire_->ExpectIn("A1 82 00 04 00 07 02 00", "10 00");
  wire_->ExpectIn("A1 83 00 04 00 07 02 00", "00 01");
  wire_->ExpectIn("A1 84 00 04 00 07 02 00", "08 00");
  wire_->ExpectIn("A1 81 00 04 00 07 02 00", "20 00");
  auto camera = UvcCamera::Open(session_, {}, findings_);
  ASSERT_TRUE(camera.has_value()) << camera.error().message;
  const auto gain = (*camera)->capabilities().gain;
  ASSERT_TRUE(gain.has_value());
  EXPECT_EQ(gain->lowest, 16.0);
  EXPECT_EQ(gain->highest, 256.0);
  EXPECT_EQ(gain->step, 8.0);
  wire_->ExpectOut("21 01 00 04 00 07 02 00", "68 00");  // 104 is the step nearest to 101
  EXPECT_TRUE((*camera)->SetGain(101.0).has_value());
  wire_->ExpectIn("A1 81 00 04 00 07 02 00", "68 00");
  const auto now = (*camera)->ReadExposure();
  ASSERT_TRUE(now.has_value());
  EXPECT_EQ(now->gain, 104.0);
  EXPECT_EQ(now->exposure, std::nullopt);
  EXPECT_EQ((*camera)->SetGain(257.0).error().code, Code::OutOfRange);
  EXPECT_EQ((*camera)->SetGain(15.0).error().code, Code::OutOfRange);
  wire_->ExpectFailing("21 01 00 04 00 07 02 00", "10 00", Reply::Outcome::Stalled);
  wire_->ExpectIn("A1 81 00 02 00 00 01 00", "02");
  EXPECT_EQ((*camera)->SetGain(16.0).error().code, Code::Busy);  // wrong state: it is set to automatic
}

TEST_F(UvcBytes, AGainThatCannotBeSetOrDoesNotTellItsRangeIsNone) {
  for (const bool tells : {false, true}) {
    VideoFunction function;
    function.streams.push_back({1, {{1, PixelFormat::Yuyv, 1, 0, {{1, 64, 48, 333333, {333333}, false}}}}, {}});
    function.units = {{2, 1, 1u << 9}};
    Begin(0, function);
    wire_->ExpectIn("A1 86 00 04 00 02 01 00", tells ? "01" : "03");
    const auto answer = [&](const char* setup, const char* data) {
      tells ? wire_->ExpectIn(setup, data) : wire_->ExpectFailing(setup, "", Reply::Outcome::Stalled);
    };
    answer("A1 82 00 04 00 02 02 00", "00 00");
    answer("A1 83 00 04 00 02 02 00", "64 00");
    answer("A1 84 00 04 00 02 02 00", "01 00");
    answer("A1 81 00 04 00 02 02 00", "00 00");
    auto camera = UvcCamera::Open(session_, {}, findings_);
    ASSERT_TRUE(camera.has_value()) << camera.error().message;
    EXPECT_FALSE((*camera)->capabilities().gain.has_value());
    EXPECT_NE(findings_.Of("gain"), nullptr);
    camera->reset();
    session_.reset();
  }
}

}  // namespace
}  // namespace lensd::drivers::uvc
