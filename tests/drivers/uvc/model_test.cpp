// The driver on the simulated camera, on a wire without time: the contract, and what a stepped clock can show of
// streams.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "frame_assembler.h"
#include "model_in_process.h"
#include "model_transport.h"
#include "stand.h"

namespace lensd::drivers::uvc {
namespace {

using sim::devices::StreamFaults;
using sim::devices::UvcModel;
using sim::devices::UvcOptions;

class ModelStand : public contract::SteppedStand {
 public:
  explicit ModelStand(const UvcOptions& options, Feedback feedback = Feedback::Echo, int bits = 8) {
    sim::Scene scene = *SmallScene();
    scene.camera.bits = bits;
    model_ = UvcModel::Create(std::make_shared<const sim::Scene>(std::move(scene)), clock_, options).value();
    config_.lens_config.feedback = feedback;
    config_.lens_config.focus_travel = std::chrono::milliseconds(600);
  }
  Result<Device> Open() override {
    transport_ = std::make_shared<ModelTransport>(clock_, *model_);
    transport_->SetUnplugged(unplugged_);
    return OpenOnModel(transport_, *model_, clock_, config_);
  }
  void Advance(Duration by) override {
    // In small steps, so that no frame is missed.
    for (const Instant end = clock_.Now() + by; clock_.Now() < end;) {
      clock_.Advance(std::min<Duration>(std::chrono::milliseconds(5), end - clock_.Now()));
      if (transport_) transport_->Pump();
    }
  }
  bool Unplug() override {
    unplugged_ = true;
    transport_->SetUnplugged(true);
    return true;
  }
  void Plug() override {
    unplugged_ = false;
    model_->Reset();
  }

  UvcModel& model() { return *model_; }
  ModelTransport& transport() { return *transport_; }
  UvcConfig config_;

