// Autofocus and frames through a rig: what is promised about them whatever happens on the way.
#include <chrono>

#include "autofocus/session.h"
#include "rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

class RigAutofocusTest : public RigTest {
 protected:
  Answers<AutofocusOutcome> Autofocus(AutofocusRequest request = {}) {
    Answers<AutofocusOutcome> answers;
    rig_->Autofocus(
        std::move(request), [this](const AutofocusProgress& now) { progress_.push_back(now); }, answers.Take());
    RunUntil(answers);
    return answers;
  }
  std::vector<AutofocusProgress> progress_;
};

TEST_F(RigAutofocusTest, FindsTheSubject) {
  Open();
  const auto answers = Autofocus();
  ASSERT_TRUE(answers.only());
  const AutofocusOutcome& outcome = *answers.only();
  EXPECT_TRUE(outcome.focused) << outcome.reason;
  EXPECT_NEAR(outcome.position.value, 600.0, 5.0);
  EXPECT_EQ(Focus(), outcome.position.value);
  EXPECT_NEAR(outcome.vergence->value, 0.6e-3 / (0.025 * 0.0256), 0.01);
  EXPECT_GT(outcome.sigma->value, 0.0);
  EXPECT_EQ(outcome.frames, static_cast<int>(progress_.size()));
  EXPECT_EQ(outcome.moves, controls_->moves);
  // A camera that only loses contrast is not what blur does: the sweep has to take over from the optics.
  EXPECT_EQ(outcome.method, "sweep");
  EXPECT_GE(progress_.at(8).frames_expected, progress_.back().frames - 8);
}

TEST_F(RigAutofocusTest, WorksInNativeUnitsWithoutOptics) {
  auto device = testing::MakeFakeDevice(clock_, controls_);
  device.optics.reset();
  rig_ = *Rig::Create({}, std::move(device), clock_);
  const auto answers = Autofocus();
  ASSERT_TRUE(answers.only());
  EXPECT_TRUE(answers.only()->focused) << answers.only()->reason;
  EXPECT_NEAR(answers.only()->position.value, 600.0, 5.0);
  EXPECT_FALSE(answers.only()->vergence);
}

TEST_F(RigAutofocusTest, RefusesABlankWallAndGoesBack) {
  Open({}, 321);
  controls_->contrast = 0.0;
  const auto answers = Autofocus();
  ASSERT_TRUE(answers.only());
  EXPECT_FALSE(answers.only()->focused);
  EXPECT_NE(answers.only()->reason, "");
  EXPECT_NEAR(Focus(), 321.0, 1.0);
}

TEST_F(RigAutofocusTest, RefusesASubjectBeyondTheRangeAndGoesBack) {
  Open({}, 321);
  controls_->sharp_at = 1100.0;
  const auto answers = Autofocus();
  ASSERT_TRUE(answers.only());
  EXPECT_FALSE(answers.only()->focused);
  EXPECT_NEAR(Focus(), 321.0, 1.0);
}

TEST_F(RigAutofocusTest, TheDeadlineFollowsTheTravel) {
  constexpr double kSpeed = 40.0;  // 25 s from end to end
  controls_->speed = kSpeed;
  RigConfig config;
  config.axes[Axis::Focus].speed = kSpeed;
  Open(config);
  const auto answers = Autofocus();
  ASSERT_TRUE(answers.only());
  EXPECT_TRUE(answers.only()->focused) << answers.only()->reason;
  EXPECT_NEAR(answers.only()->position.value, 600.0, 5.0);
  EXPECT_GT(answers.only()->elapsed, 25s);
}

TEST_F(RigAutofocusTest, TheDeadlineHolds) {
  Open({}, 321);
  controls_->speed = 100.0;
  AutofocusRequest request;
  request.deadline = 2s;
  const auto answers = Autofocus(request);
  ASSERT_TRUE(answers.only());
  EXPECT_FALSE(answers.only()->focused);
  EXPECT_NE(answers.only()->reason.find("deadline"), std::string::npos);
  EXPECT_NEAR(Focus(), 321.0, 1.0);
  // Two seconds of search, then the way back with its take-up.
  EXPECT_LE(answers.only()->elapsed, 2s + 4s);
}

TEST_F(RigAutofocusTest, ADarkCameraEndsIt) {
  Open({}, 321);
  controls_->dark = true;
  EXPECT_EQ(Autofocus().only().error().code, Code::Timeout);
}

