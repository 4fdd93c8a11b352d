// Devices that are unplugged and come back.
#include "daemon/lens/replug.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <random>
#include <thread>

#include "daemon/threads/growing_pauses.h"
#include "daemon/threads/retry.h"

namespace lensd::daemon {
namespace {

using namespace std::chrono_literals;
using drivers::Axis;

/// What is on the desk.
struct Desk {
  std::atomic<bool> plugged{true};
  std::atomic<int> opened{0}, tried{0}, closed{0};
  std::string serial = "1";
  std::atomic<bool> streaming{false};
  std::atomic<bool> garbled{false};
  std::atomic<bool> lame{false};   ///< its iris is left out
  std::atomic<bool> blind{false};  ///< its camera is left out
  std::atomic<bool> moving{false};
  std::atomic<int> stops{0};
};

class TestLens final : public drivers::Lens {
 public:
  explicit TestLens(std::shared_ptr<Desk> desk) : Lens(Can(*desk)), desk_(std::move(desk)) {}
  ~TestLens() override { ++desk_->closed; }

 private:
  static drivers::Capabilities Can(const Desk& desk) {
    drivers::Capabilities can{.driver = "test", .model = "test", .serial = desk.serial, .axes = {}};
    can.axes[Axis::Focus] = {.maximum = Native{100}, .can_home = true, .needs_home = true};
    if (!desk.lame) can.axes[Axis::Iris] = {.maximum = Native{100}};
    return can;
  }
  Result<void> Answer() const {
    if (!desk_->plugged) return Fail(Code::Disconnected, "unplugged");
    if (desk_->garbled) return Fail(Code::Protocol, "garbled");
    return {};
  }
  Result<void> DoStartHome(Axis) override { return Answer(); }
  Result<void> DoStartMove(Axis, Native) override { return Answer(); }
  Result<void> DoStop(Axis) override {
    ++desk_->stops;
    desk_->moving = false;
    return Answer();
  }
  Result<drivers::LensState> DoRead() override {
    if (auto answer = Answer(); !answer) return PassOn(answer);
    drivers::LensState state;
    state.axes[Axis::Focus] = drivers::AxisState{.moving = desk_->moving, .fault = {}};
    state.axes[Axis::Iris] = drivers::AxisState{.fault = {}};
    return state;
  }
  std::shared_ptr<Desk> desk_;
};

class TestCamera final : public drivers::Camera {
 public:
  explicit TestCamera(std::shared_ptr<Desk> desk)
      : Camera({.driver = "test", .model = "test", .serial = desk->serial, .focus_region = {}}),
        desk_(std::move(desk)) {
    desk_->streaming = false;
  }

 private:
  Result<void> DoStart() override {
    desk_->streaming = true;
    return {};
  }
  Result<void> DoStop() override {
    desk_->streaming = false;
    return {};
  }
  Result<std::optional<drivers::Frame>> DoPoll() override {
    if (!desk_->plugged) return Fail(Code::Disconnected, "unplugged");
    if (!desk_->streaming) return Fail(Code::InvalidArgument, "not streaming");
    return drivers::Frame{};
  }
  std::shared_ptr<Desk> desk_;
};

class ReplugTest : public ::testing::Test {
 protected:
  Result<drivers::Device> OpenAtDesk() {
    ++desk_->tried;
    if (!desk_->plugged) return Fail(Code::Disconnected, "no lens is plugged in");
    ++desk_->opened;
    drivers::Device device;
    device.lens = std::make_unique<TestLens>(desk_);
    if (!desk_->blind) device.camera = std::make_unique<TestCamera>(desk_);
    if (desk_->lame) device.findings.LeaveOut("iris", {Code::Protocol, "it limps"});
    if (desk_->blind) device.findings.LeaveOut("camera", {Code::Busy, "it is dark"});
    return device;
  }
  void Open(ComesBack comes_back = {}) {
    device_ = SurviveUnplugging(*OpenAtDesk(), [this] { return OpenAtDesk(); }, signal_, comes_back);
  }
  /// The device is gone, and comes back.
  void Replug() {
    desk_->plugged = false;
    EXPECT_EQ(ReadCode(), Code::Disconnected);
    desk_->plugged = true;
    signal_.Raise();
    EXPECT_TRUE(Eventually([&] { return device_.lens->Read().has_value(); }));
  }
  template <class Condition>
  static bool Eventually(Condition condition) {
    const auto until = std::chrono::steady_clock::now() + 60s;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > until) return false;
      std::this_thread::sleep_for(1ms);
    }
    return true;
  }
  Code ReadCode() {
    const auto read = device_.lens->Read();
    return read ? Code::Internal : read.error().code;
  }

  std::shared_ptr<Desk> desk_ = std::make_shared<Desk>();
  PlugSignal signal_;
  drivers::Device device_;
};

TEST_F(ReplugTest, WhatAProcessLeftMovingIsStoppedAndNothingElse) {
  for (const bool process : {false, true}) {
    for (const bool moving : {false, true}) {
      Open({.process = process});
      desk_->moving = moving;
      desk_->stops = 0;
      Replug();
      EXPECT_EQ(desk_->stops, process && moving ? 1 : 0);
      device_ = {};
    }
  }
}