 private:
  std::unique_ptr<UvcModel> model_;
  std::shared_ptr<ModelTransport> transport_;
  bool unplugged_ = false;
};

struct FeedbackStand : ModelStand {
  FeedbackStand() : ModelStand({}, Feedback::Counts) {}
};
struct EchoStand : ModelStand {
  EchoStand() : ModelStand({.echo = true}) {}
};
struct AsynchronousStand : ModelStand {
  AsynchronousStand() : ModelStand({.asynchronous = true, .echo = true}) {}
};
struct RelativeStand : ModelStand {
  RelativeStand() : ModelStand({.relative_only = true}) {}
};
struct MjpegStand : ModelStand {
  MjpegStand() : ModelStand({.isochronous = true}) { config_.camera_config.format = PixelFormat::Mjpeg; }
};

struct UvcInProcess final : contract::ModelInProcess {
  UvcInProcess() : ModelInProcess("uvc-model-driver", "uvc") {}
};

class UvcModelTest : public ::testing::Test {
 protected:
  ModelStand& Begin() {
    device_ = {};
    stand_ = std::make_unique<ModelStand>(UvcOptions{});
    return *stand_;
  }
  void Open(ModelStand& stand) {
    auto opened = stand.Open();
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    device_ = *std::move(opened);
  }
  std::optional<Frame> Next(ModelStand& stand) {
    for (int i = 0; i < 200; ++i) {
      stand.Advance(std::chrono::milliseconds(5));
      auto frame = device_.camera->Poll();
      EXPECT_TRUE(frame.has_value());
      if (!frame || *frame) return frame ? *frame : std::nullopt;
    }
    return std::nullopt;
  }
  std::unique_ptr<ModelStand> stand_;
  Device device_;
};

/// The whole way to the picture: ten decibels of the camera's count (tenths) are 3.16 times the light of the well.
TEST_F(UvcModelTest, GainLiftsThePicture) {
  ModelStand& stand = Begin();
  Open(stand);
  ASSERT_TRUE(device_.camera->capabilities().gain.has_value());
  ASSERT_TRUE(device_.camera->SetExposure(std::chrono::milliseconds(2)).has_value());
  ASSERT_TRUE(device_.camera->Start().has_value());
  const auto mean = [&] {
    std::optional<Frame> frame;
    for (int i = 0; i < 4; ++i) frame = Next(stand);  // those that were under way are over
    EXPECT_TRUE(frame.has_value());
    double sum = 0.0;
    for (const std::uint16_t sample : *frame->samples) sum += sample;
    return sum / static_cast<double>(frame->samples->size());
  };
  const double plain = mean();
  ASSERT_TRUE(device_.camera->SetGain(100.0).has_value());
  EXPECT_EQ(device_.camera->ReadExposure()->gain, 100.0);
  EXPECT_NEAR(mean() / plain, std::sqrt(10.0), 0.05 * std::sqrt(10.0));
}

TEST_F(UvcModelTest, AutomaticsAreOffWhileOpenAndRestored) {
  ModelStand& stand = Begin();
  EXPECT_TRUE(stand.model().auto_focus());
  EXPECT_EQ(stand.model().ae_mode(), kAeAuto);
  Open(stand);
  EXPECT_FALSE(stand.model().auto_focus());
  EXPECT_EQ(stand.model().ae_mode(), kAeAperturePriority);
  ASSERT_TRUE(device_.camera->SetExposure(std::chrono::milliseconds(5)).has_value());
  EXPECT_EQ(stand.model().ae_mode(), kAeManual);
  device_.lens.reset();
  EXPECT_FALSE(stand.model().auto_focus()) << "the camera still uses the device";
  device_.camera.reset();
  EXPECT_TRUE(stand.model().auto_focus());
  EXPECT_EQ(stand.model().ae_mode(), kAeAuto);
}

TEST_F(UvcModelTest, FramesAreThePixelsThatWereSent) {
  for (const auto format : {PixelFormat::Yuyv, PixelFormat::Mjpeg}) {
    ModelStand& stand = Begin();
    stand.config_.camera_config.format = format;
    Open(stand);
    // Near the wall, where its pattern is sharp.
    ASSERT_TRUE(device_.lens->StartMove(Axis::Focus, Native{410.0}).has_value());
    stand.Advance(std::chrono::seconds(1));
    ASSERT_TRUE(device_.camera->Start().has_value());
    const auto frame = Next(stand);
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->gamma, 1.0) << "the colour descriptor says linear";
    // The sinusoid of period 8 px across, white at 0: bright and dark columns where they belong.
    const auto& samples = *frame->samples;
    double at_peak = 0.0, at_trough = 0.0;
    for (int y = 0; y < frame->height; ++y) {
      for (int x = 0; x < frame->width; x += 8) at_peak += samples[static_cast<std::size_t>(y * frame->width + x)];
      for (int x = 4; x < frame->width; x += 8) at_trough += samples[static_cast<std::size_t>(y * frame->width + x)];
    }
    EXPECT_GT(at_peak, 1.05 * at_trough);
  }
}

/// What is sent in words is read in words: as many levels as bits, and the brightness of the 8-bit picture.
TEST_F(UvcModelTest, LuminanceOf10To16BitsIsReadInFull) {
  const auto mean = [](const Frame& frame) {
    double sum = 0.0;
    for (const std::uint16_t sample : *frame.samples) sum += sample;
    return sum / static_cast<double>(frame.samples->size()) / std::ldexp(1.0, frame.bits);
  };
  ModelStand& plain = Begin();
  plain.config_.camera_config.format = PixelFormat::Yuyv;
  Open(plain);
  ASSERT_TRUE(device_.camera->Start().has_value());
  const auto eight = Next(plain);
  ASSERT_TRUE(eight.has_value());
  for (const int bits : {10, 12, 16}) {
    device_ = {};
    stand_ = std::make_unique<ModelStand>(UvcOptions{.grey_bits = bits}, Feedback::Counts, bits);
    Open(*stand_);  // by itself it takes what has most bits
    EXPECT_EQ(device_.camera->capabilities().bits, bits);
    ASSERT_TRUE(device_.camera->Start().has_value());
    const auto frame = Next(*stand_);
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->bits, bits);
    ASSERT_EQ(frame->samples->size(), 32u * 24u);
    EXPECT_NEAR(mean(*frame), mean(*eight), 0.01) << bits;
    EXPECT_LT(*std::ranges::max_element(*frame->samples), 1 << bits);
    EXPECT_TRUE(std::ranges::any_of(*frame->samples, [](int sample) { return sample % 4 != 0; }))
        << "8 bits in disguise";
  }
}

/// The camera before the grey scene sends neutral chroma.
TEST_F(UvcModelTest, PicturesHaveColourWhereTheirFormatDoes) {
  for (const PixelFormat format : {PixelFormat::Yuyv, PixelFormat::Mjpeg}) {
    device_ = {};
    ModelStand& stand = Begin();
    stand.config_.camera_config.format = format;
    Open(stand);
    EXPECT_TRUE(device_.camera->capabilities().colour);
    ASSERT_TRUE(device_.camera->Start().has_value());
    const auto frame = Next(stand);
    ASSERT_TRUE(frame && frame->colour);
    const auto colour = frame->colour();
    ASSERT_TRUE(colour);
    ASSERT_EQ(colour->size(), 3 * frame->samples->size());
    for (std::size_t i = 0; i < colour->size(); ++i) ASSERT_NEAR((*colour)[i], (*frame->samples)[i / 3], 2.0) << i;
  }
  device_ = {};
  stand_ = std::make_unique<ModelStand>(UvcOptions{.grey_bits = 10}, Feedback::Counts, 1);
  Open(*stand_);
  EXPECT_FALSE(device_.camera->capabilities().colour);
}

