// Every kind of fault a scene can ask for, seen through the lens and the camera; and the wrappers that tests use.
#include <gtest/gtest.h>

#include <chrono>

#include "faulty_camera.h"
#include "faulty_lens.h"
#include "stage.h"

namespace lensd::sim {
namespace {

using drivers::Axis;

Scene SceneWith(std::vector<Fault> faults) {
  Scene scene = SmallScene();
  scene.lens.settle_ms = 0.0;
  scene.camera.full_well_e = 5000.0;
  scene.faults = std::move(faults);
  return scene;
}

void MoveFocus(Stage& stage, double target) {
  ASSERT_TRUE(stage.lens().StartMove(Axis::Focus, Native{target}).has_value());
}

TEST(SceneFault, StallHoldsTheAxisUntilItEnds) {
  Stage stage(SceneWith({{.at_ms = 200, .kind = FaultKind::Stall, .for_ms = 300}}));
  MoveFocus(stage, 4000);
  stage.Wait(400);
  EXPECT_NEAR(stage.FocusCount(), 8000.0 * 0.18, 1e-6);
  EXPECT_EQ(stage.lens().Read()->axes[Axis::Focus]->fault, "stalled");
  EXPECT_FALSE(stage.lens().Read()->axes[Axis::Focus]->moving);
  stage.Wait(200);
  EXPECT_EQ(stage.lens().Read()->axes[Axis::Focus]->fault, "");
  MoveFocus(stage, 4000);
  stage.Wait(1000);
  EXPECT_EQ(stage.FocusCount(), 4000.0);
}

TEST(SceneFault, StallOfOneAxisLeavesTheOthers) {
  Stage stage(SceneWith({{.at_ms = 0, .kind = FaultKind::Stall, .axis = Axis::Iris}}));
  MoveFocus(stage, 1000);
  ASSERT_TRUE(stage.lens().StartMove(Axis::Iris, Native{90}).has_value());
  stage.Wait(1000);
  EXPECT_EQ(stage.FocusCount(), 1000.0);
  EXPECT_EQ(stage.lens().Read()->axes[Axis::Iris]->fault, "stalled");
  EXPECT_NEAR(stage.world.truth->Now().f_number, 2.0, 1e-12);
}

TEST(SceneFault, JumpIsNotCounted) {
  Stage stage(SceneWith({{.at_ms = 600, .kind = FaultKind::Jump, .steps = -250}}));
  MoveFocus(stage, 4000);
  stage.Wait(1000);
  EXPECT_EQ(stage.FocusCount(), 4000.0);
  EXPECT_NEAR(stage.FocusPlace(), 3750.0, 1e-6);
}

TEST(SceneFault, MissedStepsAreCounted) {
  Stage stage(SceneWith({{.at_ms = 0, .kind = FaultKind::MissedSteps, .for_ms = 1000, .factor = 0.1}}));
  MoveFocus(stage, 4000);
  stage.Wait(1500);
  EXPECT_EQ(stage.FocusCount(), 4000.0);
  EXPECT_NEAR(stage.FocusPlace(), 3600.0, 1e-6);
  MoveFocus(stage, 5000);
  stage.Wait(1000);
  EXPECT_NEAR(stage.FocusPlace(), 4600.0, 1e-6);
}

TEST(SceneFault, FaultsHappenInTimeHoweverSeldomOneLooks) {
  const Scene scene = SceneWith({{.at_ms = 100, .kind = FaultKind::Jump, .steps = 30},
                                 {.at_ms = 200, .kind = FaultKind::Stall, .for_ms = 100},
                                 {.at_ms = 250, .kind = FaultKind::Jump, .steps = 7}});
  Stage often(scene);
  Stage seldom(scene);
  MoveFocus(often, 4000);
  MoveFocus(seldom, 4000);
  for (int i = 0; i < 1000; ++i) {
    often.Wait(1);
    ASSERT_TRUE(often.lens().Read().has_value());
  }
  seldom.Wait(1000);
  EXPECT_EQ(often.FocusCount(), seldom.FocusCount());
  EXPECT_NEAR(often.FocusPlace(), seldom.FocusPlace(), 1e-9);
}

TEST(SceneFault, DisconnectLastsUntilReconnect) {
  Stage stage(SceneWith({{.at_ms = 100, .kind = FaultKind::Disconnect}, {.at_ms = 300, .kind = FaultKind::Reconnect}}));
  ASSERT_TRUE(stage.camera().Start().has_value());
  MoveFocus(stage, 4000);
  stage.Wait(150);
  EXPECT_EQ(stage.lens().Read().error().code, Code::Disconnected);
  EXPECT_EQ(stage.lens().StartMove(Axis::Focus, Native{1}).error().code, Code::Disconnected);
  EXPECT_EQ(stage.lens().Stop(Axis::Focus).error().code, Code::Disconnected);
  EXPECT_EQ(stage.lens().StartHome(Axis::Focus).error().code, Code::Disconnected);
  EXPECT_EQ(stage.camera().Poll().error().code, Code::Disconnected);
  EXPECT_EQ(stage.camera().Start().error().code, Code::Disconnected);
  stage.Wait(850);
  // It was without power: it stopped where it was after 100 ms of 8000 steps a second, and does not know that place.
  EXPECT_EQ(stage.FocusCount(), 0.0);
  EXPECT_NEAR(stage.FocusPlace(), 640.0, 0.5);
  EXPECT_FALSE(stage.lens().Read()->axes[Axis::Focus]->homed);
  ASSERT_TRUE(stage.lens().StartHome(Axis::Focus).has_value());
  stage.Wait(1000);
  EXPECT_TRUE(stage.lens().Read()->axes[Axis::Focus]->homed);
  MoveFocus(stage, 500);
  stage.Wait(1000);
  EXPECT_NEAR(stage.FocusPlace(), 500.0, 0.5);
  EXPECT_TRUE(stage.camera().Poll().has_value());
}

TEST(SceneFault, DisconnectForAWhile) {
  Stage stage(SceneWith({{.at_ms = 100, .kind = FaultKind::Disconnect, .for_ms = 50}}));
  stage.Wait(149);
  EXPECT_EQ(stage.lens().Read().error().code, Code::Disconnected);
  stage.Wait(1);
  EXPECT_TRUE(stage.lens().Read().has_value());
}

TEST(SceneFault, DroppedRepliesAreObeyed) {
  Stage stage(SceneWith({{.at_ms = 0, .kind = FaultKind::DropReply, .for_ms = 100}}));
  EXPECT_EQ(stage.lens().StartMove(Axis::Focus, Native{4000}).error().code, Code::Timeout);
  EXPECT_EQ(stage.lens().Read().error().code, Code::Timeout);
  stage.Wait(1000);
  EXPECT_EQ(stage.FocusCount(), 4000.0);
}

TEST(SceneFault, LateRepliesAnswerTheNextQuestion) {
  Stage stage(SceneWith({{.at_ms = 100, .kind = FaultKind::LateReply, .for_ms = 300}}));
  MoveFocus(stage, 4000);
  stage.Wait(200);
  EXPECT_EQ(stage.lens().Read().error().code, Code::Timeout);
  const double then = 8000.0 * 0.18;
  stage.Wait(100);
  const auto late = stage.lens().Read();
  ASSERT_TRUE(late.has_value());
  EXPECT_NEAR(late->axes[Axis::Focus]->position.value, then, 1e-6);
  EXPECT_EQ(late->sampled_at, stage.clock.Now());
  stage.Wait(200);
  EXPECT_NEAR(stage.FocusCount(), 8000.0 * 0.48, 1e-6);
}

TEST(SceneFault, StaleReadbackRepeatsThePast) {
  Stage stage(SceneWith({{.at_ms = 200, .kind = FaultKind::StaleReadback, .for_ms = 500}}));
  MoveFocus(stage, 4000);
  stage.Wait(650);
  EXPECT_NEAR(stage.FocusCount(), 8000.0 * 0.18, 1e-6);
  EXPECT_TRUE(stage.lens().Read()->axes[Axis::Focus]->moving);
  EXPECT_NEAR(stage.FocusPlace(), 4000.0, 1e-9);
  stage.Wait(100);
  EXPECT_EQ(stage.FocusCount(), 4000.0);
}

/// Frames of the next `count` cells of a 60 Hz grid.
std::vector<drivers::Frame> Film(Stage& stage, int count) {
  std::vector<drivers::Frame> frames;
  for (int i = 0; i < count; ++i) {
    stage.clock.Advance(Duration(16666667));
    const auto frame = stage.camera().Poll();
    if (frame && *frame) frames.push_back(**frame);
  }
  return frames;
}

TEST(SceneFault, FrozenFramesRepeatUnderNewTimes) {
  Stage stage(SceneWith({{.at_ms = 60, .kind = FaultKind::FreezeFrames, .for_ms = 60}}));
  ASSERT_TRUE(stage.camera().Start().has_value());
  const auto frames = Film(stage, 10);
  ASSERT_EQ(frames.size(), 10u);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].sequence, i);
    EXPECT_EQ(frames[i].exposure_start - frames[i - 1].exposure_start, Duration(16666667));
    const bool frozen = i >= 4 && i <= 7;  // exposures from 66.7 to 116.7 ms
    EXPECT_EQ(*frames[i].samples == *frames[i - 1].samples, frozen) << i;
  }
}