TEST_F(ReplugTest, AnAxisIsHomedAsReadWhereItsReferenceComesBack) {
  for (const bool reference : {false, true}) {
    Open({.process = true, .reference = reference});
    Replug();
    const auto state = device_.lens->Read();
    ASSERT_TRUE(state.has_value());
    EXPECT_EQ(state->axes[Axis::Focus]->homed, reference);
    const auto moved = device_.lens->StartMove(Axis::Focus, Native{5.0});
    EXPECT_EQ(moved ? Code::Internal : moved.error().code, reference ? Code::Internal : Code::NotHomed);
    device_ = {};
  }
}

TEST(GrowingPauses, DoubleUpToTheLongestAndBeginAnewOnceADeviceHasWorked) {
  Instant now{std::chrono::hours(1)};
  GrowingPauses pauses(now);
  Duration expected{};
  for (int deaths = 0; deaths < 12; ++deaths) {
    now += GrowingPauses::kWorks - 1ns;
    EXPECT_EQ(pauses.Next(now), expected);
    pauses.Works(now);
    expected = expected == Duration{} ? Retry::kFirstPause : std::min<Duration>(2 * expected, Retry::kLongestPause);
  }
  EXPECT_EQ(expected, Retry::kLongestPause);
  now += GrowingPauses::kWorks;
  EXPECT_EQ(pauses.Next(now), Duration{});
  pauses.Works(now);
  EXPECT_EQ(pauses.Next(now), Retry::kFirstPause);
  // One that fails before anything works with it has not worked, however long the pause was.
  now += GrowingPauses::kWorks;
  EXPECT_EQ(pauses.Next(now), 2 * Retry::kFirstPause);
}

/// What was left out is not missed when the device comes back, whether it works by then or not.
TEST_F(ReplugTest, PartsThatWereLeftOutMayComeBackOrNot) {
  for (const bool mended : {false, true}) {
    desk_->plugged = desk_->lame = desk_->blind = true;
    Open();
    ASSERT_NE(device_.findings.Of("iris"), nullptr);
    EXPECT_EQ(device_.camera, nullptr);
    desk_->plugged = false;
    EXPECT_EQ(ReadCode(), Code::Disconnected);
    desk_->lame = desk_->blind = !mended;
    desk_->plugged = true;
    signal_.Raise();
    EXPECT_TRUE(Eventually([&] { return device_.lens->Read().has_value(); }));
    device_ = {};
  }
}

/// What worked is waited for, with the reason why it does not.
TEST_F(ReplugTest, PartsThatWorkedAreWaitedFor) {
  Open();
  desk_->plugged = false;
  EXPECT_EQ(ReadCode(), Code::Disconnected);
  desk_->lame = true;
  desk_->plugged = true;
  signal_.Raise();
  EXPECT_TRUE(Eventually([&] {
    const auto read = device_.lens->Read();
    return !read && read.error().message.find("it limps") != std::string::npos;
  }));
  desk_->lame = false;
  signal_.Raise();
  EXPECT_TRUE(Eventually([&] { return device_.lens->Read().has_value(); }));
}

TEST_F(ReplugTest, ADeviceThatStaysIsLeftAlone) {
  Open();
  EXPECT_TRUE(device_.lens->Read()->axes[Axis::Focus]->homed);
  EXPECT_TRUE(device_.lens->StartMove(Axis::Focus, Native{10}));
  EXPECT_EQ(device_.lens->capabilities().serial, "1");
  EXPECT_EQ(desk_->tried, 1);
}

TEST_F(ReplugTest, WhatWasCountedBeforeStaysCounted) {
  Open();
  const auto fail_twice = [&] {
    desk_->garbled = true;
    EXPECT_EQ(ReadCode(), Code::Protocol);
    EXPECT_FALSE(device_.lens->StartMove(Axis::Iris, Native{10}));
    desk_->garbled = false;
  };
  fail_twice();
  EXPECT_EQ(device_.lens->bus_errors(), 2u);
  desk_->plugged = false;
  EXPECT_EQ(ReadCode(), Code::Disconnected);
  EXPECT_EQ(device_.lens->bus_errors(), 2u) << "nobody there is no error of the bus";
  desk_->plugged = true;
  ASSERT_TRUE(Eventually([&] { return device_.lens->Read().has_value(); }));
  fail_twice();
  EXPECT_EQ(device_.lens->bus_errors(), 4u);
}