TEST_F(UvcModelTest, DamagedPicturesAreDroppedWholeAndCounted) {
  ModelStand& stand = Begin();
  stand.config_.camera_config.format = PixelFormat::Yuyv;
  Open(stand);
  ASSERT_TRUE(device_.camera->Start().has_value());
  auto last = Next(stand);
  ASSERT_TRUE(last.has_value());
  const StreamFaults faults[] = {{.flagged = 1}, {.dropped = 1}, {.garbled = 1}};
  for (const StreamFaults& fault : faults) {
    stand.transport().stream().faults() = fault;
    auto frame = Next(stand);
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->samples->size(), last->samples->size());
    last = frame;
  }
  EXPECT_EQ(device_.camera->counters().frames_lost, std::size(faults));
  EXPECT_EQ(device_.camera->counters().frames_damaged, std::size(faults) - 1) << "what is never sent did not come";
  EXPECT_EQ(device_.camera->unusable().count, 0) << "the last one was whole";
  EXPECT_EQ(device_.camera->counters().bus_errors, 0u);
}

TEST_F(UvcModelTest, ADeadStreamIsATimeout) {
  ModelStand& stand = Begin();
  Open(stand);
  ASSERT_TRUE(device_.camera->Start().has_value());
  stand.transport().stream().faults().flagged = 1 << 30;
  std::optional<Code> code;
  for (int i = 0; i < 2000 && !code; ++i) {
    stand.Advance(std::chrono::milliseconds(5));
    const auto frame = device_.camera->Poll();
    if (!frame) code = frame.error().code;
  }
  EXPECT_EQ(code, Code::Timeout);
  EXPECT_GT(device_.camera->unusable().count, 10);
  EXPECT_EQ(device_.camera->unusable().why, "damaged: a part of it was lost on its way");
}

TEST(UvcFrameAssembler, OnlyWholePicturesInOrder) {
  SteppedClock clock;
  FrameAssembler frames(clock, PixelFormat::Yuyv, 4);
  const auto send = [&](std::initializer_list<int> bytes) {
    std::vector<std::uint8_t> payload;
    for (const int byte : bytes) payload.push_back(static_cast<std::uint8_t>(byte));
    frames.OnPayload(payload);
  };
  send({2, 0x80, 1, 2});
  send({2, 0x82, 3, 4});
  EXPECT_FALSE(frames.Take()) << "the first may have begun before we listened";
  send({2, 0x81, 5, 6});
  EXPECT_FALSE(frames.Take());
  send({2, 0x83, 7, 8});
  auto frame = frames.Take();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->bytes, (std::vector<std::uint8_t>{5, 6, 7, 8}));
  EXPECT_EQ(frame->sequence, 1u);
  EXPECT_FALSE(frames.Take()) << "handed out once";
  send({2, 0x80, 1, 2});
  send({2, 0x81, 1, 2});  // the end of the one before is lost
  send({2, 0x83, 3, 4});
  frame = frames.Take();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->sequence, 3u);
  send({2, 0xC2, 1, 2, 3, 4});     // error bit
  send({2, 0x83, 1, 2, 3, 4, 5});  // too much
  send({2, 0x80, 1, 2});
  frames.OnLoss();
  send({2, 0x82, 3, 4});
  EXPECT_FALSE(frames.Take());
  send({2, 0x81, 1, 2, 3, 4});  // its end is shown by the next one's beginning
  EXPECT_FALSE(frames.Take());
  send({12, 0x80, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2});
  EXPECT_TRUE(frames.Take());
  send({});
  send({1});
  send({2, 0x82, 3, 4});
  EXPECT_FALSE(frames.Take()) << "a payload of this picture could not be read";
}

}  // namespace

INSTANTIATE_TEST_SUITE_P(UvcFeedback, LensContract, contract::Stands<FeedbackStand>());
INSTANTIATE_TEST_SUITE_P(UvcEcho, LensContract, contract::Stands<EchoStand>());
INSTANTIATE_TEST_SUITE_P(UvcAsynchronous, LensContract, contract::Stands<AsynchronousStand>());
INSTANTIATE_TEST_SUITE_P(UvcRelative, LensContract, contract::Stands<RelativeStand>());
INSTANTIATE_TEST_SUITE_P(UvcInProcess, LensContract, contract::Stands<UvcInProcess>());
INSTANTIATE_TEST_SUITE_P(UvcInProcess, CameraContract, contract::Stands<UvcInProcess>());
INSTANTIATE_TEST_SUITE_P(UvcBulk, CameraContract, contract::Stands<FeedbackStand>());
INSTANTIATE_TEST_SUITE_P(UvcMjpeg, CameraContract, contract::Stands<MjpegStand>());

}  // namespace lensd::drivers::uvc
