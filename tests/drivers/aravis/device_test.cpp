// The driver against the simulated camera where the contract suite does not look.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "aravis_camera.h"
#include "gige_stand.h"

namespace lensd {
namespace {

using drivers::Axis;
using testing::GigeStand;
using namespace std::chrono_literals;

using Keys = std::map<std::string, Settings::Value>;

std::optional<drivers::Frame> NextFrame(drivers::Camera& camera, Duration patience = 10s) {
  const Instant deadline = std::chrono::steady_clock::now() + patience;
  while (std::chrono::steady_clock::now() < deadline) {
    auto polled = camera.Poll();
    if (polled && *polled) return *std::move(polled);
    std::this_thread::sleep_for(1ms);
  }
  return std::nullopt;
}

bool Rests(drivers::Lens& lens, Axis axis, Native target, double within) {
  const Instant deadline = std::chrono::steady_clock::now() + 10s;
  while (std::chrono::steady_clock::now() < deadline) {
    const auto state = lens.Read();
    if (state && !state->axes[axis]->moving && std::abs((state->axes[axis]->position - target).value) <= within) {
      return true;
    }
    std::this_thread::sleep_for(2ms);
  }
  return false;
}

double MeanOf(const drivers::Frame& frame) {
  double sum = 0.0;
  for (const std::uint16_t sample : *frame.samples) sum += sample;
  return sum / static_cast<double>(frame.samples->size()) / (std::ldexp(1.0, frame.bits) - 1.0);
}

double RoughnessOf(const drivers::Frame& frame) {
  double sum = 0.0;
  for (std::size_t i = 1; i < frame.samples->size(); ++i)
    sum += std::abs((*frame.samples)[i] - (*frame.samples)[i - 1]);
  return sum / static_cast<double>(frame.samples->size());
}

drivers::Device OpenOrFail(GigeStand& stand) {
  auto device = stand.Open();
  EXPECT_TRUE(device.has_value()) << device.error().message;
  return device ? *std::move(device) : drivers::Device{};
}

TEST(AravisDevice, EveryPixelFormatShowsTheSamePicture) {
  std::optional<double> mean;
  for (const char* format : {"Mono8", "Mono10", "Mono12", "Mono12Packed", "Mono12p", "Mono16", "BayerRG8", "RGB8"}) {
    SCOPED_TRACE(format);
    GigeStand stand({}, {{"pixel_format", std::string(format)}});
    auto device = OpenOrFail(stand);
    ASSERT_NE(device.camera, nullptr);
    ASSERT_TRUE(device.camera->Start().has_value());
    const auto frame = NextFrame(*device.camera);
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->bits, device.camera->capabilities().bits);
    ASSERT_EQ(frame->colour != nullptr, device.camera->capabilities().colour);
    EXPECT_EQ(frame->colour != nullptr, std::string_view(format).starts_with("Mono") == false);
    if (frame->colour) {  // the scene is grey
      const auto colour = frame->colour();
      ASSERT_TRUE(colour);
      ASSERT_EQ(colour->size(), 3 * frame->samples->size());
      for (std::size_t i = 0; i < frame->samples->size(); ++i) {
        const double weighed = (*colour)[3 * i] + 2.0 * (*colour)[3 * i + 1] + (*colour)[3 * i + 2];
        ASSERT_NEAR(weighed / 4.0, (*frame->samples)[i], 1.0) << i;
      }
    }
    if (!mean) mean = MeanOf(*frame);
    EXPECT_NEAR(MeanOf(*frame), *mean, 0.01);
  }
}

TEST(AravisDevice, FramesShowWhereTheLensStood) {
  GigeStand stand;
  auto device = OpenOrFail(stand);
  ASSERT_NE(device.lens, nullptr);
  const auto look = [&](double steps, double f_number) {
    EXPECT_TRUE(device.lens->StartMove(Axis::Focus, Native{steps}).has_value());
    EXPECT_TRUE(device.lens->StartMove(Axis::Iris, Native{f_number}).has_value());
    EXPECT_TRUE(Rests(*device.lens, Axis::Focus, Native{steps}, 1.0));
    EXPECT_TRUE(Rests(*device.lens, Axis::Iris, Native{f_number}, 0.02));
    std::this_thread::sleep_for(20ms);  // the simulated lens settles
    const Instant arrived = std::chrono::steady_clock::now();
    EXPECT_TRUE(device.camera->Start().has_value());
    auto frame = NextFrame(*device.camera);
    while (frame && frame->exposure_start < arrived) frame = NextFrame(*device.camera);
    EXPECT_TRUE(device.camera->Stop().has_value());
    return frame.value();
  };
  // e = f^2/(Z - f) = 0.5319 mm at 1.2 m: step 1330 of 4000 over 1.6 mm, counted from near as the standard has it.
  const double sharp = RoughnessOf(look(4000 - 1330, 2.0)), blurred = RoughnessOf(look(0, 2.0));
  EXPECT_GT(sharp, 2.0 * blurred);
  // Light goes with 1/N^2.
  const double wide = MeanOf(look(4000 - 1330, 2.0)), narrow = MeanOf(look(4000 - 1330, 4.0));
  EXPECT_NEAR(wide / narrow, 4.0, 0.1);
}

TEST(AravisDevice, ExposureGainAndRegionAreObeyed) {
  GigeStand stand({}, {{"exposure_ms", 2.0},
                       {"gain", 6.0},
                       {"region_px", Settings::Array{Settings(std::int64_t{8}, {}), Settings(std::int64_t{16}, {}),
                                                     Settings(std::int64_t{64}, {}), Settings(std::int64_t{32}, {})}}});
  auto device = OpenOrFail(stand);
  ASSERT_NE(device.camera, nullptr);
  EXPECT_EQ(device.camera->capabilities().width, 64);
  EXPECT_EQ(device.camera->capabilities().height, 32);
  EXPECT_DOUBLE_EQ(device.camera->capabilities().pixel_um, 3.45);
  ASSERT_TRUE(device.camera->Start().has_value());
  const auto frame = NextFrame(*device.camera);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->exposure_end - frame->exposure_start, 2ms);
  ASSERT_TRUE(device.camera->SetExposure(1ms).has_value());
  const auto refused = device.camera->SetExposure(1h);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, Code::OutOfRange);
  std::this_thread::sleep_for(300ms);
  std::optional<drivers::Frame> shorter;
  for (int i = 0; i < 3; ++i) shorter = NextFrame(*device.camera);
  ASSERT_TRUE(shorter.has_value());
  EXPECT_EQ(shorter->exposure_end - shorter->exposure_start, 1ms);
  EXPECT_NEAR(MeanOf(*shorter) / MeanOf(*frame), 0.5, 0.1);
}

