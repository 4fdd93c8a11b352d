// What needs no camera: time stamps on our clock, and the configuration.
#include <gtest/gtest.h>

#include "config.h"
#include "device_clock.h"
#include "lens_names.h"

namespace lensd::drivers::aravis {
namespace {

using namespace std::chrono_literals;

constexpr Instant kEpoch{};

TEST(DeviceClock, WithoutALatchTheExposureEndsAtArrivalAtTheLatest) {
  DeviceClock clock(StampMeaning::ExposureStart);
  const auto interval = clock.IntervalOf(123, kEpoch + 100ms, 10ms, 16ms);
  EXPECT_EQ(interval.end, kEpoch + 100ms);
  EXPECT_EQ(interval.start, kEpoch + 74ms);
}

TEST(DeviceClock, ALatchPlacesTheStamp) {
  // The camera's clock reads 5 s when ours reads 1 s at the least.
  const std::uint64_t five_s = 5'000'000'000;
  DeviceClock start(StampMeaning::ExposureStart);
  start.Latched(five_s, kEpoch + 1s);
  const auto a = start.IntervalOf(five_s + 500'000'000, kEpoch + 1600ms, 10ms, 16ms);
  EXPECT_EQ(a.start, kEpoch + 1500ms);
  EXPECT_EQ(a.end, kEpoch + 1510ms);
  DeviceClock end(StampMeaning::ExposureEnd);
  end.Latched(five_s, kEpoch + 1s);
  const auto b = end.IntervalOf(five_s + 500'000'000, kEpoch + 1600ms, 10ms, 16ms);
  EXPECT_EQ(b.start, kEpoch + 1490ms);
  EXPECT_EQ(b.end, kEpoch + 1500ms);
}

TEST(DeviceClock, NoFrameArrivesBeforeItsEnd) {
  DeviceClock clock(StampMeaning::ExposureStart);
  clock.Latched(0, kEpoch);
  // By the stamp it would end at 1.01 s, but it came at 1 s: the clocks have drifted apart.
  const auto interval = clock.IntervalOf(1'000'000'000, kEpoch + 1s, 10ms, 16ms);
  EXPECT_EQ(interval.end, kEpoch + 1s);
  EXPECT_EQ(interval.start, kEpoch + 990ms);
}

TEST(DeviceClock, ForgetsAfterARestart) {
  DeviceClock clock(StampMeaning::ExposureStart);
  clock.Latched(0, kEpoch);
  clock.Forget();
  EXPECT_FALSE(clock.known());
  EXPECT_EQ(clock.IntervalOf(7, kEpoch + 1s, 10ms, 0ms).end, kEpoch + 1s);
}

Settings TableOf(std::initializer_list<std::pair<const char*, Settings::Value>> keys) {
  Settings::Table table;
  for (const auto& [key, value] : keys) table.emplace(key, Settings(value, {"test.toml", 3}));
  return Settings(Settings::Value(std::in_place_type<Settings::Table>, std::move(table)), {"test.toml", 1});
}

std::string WhyNot(std::initializer_list<std::pair<const char*, Settings::Value>> keys) {
  const auto read = ReadDriverConfig(TableOf(keys));
  if (read) return "";
  EXPECT_EQ(read.error().code, Code::BadData);
  return read.error().message;
}

TEST(Config, NamesOneCamera) {
  EXPECT_EQ(WhyNot({{"serial", std::string("X")}}), "");
  EXPECT_NE(WhyNot({}).find("exactly one of serial, address and id"), std::string::npos);
  EXPECT_NE(WhyNot({{"serial", std::string("X")}, {"address", std::string("10.0.0.1")}}).find("exactly one"),
            std::string::npos);
}

TEST(Config, RefusesWhatItDoesNotKnow) {
  EXPECT_NE(WhyNot({{"serial", std::string("X")}, {"pixel_format", std::string("YUV")}}).find("test.toml:3"),
            std::string::npos);
  EXPECT_NE(WhyNot({{"serial", std::string("X")}, {"shutter", 3.0}}).find("shutter"), std::string::npos);
  EXPECT_NE(WhyNot({{"serial", std::string("X")}, {"packet_size", std::int64_t{100}}}).find("packet_size"),
            std::string::npos);
}

TEST(LensNames, EntriesOfSeveralVendorsMeanReady) {
  EXPECT_EQ(ConditionOf("Ready"), Condition::Ready);
  EXPECT_EQ(ConditionOf("NotBusy"), Condition::Ready);
  EXPECT_EQ(ConditionOf("Busy"), Condition::Busy);
  EXPECT_EQ(ConditionOf("NotInitialized"), Condition::NotInitialized);
  EXPECT_EQ(ConditionOf("Calibrating"), Condition::Unknown);
  EXPECT_EQ(FaultOf(Condition::Ready), "");
  EXPECT_NE(FaultOf(Condition::NotConnected), "");
}

}  // namespace
}  // namespace lensd::drivers::aravis