TEST(SceneFault, LostFramesAreCountedAndNeverCome) {
  Stage stage(SceneWith({{.at_ms = 60, .kind = FaultKind::LoseFrames, .for_ms = 60}}));
  ASSERT_TRUE(stage.camera().Start().has_value());
  const auto frames = Film(stage, 10);
  ASSERT_EQ(frames.size(), 6u);
  EXPECT_EQ(frames[3].sequence, 3u);
  EXPECT_EQ(frames[4].sequence, 8u);
}

TEST(SceneFault, AFrameExposedBeforeALossStillArrives) {
  Stage stage(SceneWith({{.at_ms = 60, .kind = FaultKind::LoseFrames, .for_ms = 60}}));
  ASSERT_TRUE(stage.camera().Start().has_value());
  stage.Wait(110);
  const auto frame = *stage.camera().Poll();
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->sequence, 3u);
  EXPECT_FALSE(stage.camera().Poll()->has_value());
}

TEST(SceneFault, WrongExposureIsNotReported) {
  Stage stage(SceneWith({{.at_ms = 60, .kind = FaultKind::WrongExposure, .for_ms = 60, .factor = 0.25}}));
  ASSERT_TRUE(stage.camera().Start().has_value());
  const auto frames = Film(stage, 10);
  ASSERT_EQ(frames.size(), 10u);
  EXPECT_NEAR(MeanLevel(frames[2]), 0.45 * 255.0, 1.0);
  EXPECT_NEAR(MeanLevel(frames[5]), 0.45 * 255.0 / 4.0, 1.0);
  EXPECT_EQ(frames[5].exposure_end - frames[5].exposure_start, std::chrono::milliseconds(10));
  EXPECT_NEAR(MeanLevel(frames[9]), 0.45 * 255.0, 1.0);
}