TEST(AravisDevice, SoftwareTriggerExposesWhenAsked) {
  GigeStand stand({}, {{"trigger", std::string("Software")}});
  auto device = OpenOrFail(stand);
  ASSERT_NE(device.camera, nullptr);
  EXPECT_EQ(device.camera->capabilities().frame_rate_hz, 0.0);
  ASSERT_TRUE(device.camera->Start().has_value());
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(NextFrame(*device.camera).has_value());
}

TEST(AravisDevice, LostPacketsAreCountedAndNoFrameIsTorn) {
  GigeStand stand({.lost_packets = 0.05}, {{"resend", false}, {"packet_size", std::int64_t{1500}}});
  auto device = OpenOrFail(stand);
  ASSERT_NE(device.camera, nullptr);
  ASSERT_TRUE(device.camera->Start().has_value());
  std::uint64_t last = 0;
  bool gap = false;
  for (int i = 0; i < 20; ++i) {
    const auto frame = NextFrame(*device.camera);
    ASSERT_TRUE(frame.has_value());
    gap = gap || (last != 0 && frame->sequence > last + 1);
    last = frame->sequence;
  }
  EXPECT_TRUE(gap);
  std::this_thread::sleep_for(1500ms);  // packets are counted every second
  const auto counts = device.camera->counters();
  EXPECT_GE(counts.frames, 20u);
  EXPECT_GT(counts.frames_lost, 0u);
  EXPECT_GT(counts.packets_lost, 0u);
}