/// Frame numbers and times drawn at random, counted by a rule of its own.
TEST(FrameCounter, GapsInNumbersAreLossesAndGapsInTimeDelays) {
  std::mt19937 random(3);
  for (int round = 0; round < 200; ++round) {
    const double rate = std::uniform_real_distribution(1.0, 200.0)(random);
    drivers::FrameCounter counter(rate);
    std::uint64_t number = random() % 100, lost = 0, late = 0;
    const int frames = 1 + static_cast<int>(random() % 60);
    Instant at{1s};
    for (int i = 0; i < frames; ++i) {
      counter.Came(number, at);
      const std::uint64_t missing = random() % 5 == 0 ? random() % 4 : 0;
      const bool is_late = random() % 5 == 0;
      const double delay = is_late ? std::uniform_real_distribution(1.05, 3.0)(random)
                                   : std::uniform_real_distribution(0.0, 0.95)(random);
      number += missing + 1;
      at += std::chrono::duration_cast<Duration>(
          std::chrono::duration<double>((static_cast<double>(missing + 1) + delay) / rate));
      if (i + 1 == frames) break;  // what follows the last one nobody knows yet
      lost += missing;
      if (is_late) ++late;
    }
    const drivers::Counters counts = counter.counts();
    EXPECT_EQ(counts.frames, static_cast<std::uint64_t>(frames));
    EXPECT_EQ(counts.frames_lost, lost);
    EXPECT_EQ(counts.frames_late, late);
  }
}

TEST_F(ReplugTest, IsFoundAgainWithItsPositionUnknown) {
  Open();
  desk_->plugged = false;
  EXPECT_EQ(ReadCode(), Code::Disconnected);
  EXPECT_TRUE(Eventually([&] { return desk_->closed == 1; })) << "the dead handle must not be kept";
  EXPECT_EQ(device_.lens->StartMove(Axis::Focus, Native{10}).error().code, Code::Disconnected);
  EXPECT_EQ(device_.lens->Stop(Axis::Focus).error().code, Code::Disconnected);
  device_.lens->Interrupt();
  desk_->plugged = true;
  ASSERT_TRUE(Eventually([&] { return device_.lens->Read().has_value(); }));  // without a word from the kernel
  EXPECT_FALSE(device_.lens->Read()->axes[Axis::Focus]->homed);
  EXPECT_TRUE(device_.lens->Read()->axes[Axis::Iris]->homed);  // it cannot home: its own word is all there is
  EXPECT_EQ(device_.lens->StartMove(Axis::Focus, Native{10}).error().code, Code::NotHomed);
  EXPECT_TRUE(device_.lens->StartMove(Axis::Iris, Native{10}));
  EXPECT_TRUE(device_.lens->StartHome(Axis::Focus));
  EXPECT_TRUE(device_.lens->Read()->axes[Axis::Focus]->homed);
  EXPECT_TRUE(device_.lens->StartMove(Axis::Focus, Native{10}));
}

TEST_F(ReplugTest, ComesBackAgainAndAgain) {
  Open();
  for (int i = 0; i < 5; ++i) {
    desk_->plugged = false;
    EXPECT_EQ(ReadCode(), Code::Disconnected);
    desk_->plugged = true;
    signal_.Raise();
    ASSERT_TRUE(Eventually([&] { return device_.lens->Read().has_value(); }));
  }
  EXPECT_EQ(desk_->opened, 6);
}

TEST_F(ReplugTest, AnotherDeviceIsNotTakenForIt) {
  Open();
  desk_->plugged = false;
  EXPECT_EQ(ReadCode(), Code::Disconnected);
  desk_->serial = "2";
  desk_->plugged = true;
  const int tried = desk_->tried;
  ASSERT_TRUE(Eventually([&] { return desk_->tried > tried + 1; }));
  const auto read = device_.lens->Read();
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, Code::WrongDevice);
  EXPECT_NE(read.error().message.find("another device"), std::string::npos);
}

TEST_F(ReplugTest, ACameraThatStreamedStreamsAgain) {
  Open();
  ASSERT_TRUE(device_.camera->Start());
  desk_->plugged = false;
  EXPECT_EQ(device_.camera->Poll().error().code, Code::Disconnected);
  EXPECT_EQ(ReadCode(), Code::Disconnected);  // both hang on one plug
  desk_->plugged = true;
  ASSERT_TRUE(Eventually([&] { return device_.camera->Poll().has_value(); }));
  EXPECT_TRUE(desk_->streaming);
}

TEST_F(ReplugTest, IsDestroyedWhileItIsGone) {
  Open();
  desk_->plugged = false;
  EXPECT_EQ(ReadCode(), Code::Disconnected);
  device_ = {};
  EXPECT_EQ(desk_->closed, desk_->opened);
}

TEST(RetryTest, SomethingPluggedInEndsThePause) {
  PlugSignal signal;
  std::atomic<int> tries{0};
  std::atomic<bool> there{false};
  const auto eventually = [](auto condition) {
    for (int i = 0; i < 60'000 && !condition(); ++i) std::this_thread::sleep_for(1ms);
    return condition();
  };
  Retry retry(signal, [&] {
    ++tries;
    return there.load();
  });
  ASSERT_TRUE(eventually([&] { return tries >= 4; }));  // the pause is 2 s by now
  there = true;
  signal.Raise();
  ASSERT_TRUE(eventually([&] { return tries >= 5; }));
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(tries, 5) << "it goes on although it has what it wanted";
}

}  // namespace
}  // namespace lensd::daemon