TEST(FaultyLens, ForwardsUntilToldOtherwise) {
  Stage stage(SceneWith({}));
  testing::FaultyLens lens(std::move(stage.world.device.lens));
  ASSERT_TRUE(lens.StartMove(Axis::Focus, Native{800}).has_value());
  stage.Wait(1000);
  EXPECT_EQ(lens.Read()->axes[Axis::Focus]->position, Native{800});
  lens.SetShift(Axis::Focus, 40.0);
  EXPECT_EQ(lens.Read()->axes[Axis::Focus]->position, Native{840});
  lens.SetShift(Axis::Focus, 0.0);
  lens.SetStuck(Axis::Focus, true);
  ASSERT_TRUE(lens.StartMove(Axis::Focus, Native{0}).has_value());
  stage.Wait(1000);
  EXPECT_EQ(lens.Read()->axes[Axis::Focus]->position, Native{800});
  EXPECT_EQ(lens.commands(), 1);
  lens.SetConnected(false);
  EXPECT_EQ(lens.Read().error().code, Code::Disconnected);
  EXPECT_EQ(lens.Stop(Axis::Focus).error().code, Code::Disconnected);
}

TEST(FaultyLens, SpoilsReplies) {
  using Reply = testing::FaultyLens::Reply;
  Stage stage(SceneWith({}));
  testing::FaultyLens lens(std::move(stage.world.device.lens));
  lens.Spoil(Reply::Refused);
  EXPECT_EQ(lens.StartMove(Axis::Focus, Native{100}).error().code, Code::Protocol);
  EXPECT_EQ(lens.commands(), 0);
  lens.Spoil(Reply::Dropped);
  EXPECT_EQ(lens.StartMove(Axis::Focus, Native{100}).error().code, Code::Timeout);
  EXPECT_EQ(lens.commands(), 1);
  lens.Spoil(Reply::Late);
  EXPECT_EQ(lens.Read().error().code, Code::Timeout);
  stage.Wait(1000);
  EXPECT_EQ(lens.Read()->axes[Axis::Focus]->position, Native{0});  // the late answer
  EXPECT_EQ(lens.Read()->axes[Axis::Focus]->position, Native{100});
  ASSERT_TRUE(lens.StartMove(Axis::Focus, Native{200}).has_value());
  stage.Wait(1000);
  lens.Spoil(Reply::Duplicate);
  EXPECT_EQ(lens.Read()->axes[Axis::Focus]->position, Native{100});
  EXPECT_EQ(lens.Read()->axes[Axis::Focus]->position, Native{200});
  lens.SetStale(true);
  ASSERT_TRUE(lens.StartMove(Axis::Focus, Native{0}).has_value());
  stage.Wait(1000);
  EXPECT_EQ(lens.Read()->axes[Axis::Focus]->position, Native{200});
}

TEST(FaultyCamera, GoesWrongOnDemand) {
  Stage stage(SceneWith({}));
  testing::FaultyCamera camera(std::move(stage.world.device.camera));
  ASSERT_TRUE(camera.Start().has_value());
  const auto next = [&] {
    stage.Wait(17);
    return camera.Poll();
  };
  const auto first = *next();
  ASSERT_TRUE(first.has_value());
  camera.SetFrozen(true);
  const auto frozen = *next();
  ASSERT_TRUE(frozen.has_value());
  EXPECT_EQ(*frozen->samples, *first->samples);
  EXPECT_NE(frozen->sequence, first->sequence);
  camera.SetFrozen(false);
  camera.LoseFrames(1);
  EXPECT_FALSE(next()->has_value());
  camera.SetBrightness(0.5);
  EXPECT_NEAR(MeanLevel(**next()), 0.225 * 255.0, 1.0);
  camera.TimeOutPolls(1);
  EXPECT_EQ(next().error().code, Code::Timeout);
  camera.SetConnected(false);
  EXPECT_EQ(next().error().code, Code::Disconnected);
}

}  // namespace
}  // namespace lensd::sim