TEST(AravisDevice, MovesAreRefusedBeforeInitialisation) {
  GigeStand stand({.needs_initialize = true});
  auto device = OpenOrFail(stand);
  ASSERT_NE(device.lens, nullptr);
  EXPECT_TRUE(device.lens->capabilities().axes[Axis::Focus]->needs_home);
  const auto before = device.lens->Read();
  ASSERT_TRUE(before.has_value());
  EXPECT_FALSE(before->axes[Axis::Focus]->homed);
  const auto refused = device.lens->StartMove(Axis::Focus, Native{100});
  ASSERT_FALSE(refused.has_value());
  EXPECT_NE(refused.error().message.find("home"), std::string::npos);
  ASSERT_TRUE(device.lens->StartHome(Axis::Focus).has_value());
  EXPECT_TRUE(Rests(*device.lens, Axis::Focus, Native{4000}, 1.0)) << "its reference is its far end";
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{100}).has_value());
  EXPECT_TRUE(Rests(*device.lens, Axis::Focus, Native{100}, 1.0));
}

TEST(AravisDevice, VendorsNamesAreFound) {
  {
    GigeStand stand({.names = "allied-vision"});
    auto device = OpenOrFail(stand);
    ASSERT_NE(device.lens, nullptr);
    EXPECT_EQ(device.lens->capabilities().axes[Axis::Iris]->unit, drivers::NativeUnit::FNumber);
    EXPECT_FALSE(device.lens->capabilities().axes[Axis::Focus]->can_stop);
    ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{2000}).has_value());
    EXPECT_TRUE(Rests(*device.lens, Axis::Focus, Native{2000}, 1.0));
  }
  GigeStand stand({.names = "imaging-source"});
  auto device = OpenOrFail(stand);
  ASSERT_NE(device.lens, nullptr);
  EXPECT_EQ(device.lens->capabilities().axes[Axis::Focus]->feedback, drivers::Feedback::None);
  EXPECT_FALSE(device.lens->capabilities().axes[Axis::Focus]->can_home);
}

TEST(AravisDevice, FocusCountsAsTheStandardHasItAndOfOtherNamesNobodySays) {
  using drivers::Direction;
  for (const auto& [names, says] : {std::pair("sfnc", true), std::pair("basler", true),
                                    std::pair("allied-vision", false), std::pair("imaging-source", false)}) {
    GigeStand stand({.names = names});
    auto device = OpenOrFail(stand);
    ASSERT_NE(device.lens, nullptr);
    const auto& direction = device.lens->capabilities().axes[Axis::Focus]->direction;
    ASSERT_EQ(direction.has_value(), says) << names;
    if (!says) continue;
    EXPECT_EQ(direction->direction, Direction::NearNegative);
    EXPECT_EQ(direction->by, "the GenICam standard (SFNC)");
    // SFNC 2.7.1, 23.4.21: 0 is the closest focus.
    ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{0}).has_value());
    EXPECT_TRUE(Rests(*device.lens, Axis::Focus, Native{0}, 1.0));
    EXPECT_NEAR(stand.camera().TrueFocus(), 4000.0, 1.0) << "steps from the far end";
  }
}

TEST(AravisDevice, AbortIsUsedWhereThereIsNoStatus) {
  GigeStand stand({.names = "sfnc-abort"});
  auto device = OpenOrFail(stand);
  ASSERT_NE(device.lens, nullptr);
  ASSERT_TRUE(device.lens->capabilities().axes[Axis::Focus]->can_stop);
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{0}).has_value());
  std::this_thread::sleep_for(50ms);
  ASSERT_TRUE(device.lens->Stop(Axis::Focus).has_value());
  std::this_thread::sleep_for(300ms);
  EXPECT_LT(stand.camera().TrueFocus(), 3900.0);
}

