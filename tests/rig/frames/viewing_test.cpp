// Those who look on: they see every frame with the lens as it was, and are nobody's burden.
#include <gtest/gtest.h>

#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

/// What one viewer has been shown.
struct Seen {
  std::vector<LensedFrame> frames;
  std::vector<Error> ends;
  std::size_t enough = 1'000'000;

  FrameViewer Viewer(LensMotion lens, Duration period = {}) {
    return {lens, period, [this](const Result<LensedFrame>& frame) {
              if (frame) frames.push_back(*frame);
              if (!frame) ends.push_back(frame.error());
              return frames.size() < enough;
            }};
  }
};

class ViewingTest : public RigTest {
 protected:
  /// A rig that ends tells its viewers.
  void TearDown() override { rig_.reset(); }
  Seen seen_, other_, third_;
};

TEST_F(ViewingTest, ShowsEveryFrameUntilTheViewerHasSeenEnough) {
  Open();
  Seen &seen = seen_, &few = other_;
  few.enough = 3;
  ASSERT_TRUE(rig_->View(seen.Viewer(LensMotion::Any)));
  ASSERT_TRUE(rig_->View(few.Viewer(LensMotion::Standing)));
  Run(1s);
  EXPECT_EQ(few.frames.size(), 3u);
  // A frame each 10 ms, and none twice; to look every 2 ms is enough for that.
  EXPECT_GE(seen.frames.size(), 97u);
  for (std::size_t i = 1; i < seen.frames.size(); ++i) {
    EXPECT_EQ(seen.frames[i].frame.sequence, seen.frames[i - 1].frame.sequence + 1);
  }
  EXPECT_TRUE(rig_->GetStatus().streaming);
  EXPECT_EQ(rig_->GetStatus().activity.kind, Activity::Kind::Idle);
  seen.enough = 0;
  Run(50ms);
  EXPECT_FALSE(rig_->GetStatus().streaming);
}

TEST_F(ViewingTest, KeepsToTheViewersRate) {
  Open();
  Seen& seen = seen_;
  ASSERT_TRUE(rig_->View(seen.Viewer(LensMotion::Any, 50ms)));
  Run(1s);
  EXPECT_GE(seen.frames.size(), 19u);
  EXPECT_LE(seen.frames.size(), 21u);
}

TEST_F(ViewingTest, TellsWhereAMovingLensWasAndKeepsItFromThoseWhoWantItAtRest) {
  Open();
  Seen &any = seen_, &standing = other_;
  ASSERT_TRUE(rig_->View(any.Viewer(LensMotion::Any)));
  ASSERT_TRUE(rig_->View(standing.Viewer(LensMotion::Standing)));
  const Instant begun = clock_.Now();
  Answers<MoveOutcome> moved;
  rig_->Move(Axis::Focus, At(400), moved.Take());
  RunUntil(moved);
  ASSERT_TRUE(moved.only()->reached);
  int moving = 0;
  for (const LensedFrame& frame : any.frames) {
    const auto& focus = *frame.axes[Axis::Focus];
    if (!focus.moving) continue;
    ++moving;
    // 100 to 400 at 1000 a second; the exposure takes 5 ms.
    const double from = 100.0 + std::chrono::duration<double>(frame.frame.exposure_start - begun).count() * 1000.0;
    EXPECT_LE(focus.lowest.value, from + 1.0);
    EXPECT_GE(focus.highest.value, std::min(from + 5.0, 400.0) - 1.0);
    EXPECT_LE(focus.highest.value - focus.lowest.value, 20.0);
  }
  EXPECT_GE(moving, 25);
  for (const LensedFrame& frame : standing.frames) EXPECT_FALSE(frame.axes[Axis::Focus]->moving);
}

TEST_F(ViewingTest, AutofocusTakesTheSameFramesWithAViewer) {
  Open();
  const auto focus = [&] {
    Answers<AutofocusOutcome> answers;
    rig_->Autofocus({}, nullptr, answers.Take());
    RunUntil(answers);
    return *answers.only();
  };
  const AutofocusOutcome alone = focus();
  Open();
  Seen& seen = seen_;
  ASSERT_TRUE(rig_->View(seen.Viewer(LensMotion::Any)));
  Answers<AutofocusOutcome> answers;
  rig_->Autofocus({}, nullptr, answers.Take());
  RunUntil(answers);
  EXPECT_TRUE(answers.only()->focused);
  EXPECT_EQ(answers.only()->frames, alone.frames);
  EXPECT_LE(answers.only()->elapsed, alone.elapsed + 20ms);
  EXPECT_GE(seen.frames.size(), static_cast<std::size_t>(alone.frames));
}

TEST_F(ViewingTest, ASearchIsSeenAsTheCameraSeesItUnlessFramesAreMadeOnDemand) {
  for (const bool on_demand : {false, true}) {
    controls_->on_demand = on_demand;
    controls_->told_rate_hz = 100.0;  // then none is asked for too early
    Open();
    seen_ = {};
    Answers<AutofocusOutcome> answers;
    ASSERT_TRUE(rig_->View(seen_.Viewer(LensMotion::Any)));
    const Instant begun = clock_.Now();
    rig_->Autofocus({}, nullptr, answers.Take());
    RunUntil(answers);
    ASSERT_TRUE(answers.only()->focused);
    const auto taken = static_cast<std::size_t>(answers.only()->frames);
    const auto delivered = static_cast<std::size_t>((clock_.Now() - begun) / 10ms);
    ASSERT_GT(delivered, 2 * taken);
    if (on_demand) {
      EXPECT_LE(seen_.frames.size(), taken + 2);
    } else {
      EXPECT_GE(seen_.frames.size(), delivered * 9 / 10);
    }
  }
}

TEST_F(ViewingTest, EndsWithTheReason) {
  Open();
  Seen &lost = seen_, &dark = other_, &closed = third_;
  ASSERT_TRUE(rig_->View(lost.Viewer(LensMotion::Any)));
  Run(100ms);
  controls_->disconnected = true;
  Run(2s);
  ASSERT_EQ(lost.ends.size(), 1u);
  EXPECT_EQ(lost.ends.front().code, Code::Disconnected);
  controls_->disconnected = false;
  controls_->dark = true;
  Run(2s);
  ASSERT_TRUE(rig_->View(dark.Viewer(LensMotion::Any)));
  Run(4s);
  EXPECT_TRUE(dark.ends.empty());
  Run(4s);
  ASSERT_EQ(dark.ends.size(), 1u);
  EXPECT_EQ(dark.ends.front().code, Code::Timeout);
  ASSERT_TRUE(rig_->View(closed.Viewer(LensMotion::Any)));
  rig_.reset();
  ASSERT_EQ(closed.ends.size(), 1u);
  EXPECT_EQ(closed.ends.front().code, Code::Cancelled);
}

}  // namespace
}  // namespace lensd::rig