TEST_F(RigAutofocusTest, AStallInTheMiddleIsARefusal) {
  Open({}, 321);
  Answers<AutofocusOutcome> answers;
  rig_->Autofocus({}, nullptr, answers.Take());
  Run(1s);
  controls_->stalled = true;
  RunUntil(answers);
  ASSERT_TRUE(answers.only());
  EXPECT_FALSE(answers.only()->focused);
  EXPECT_NE(answers.only()->reason.find("could not be brought back"), std::string::npos) << answers.only()->reason;
}

TEST_F(RigAutofocusTest, StopMoveAndUnpluggingEndItOnce) {
  for (const Code code : {Code::Cancelled, Code::Superseded, Code::Disconnected}) {
    Open();
    controls_->disconnected = false;
    Answers<AutofocusOutcome> answers;
    rig_->Autofocus({}, nullptr, answers.Take());
    Run(777ms);
    Answers<void> stopped;
    Answers<MoveOutcome> moved;
    if (code == Code::Cancelled) rig_->Stop({}, stopped.Take());
    if (code == Code::Superseded) rig_->Move(Axis::Iris, At(10), moved.Take());
    if (code == Code::Disconnected) controls_->disconnected = true;
    Run(3s);
    ASSERT_FALSE(answers.only());
    EXPECT_EQ(answers.only().error().code, code);
    EXPECT_EQ(rig_->GetStatus().activity.kind, Activity::Kind::Idle);
    EXPECT_FALSE(rig_->GetStatus().streaming);
  }
}

TEST_F(RigAutofocusTest, ANewRunDisplacesTheOldOne) {
  Open();
  Answers<AutofocusOutcome> first, second;
  rig_->Autofocus({}, nullptr, first.Take());
  Run(500ms);
  rig_->Autofocus({}, nullptr, second.Take());
  RunUntil(second);
  EXPECT_EQ(first.only().error().code, Code::Superseded);
  ASSERT_TRUE(second.only());
  EXPECT_TRUE(second.only()->focused);
}

TEST_F(RigAutofocusTest, WhatMakesNoSenseIsRefusedAtOnce) {
  Open();
  AutofocusRequest unknown;
  unknown.method = "guess";
  EXPECT_EQ(Autofocus(unknown).only().error().code, Code::InvalidArgument);
  AutofocusRequest outside;
  outside.regions = {{0.9, 0.9, 0.2, 0.2}};
  EXPECT_EQ(Autofocus(outside).only().error().code, Code::InvalidArgument);
  AutofocusRequest tiny;
  tiny.regions = {{0.5, 0.5, 0.05, 0.05}};
  EXPECT_EQ(Autofocus(tiny).only().error().code, Code::InvalidArgument);
  auto blind = testing::MakeFakeDevice(clock_, controls_);
  blind.camera.reset();
  rig_ = *Rig::Create({}, std::move(blind), clock_);
  EXPECT_EQ(Autofocus().only().error().code, Code::Unsupported);
}

TEST_F(RigAutofocusTest, TheCameraStreamsOnlyWhileSomebodyLooks) {
  Open();
  ASSERT_TRUE(Autofocus().only());
  EXPECT_EQ(controls_->camera_starts, 1);
  Run(10ms);
  EXPECT_FALSE(rig_->GetStatus().streaming);
}

TEST_F(RigAutofocusTest, ASnapshotWaitsForTheLensAndKnowsIt) {
  RigConfig config;
  config.axes[Axis::Focus].settle = 30ms;
  Open(config);
  Answers<MoveOutcome> moved;
  Answers<LensedFrame> picture;
  rig_->Move(Axis::Focus, At(400), moved.Take());
  Run(10ms);
  const Instant asked = clock_.Now();
  rig_->Snapshot(picture.Take());
  RunUntil(picture);
  ASSERT_TRUE(picture.only());
  EXPECT_EQ(moved.all.size(), 1u);
  const LensedFrame& taken = *picture.only();
  // 300 steps at 1000 a second from the command, then 30 ms of settling.
  EXPECT_GE(taken.frame.exposure_start, asked + 290ms + 30ms);
  EXPECT_EQ(taken.axes[Axis::Focus]->lowest.value, 400.0);
  EXPECT_EQ(taken.axes[Axis::Focus]->highest.value, 400.0);
  EXPECT_FALSE(taken.axes[Axis::Focus]->moving);
  EXPECT_NEAR(taken.extension->value, 0.4e-3, 1e-12);
  EXPECT_NEAR(taken.f_number->value, 2.0, 1e-12);
}

}  // namespace
}  // namespace lensd::rig
