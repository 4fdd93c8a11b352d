// What is remembered of positions: before the motor turns, when it rests, and what a restart makes of it.
#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <string>

#include "tests/rig/policy_fixture.h"

namespace lensd::rig {
namespace {

/// Remembers in the test, and what it was told in which order.
struct Disk {
  PositionMemory::Axes axes;
  std::vector<std::string> told;
  bool full = false;
  bool stopped = false;  ///< a stop comes before it has written
  bool damaged = false;
};

class FakeMemory final : public PositionMemory {
 public:
  FakeMemory(std::shared_ptr<Disk> disk, std::shared_ptr<testing::FakeControls> controls)
      : disk_(std::move(disk)), controls_(std::move(controls)) {}
  Result<Axes> Load() override {
    if (disk_->damaged) return Fail(Code::BadData, "half a file");
    return disk_->axes;
  }
  Result<void> Save(const Axes& axes) override {
    if (disk_->stopped) return Fail(Code::Cancelled, "a stop came first");
    if (disk_->full) return Fail(Code::Io, "the disk is full");
    disk_->axes = axes;
    const AxisMemory& focus = *axes[Axis::Focus];
    disk_->told.push_back((focus.in_motion ? "moving after " : "resting after ") + std::to_string(controls_->moves));
    return {};
  }

 private:
  std::shared_ptr<Disk> disk_;
  std::shared_ptr<testing::FakeControls> controls_;
};

class MemoryTest : public PolicyTest {
 protected:
  void OpenWithMemory(double focus, RigConfig config = {}) {
    Open(std::move(config), focus, std::make_unique<FakeMemory>(disk_, controls_));
  }
  std::shared_ptr<Disk> disk_ = std::make_shared<Disk>();
};

TEST_F(MemoryTest, ItIsOnDiskBeforeTheMotorTurnsAndAgainBeforeTheAnswer) {
  OpenWithMemory(100);
  disk_->told.clear();
  bool resting_when_told = false;
  Answers<MoveOutcome> answers;
  rig_->Move(Axis::Focus, At(300), [&](Result<MoveOutcome> outcome) {
    resting_when_told = !disk_->axes[Axis::Focus]->in_motion;
    answers.all.push_back(std::move(outcome));
  });
  RunUntil(answers);
  ASSERT_TRUE(answers.only());
  EXPECT_EQ(disk_->told, (std::vector<std::string>{"moving after 0", "resting after 1"}));
  EXPECT_TRUE(resting_when_told);
  EXPECT_EQ(disk_->axes[Axis::Focus]->position.value, 300.0);
}

TEST_F(MemoryTest, WhatCannotBeRememberedDoesNotMove) {
  OpenWithMemory(100);
  disk_->full = true;
  const auto moved = Move(300);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, Code::NotKept);
  EXPECT_EQ(controls_->moves, 0);
}

TEST_F(MemoryTest, AStopThatDoesNotWaitForTheDiskCancels) {
  OpenWithMemory(100);
  disk_->stopped = true;
  const auto moved = Move(300);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, Code::Cancelled);
  EXPECT_EQ(controls_->moves, 0);
}

TEST_F(MemoryTest, ADiskThatFailsInMidMoveIsToldOfUntilItTakesWhereTheAxisRests) {
  OpenWithMemory(100);
  ASSERT_TRUE(Move(200));
  EXPECT_EQ(Move(300)->kept, true);
  Answers<MoveOutcome> answers;
  rig_->Move(Axis::Focus, At(900), answers.Take());
  Run(100ms);
  disk_->full = true;
  const Instant began = clock_.Now();
  RunUntil(answers);
  ASSERT_TRUE(answers.only());
  EXPECT_TRUE(answers.only()->reached);
  EXPECT_EQ(answers.only()->kept, false);
  EXPECT_NE(answers.only()->reason.find("the disk is full"), std::string::npos) << answers.only()->reason;
  EXPECT_NE(answers.only()->cause, MoveCause::None);
  const auto first = rig_->GetStatus().unkept;
  ASSERT_TRUE(first);
  EXPECT_GE(first->since, began);
  Run(5s);
  ASSERT_TRUE(rig_->GetStatus().unkept);
  EXPECT_EQ(rig_->GetStatus().unkept->since, first->since);
  EXPECT_TRUE(disk_->axes[Axis::Focus]->in_motion);
  disk_->full = false;
  Run(2s);
  EXPECT_FALSE(rig_->GetStatus().unkept);
  EXPECT_FALSE(disk_->axes[Axis::Focus]->in_motion);
  EXPECT_EQ(disk_->axes[Axis::Focus]->position.value, 900.0);
}

TEST_F(MemoryTest, WithoutAMemoryNothingIsSaidOfTheDisk) {
  Open({}, 100);
  const auto moved = Move(300);
  ASSERT_TRUE(moved);
  EXPECT_FALSE(moved->kept);
  EXPECT_FALSE(rig_->GetStatus().unkept);
}

TEST_F(MemoryTest, AStormCostsTheDiskLittle) {
  OpenWithMemory(100, WithBacklash(40));
  disk_->told.clear();
  for (int i = 0; i < 1000; ++i) {
    rig_->Move(Axis::Focus, At(i % 2 == 0 ? 900 : 200), [](const Result<MoveOutcome>&) {});
    Run(1ms);
  }
  EXPECT_LE(disk_->told.size(), 3u);
  Run(5s);
  EXPECT_FALSE(disk_->axes[Axis::Focus]->in_motion);
}