TEST(AravisDevice, NamesCanBeOverridden) {
  {
    GigeStand stand({}, {{"focus_feature", std::string("none")}});
    auto device = OpenOrFail(stand);
    ASSERT_NE(device.lens, nullptr);
    EXPECT_FALSE(device.lens->capabilities().axes[Axis::Focus].has_value());
    EXPECT_TRUE(device.lens->capabilities().axes[Axis::Iris].has_value());
  }
  {
    GigeStand stand({}, {{"focus_feature", std::string("GainRaw")}, {"status_feature", std::string("none")}});
    auto device = OpenOrFail(stand);
    ASSERT_NE(device.lens, nullptr);
    EXPECT_EQ(device.lens->capabilities().axes[Axis::Focus]->maximum, Native{24});
  }
  GigeStand stand({}, {{"iris_feature", std::string("Diaphragm")}});
  const auto device = stand.Open();
  ASSERT_FALSE(device.has_value());
  EXPECT_EQ(device.error().code, Code::Unsupported);
  EXPECT_NE(device.error().message.find("iris_feature \"Diaphragm\""), std::string::npos);
}

TEST(AravisDevice, ASecondProgramIsRefused) {
  GigeStand stand;
  auto first = OpenOrFail(stand);
  const auto second = stand.Open();
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code, Code::Busy) << second.error().message;
  EXPECT_TRUE(first.lens->Read().has_value());
}

TEST(AravisDevice, ComesBackByItselfAndStreamsAgain) {
  GigeStand stand;
  auto device = OpenOrFail(stand);
  ASSERT_NE(device.camera, nullptr);
  ASSERT_TRUE(device.camera->Start().has_value());
  ASSERT_TRUE(NextFrame(*device.camera).has_value());
  stand.Unplug();
  const Instant gone = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() < gone + 20s) {
    const auto polled = device.camera->Poll();
    if (!polled && polled.error().code == Code::Disconnected) break;
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(CodeOf(device.camera->Poll()), Code::Disconnected);
  stand.Plug();
  EXPECT_TRUE(NextFrame(*device.camera, 10s).has_value()) << "no frame within 10 s of its return";
  ASSERT_TRUE(device.lens->StartMove(Axis::Focus, Native{100}).has_value());
  EXPECT_TRUE(Rests(*device.lens, Axis::Focus, Native{100}, 1.0));
}

TEST(AravisDevice, AnotherCameraAtItsAddressIsLeftAloneAndNamed) {
  GigeStand stand({.serial = "ONE"});
  auto device = OpenOrFail(stand);
  ASSERT_NE(device.lens, nullptr);
  stand.Unplug();
  stand.PlugAnother("TWO");
  std::string said;
  for (const Instant end = std::chrono::steady_clock::now() + 20s; std::chrono::steady_clock::now() < end;) {
    const auto read = device.lens->Read();
    if (!read) said = read.error().message;
    if (said.find("TWO") != std::string::npos) break;
    std::this_thread::sleep_for(20ms);
  }
  EXPECT_NE(said.find("another camera answers"), std::string::npos) << said;
  EXPECT_NE(said.find("TWO instead of"), std::string::npos) << said;
  EXPECT_EQ(CodeOf(device.lens->StartMove(Axis::Focus, Native{100})), Code::WrongDevice);
  stand.Unplug();
  stand.PlugAnother("ONE");
  const Instant end = std::chrono::steady_clock::now() + 20s;
  while (!device.lens->Read() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(20ms);
  EXPECT_TRUE(device.lens->Read().has_value());
}

TEST(AravisDevice, ASearchFindsIt) {
  GigeStand stand({.serial = "PROBE7"});
  const auto found = drivers::aravis::ProbeAravis();
  ASSERT_TRUE(found.has_value());
  const auto is_ours = [](const drivers::FoundDevice& device) { return device.serial == "PROBE7"; };
  EXPECT_EQ(std::ranges::count_if(*found, is_ours), 1);
}

}  // namespace
}  // namespace lensd