TEST_F(MemoryTest, AfterACrashInMidMoveNothingGoesBeforeHoming) {
  OpenWithMemory(100);
  rig_->Move(Axis::Focus, At(900), [](const Result<MoveOutcome>&) {});
  Run(200ms);
  const Disk at_the_crash = *disk_;
  rig_.reset();
  *disk_ = at_the_crash;
  OpenWithMemory(300);
  EXPECT_FALSE(FocusStatus().homed);
  EXPECT_FALSE(rig_->GetStatus().vergence);
  const auto refused = Move(500);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Code::NotHomed);
  // And it stays unknown over another start.
  rig_.reset();
  OpenWithMemory(300);
  EXPECT_FALSE(FocusStatus().homed);
  Answers<MoveOutcome> homed;
  rig_->Home(Axis::Focus, homed.Take());
  RunUntil(homed);
  ASSERT_TRUE(homed.only() && homed.only()->verified);
  EXPECT_TRUE(FocusStatus().homed);
  EXPECT_TRUE(Move(500));
}

TEST_F(MemoryTest, ADamagedFileMakesEveryPositionUnknown) {
  disk_->damaged = true;
  OpenWithMemory(300);
  EXPECT_FALSE(FocusStatus().homed);
}

struct RestoreCase {
  Restore policy;
  double device;      ///< what the device says at the start
  double remembered;  ///< at rest there, or the end of a motion from 200
  bool in_motion;
  std::optional<double> position;  ///< what the rig makes of it; nothing: unknown
};

TEST_F(MemoryTest, FourPolicies) {
  const RestoreCase cases[] = {
      // The device's word, unless it was in motion.
      {Restore::Never, 600, 600, false, 600},
      {Restore::Never, 0, 600, false, 0},
      {Restore::Never, 300, 600, false, 300},
      {Restore::Never, 400, 600, true, {}},
      // The memory's word, whatever the device says.
      {Restore::Always, 600, 600, false, 600},
      {Restore::Always, 0, 600, false, 600},
      {Restore::Always, 300, 600, false, 600},
      {Restore::Always, 400, 600, true, 400},
      {Restore::Always, 0, 600, true, 400},
      // The memory's word where the device has lost its own.
      {Restore::NearZero, 600, 600, false, 600},
      {Restore::NearZero, 1, 600, false, 600},
      {Restore::NearZero, 300, 600, false, 300},
      {Restore::NearZero, 0, 600, true, {}},
      {Restore::NearZero, 400, 600, true, {}},
      // Only what both can be right about.
      {Restore::Conditional, 600, 600, false, 600},
      {Restore::Conditional, 0, 600, false, 600},
      {Restore::Conditional, 300, 600, false, {}},
      {Restore::Conditional, 400, 600, true, 400},
      {Restore::Conditional, 800, 600, true, {}},
      {Restore::Conditional, 0, 600, true, {}},
  };
  for (const RestoreCase& c : cases) {
    SCOPED_TRACE(::testing::Message() << "policy " << static_cast<int>(c.policy) << ", device at " << c.device
                                      << (c.in_motion ? ", in motion" : ""));
    AxisMemory memory;
    memory.position = Native{c.in_motion ? 200 : c.remembered};
    memory.in_motion = c.in_motion;
    memory.lowest = Native{200};
    memory.highest = Native{c.remembered};
    disk_ = std::make_shared<Disk>();
    disk_->axes[Axis::Focus] = memory;
    RigConfig config;
    config.axes[Axis::Focus].restore = c.policy;
    OpenWithMemory(c.device, config);
    EXPECT_EQ(FocusStatus().homed, c.position.has_value());
    if (c.position) {
      EXPECT_EQ(FocusStatus().position.value, *c.position);
    }
    // Wherever it may be of what the motion swept is in the bound.
    if (c.policy == Restore::Always && c.in_motion) {
      EXPECT_GE(FocusStatus().bound.value, 400.0);
    }
    rig_.reset();
  }
}

TEST_F(MemoryTest, ARestoredPositionMovesByTheDevicesOwnCounts) {
  AxisMemory memory;
  memory.position = memory.lowest = memory.highest = Native{600};
  disk_->axes[Axis::Focus] = memory;
  RigConfig config;
  config.axes[Axis::Focus].restore = Restore::NearZero;
  OpenWithMemory(0, config);
  EXPECT_EQ(rig_->SoftLimits(Axis::Focus).first.value, 600.0) << "the device counts on from 0 only";
  const auto moved = Move(650);
  ASSERT_TRUE(moved && moved->verified);
  EXPECT_EQ(moved->position.value, 650.0);
  EXPECT_EQ(controls_->focus_targets, (std::vector<double>{50}));
  Answers<MoveOutcome> homed;
  rig_->Home(Axis::Focus, homed.Take());
  RunUntil(homed);
  EXPECT_EQ(Focus(), 0.0);
  EXPECT_EQ(rig_->SoftLimits(Axis::Focus).first.value, 0.0);
}

}  // namespace
}  // namespace lensd::rig
