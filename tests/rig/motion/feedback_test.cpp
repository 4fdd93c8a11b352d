// Verified means measured: what a motion may claim with each kind of feedback, and after the lens was gone.
#include <chrono>
#include <string>

#include <gmock/gmock.h>

#include "tests/rig/motion_fixture.h"

namespace lensd::rig {
namespace {

class FeedbackTest : public MotionTest {
 protected:
  void OpenAs(drivers::Feedback feedback, RigConfig config = {}) {
    controls_->focus = drivers::AxisCapabilities{
        .maximum = Native{1000.0}, .feedback = feedback, .can_home = true, .speed = 1000.0, .backlash = 0.0};
    Open(std::move(config));
  }
  MoveOutcome To(double target) {
    const auto answers = Move(target);
    EXPECT_TRUE(answers.only());
    return answers.only().value_or(MoveOutcome{});
  }
  MoveOutcome AtHome() {
    Answers<MoveOutcome> answers;
    rig_->Home(Axis::Focus, answers.Take());
    RunUntil(answers);
    EXPECT_TRUE(answers.only());
    return answers.only().value_or(MoveOutcome{});
  }
};

TEST_F(FeedbackTest, OnlyAnEncoderVerifiesAPlainMove) {
  using drivers::Feedback;
  for (const Feedback feedback : {Feedback::None, Feedback::Echo, Feedback::Counts, Feedback::Encoder}) {
    OpenAs(feedback);
    const MoveOutcome moved = To(600);
    EXPECT_TRUE(moved.reached && moved.settled) << FeedbackName(feedback);
    EXPECT_EQ(moved.verified, feedback == Feedback::Encoder) << FeedbackName(feedback);
    EXPECT_EQ(moved.reason.empty(), moved.verified) << moved.reason;
    EXPECT_EQ(moved.cause == MoveCause::None, moved.reason.empty()) << moved.reason;
  }
}

TEST_F(FeedbackTest, CountsAreVerifiedAtTheReferenceAndTheirBoundGrowsWithTravel) {
  OpenAs(drivers::Feedback::Counts);
  EXPECT_TRUE(AtHome().verified);
  EXPECT_EQ(AtHome().bound.value, 0.5);
  double travel = 0.0;
  for (const double target : {1000.0, 0.0, 1000.0, 500.0}) {
    const MoveOutcome moved = To(target);
    travel += target == 500.0 ? 500.0 : 1000.0;
    EXPECT_FALSE(moved.verified);
    EXPECT_NEAR(moved.bound.value, 0.5 + 1e-4 * travel, 1e-4 * 8) << target;
  }
  EXPECT_TRUE(AtHome().verified);
}

TEST_F(FeedbackTest, WhatMayGetLostCanBeSaid) {
  RigConfig config;
  config.axes[Axis::Focus].lost_travel = 0.01;
  OpenAs(drivers::Feedback::Counts, config);
  EXPECT_NEAR(To(1000).bound.value, 0.5 + 9.0, 0.02);
}

TEST_F(FeedbackTest, TheReferenceIsCheckedAfterSoMuchTravel) {
  RigConfig config;
  config.axes[Axis::Focus].check_reference_every = 1500.0;
  OpenAs(drivers::Feedback::Counts, config);
  To(1000);
  To(0);
  EXPECT_EQ(controls_->homes, 0);
  const MoveOutcome moved = To(800);
  EXPECT_EQ(controls_->homes, 1);
  EXPECT_TRUE(moved.reached);
  EXPECT_EQ(moved.position.value, 800.0);
  EXPECT_NEAR(moved.bound.value, 0.5 + 1e-4 * 800, 1e-4 * 4);
  To(700);
  EXPECT_EQ(controls_->homes, 1);
}

TEST_F(FeedbackTest, OnDemandTheReferenceIsSearchedBeforeTheFirstMoveAlone) {
  RigConfig config;
  config.axes[Axis::Focus].home_on_demand = true;
  OpenAs(drivers::Feedback::Counts, config);
  Run(10ms);
  EXPECT_FALSE(rig_->GetStatus().axes[Axis::Focus]->homed);
  EXPECT_EQ(controls_->homes, 0);
  EXPECT_TRUE(To(600).reached);
  EXPECT_EQ(controls_->homes, 1);
  EXPECT_TRUE(rig_->GetStatus().axes[Axis::Focus]->homed);
  EXPECT_TRUE(To(300).reached);
  EXPECT_EQ(controls_->homes, 1);
}

TEST_F(FeedbackTest, AFaultThatStandsEndsAMoveWhateverThePositionSays) {
  for (const auto feedback : {drivers::Feedback::Echo, drivers::Feedback::Encoder}) {
    controls_->fault = "";
    OpenAs(feedback);
    controls_->fault = "burnt";
    const MoveOutcome moved = To(600);
    EXPECT_FALSE(moved.reached || moved.verified);
    EXPECT_EQ(moved.reason, "the lens reports: burnt");
    EXPECT_EQ(moved.cause, MoveCause::Fault);
    EXPECT_LT(moved.elapsed, 1s);
  }
}

TEST_F(FeedbackTest, AFaultOfAnEarlierMoveDoesNotEndOneToWhereItStands) {
  OpenAs(drivers::Feedback::Encoder);
  controls_->fault = "ignored the command to move";
  controls_->stalled = true;
  EXPECT_FALSE(To(600).reached);
  controls_->stalled = false;
  controls_->forgives = true;
  const Native stands = rig_->GetStatus().axes[Axis::Focus]->position;
  const MoveOutcome moved = To(stands.value);
  EXPECT_TRUE(moved.reached) << moved.reason;
}

TEST_F(FeedbackTest, WithoutAStopTheMotionEndsWhereItRests) {
  Open();
  Answers<MoveOutcome> answers;
  Answers<void> stopped;
  rig_->Move(Axis::Zoom, At(50), answers.Take());
  Run(10ms);
  rig_->Stop({}, stopped.Take());
  Run(1ms);
  ASSERT_FALSE(stopped.only());
  EXPECT_EQ(stopped.only().error().code, Code::Unsupported);
  EXPECT_NE(stopped.only().error().message.find("travels on until it rests"), std::string::npos);
  EXPECT_TRUE(answers.all.empty());
  EXPECT_TRUE(rig_->GetStatus().axes[Axis::Zoom]->moving);
  RunUntil(answers);
  ASSERT_FALSE(answers.only());
  EXPECT_EQ(answers.only().error().code, Code::Cancelled);
  EXPECT_NE(answers.only().error().message.find("rests at 50"), std::string::npos) << answers.only().error().message;
}

TEST_F(FeedbackTest, GoneMeansUnknownAndAZeroOnReturnIsNotBelieved) {
  OpenAs(drivers::Feedback::Counts);
  To(600);
  controls_->disconnected = true;
  Run(1s);
  const AxisStatus gone = *rig_->GetStatus().axes[Axis::Focus];
  EXPECT_TRUE(!gone.moving && !gone.homed && gone.last_known);
  EXPECT_EQ(gone.position.value, 600.0);
  controls_->disconnected = false;
  Run(1s);
  EXPECT_TRUE(rig_->GetStatus().axes[Axis::Focus]->homed);
  EXPECT_FALSE(rig_->GetStatus().axes[Axis::Focus]->last_known);
  // Without power it forgets where it was.
  controls_->disconnected = true;
  Run(1s);
  controls_->disconnected = false;
  controls_->counts_anew = 0;
  Run(1s);
  EXPECT_FALSE(rig_->GetStatus().axes[Axis::Focus]->homed);
  const auto refused = Move(500);
  ASSERT_FALSE(refused.only());
  EXPECT_EQ(refused.only().error().code, Code::NotHomed);
}

TEST_F(FeedbackTest, AMoveAskedForBeforeALensThatLostItsPowerWasReadIsRefused) {
  Open();
  Run(1s);
  controls_->disconnected = true;
  Run(1s);
  controls_->disconnected = false;
  controls_->counts_anew = 0;
  const int moves = controls_->moves;
  const auto refused = Move(500);
  ASSERT_FALSE(refused.only());
  EXPECT_EQ(refused.only().error().code, Code::NotHomed);
  EXPECT_EQ(controls_->moves, moves);
}

// ---- positions that do not show the way -----------------------------------------------------------------------------

/// A lens of 1000 steps whose positions are counts by name, and which needs 6 s for 600 of them.
class UnseenWayTest : public FeedbackTest {
 protected:
  using Shows = testing::FakeControls::Shows;
  void OpenSlow(Shows shows, RigConfig config = {}) {
    controls_->focus = drivers::AxisCapabilities{.maximum = Native{1000.0}, .can_home = true, .backlash = 0.0};
    controls_->speed = 100.0;
    controls_->shows = shows;
    Open(std::move(config), 0);
  }
};

TEST_F(UnseenWayTest, ALensThatSaysBusyIsAwaitedWhateverItsPositionSays) {
  for (const Shows shows : {Shows::Target, Shows::Start}) {
    OpenSlow(shows);
    const MoveOutcome moved = To(600);
    EXPECT_TRUE(moved.reached) << moved.reason;
    EXPECT_NEAR(std::chrono::duration<double>(moved.elapsed).count(), 6.0, 0.2);
    EXPECT_EQ(controls_->stops, 0);
  }
}

TEST_F(UnseenWayTest, APositionThatIsToldAtTheEndAloneIsAwaitedWithoutAStatusToo) {
  OpenSlow(Shows::Start);
  controls_->says_nothing = true;
  const MoveOutcome moved = To(600);
  EXPECT_TRUE(moved.reached) << moved.reason;
  EXPECT_NEAR(std::chrono::duration<double>(moved.elapsed).count(), 6.0, 0.2);
  EXPECT_EQ(controls_->moves, 1);
}

TEST_F(UnseenWayTest, OneThatNeverArrivesIsGivenUpAtTheDeadlineWithItsPlaceUnknownAndIsSentAgain) {
  RigConfig config;
  config.axes[Axis::Focus].speed = 200.0;
  OpenSlow(Shows::Target, config);
  controls_->hangs = true;
  const MoveOutcome moved = To(600);
  EXPECT_FALSE(moved.reached);
  EXPECT_EQ(moved.cause, MoveCause::Late) << moved.reason;
  EXPECT_THAT(moved.reason, ::testing::HasSubstr("its position is not known"));
  EXPECT_NEAR(std::chrono::duration<double>(moved.elapsed).count(), 8.0, 0.1) << "twice 3 s and 2 s more";
  EXPECT_LE(moved.position.value - moved.bound.value, 0.0) << "it may still be where it was";
  EXPECT_GE(rig_->GetStatus().axes[Axis::Focus]->bound.value, 600.0);
  EXPECT_EQ(controls_->stops, 1);
  controls_->hangs = false;
  const int moves = controls_->moves;
  EXPECT_TRUE(To(600).reached);
  EXPECT_EQ(controls_->moves, moves + 1) << "it is sent, though its position has said 600 all the while";
  EXPECT_LT(rig_->GetStatus().axes[Axis::Focus]->bound.value, 1.0);
}

TEST_F(UnseenWayTest, LivePositionsThatCeaseToChangeAreAStall) {
  OpenSlow(Shows::Way);
  Answers<MoveOutcome> answers;
  rig_->Move(Axis::Focus, At(600), answers.Take());
  Run(2s);
  controls_->hangs = true;
  RunUntil(answers);
  ASSERT_TRUE(answers.only());
  EXPECT_EQ(answers.only()->cause, MoveCause::Stalled) << answers.only()->reason;
  EXPECT_NEAR(std::chrono::duration<double>(answers.only()->elapsed).count(), 3.0, 0.1);
  EXPECT_NEAR(answers.only()->position.value, 200.0, 2.0);
  EXPECT_NEAR(answers.only()->bound.value, 400.0, 3.0) << "the motor may be stuck, or what it says";
  EXPECT_NEAR(rig_->GetStatus().axes[Axis::Focus]->bound.value, 400.0, 3.0);
  controls_->hangs = false;
  EXPECT_TRUE(To(150).reached);
  EXPECT_LT(rig_->GetStatus().axes[Axis::Focus]->bound.value, 2.0);
}

TEST_F(UnseenWayTest, OneStrayReadingDoesNotMakePositionsLive) {
  OpenSlow(Shows::Target);
  Answers<MoveOutcome> answers;
  rig_->Move(Axis::Focus, At(600), answers.Take());
  Run(1s);
  controls_->shows = Shows::Way;
  for (const int reads = controls_->reads; controls_->reads == reads;) Run(100us);
  controls_->shows = Shows::Target;
  RunUntil(answers);
  EXPECT_TRUE(answers.only() && answers.only()->reached);
}

TEST_F(UnseenWayTest, AnAssumedArrivalWaitsForTheTravel) {
  RigConfig config;
  config.axes[Axis::Focus].speed = 100.0;
  OpenSlow(Shows::Target, config);
  controls_->says_nothing = true;
  const MoveOutcome moved = To(600);
  EXPECT_TRUE(moved.reached && !moved.verified);
  EXPECT_NEAR(std::chrono::duration<double>(moved.elapsed).count(), 6.0, 0.1);
  EXPECT_EQ(controls_->moves, 1);
}

TEST_F(UnseenWayTest, ThatItRestsIsNotSaidWhereNothingShowsIt) {
  controls_->says_nothing = true;
  controls_->focus =
      drivers::AxisCapabilities{.maximum = Native{1000.0}, .can_stop = false, .speed = 100.0, .backlash = 0.0};
  controls_->speed = 20.0;
  controls_->shows = Shows::Target;
  Open({}, 0);
  Answers<MoveOutcome> answers;
  Answers<void> stopped;
  rig_->Move(Axis::Focus, At(600), answers.Take());
  Run(500ms);
  rig_->Stop({}, stopped.Take());
  RunUntil(answers);
  ASSERT_FALSE(answers.only());
  EXPECT_EQ(answers.only().error().code, Code::Cancelled);
  EXPECT_THAT(answers.only().error().message, ::testing::HasSubstr("nothing shows whether it has come to rest"));
}

TEST_F(UnseenWayTest, ALensThatCeasesToAnswerIsNoStall) {
  OpenSlow(Shows::Way);
  Answers<MoveOutcome> answers;
  rig_->Move(Axis::Focus, At(600), answers.Take());
  Run(1s);
  controls_->lost_read_replies = 100;
  for (int question = 0; question < 10 && answers.all.empty(); ++question) {
    rig_->Step(clock_.Now());
    clock_.Advance(1100ms);  // each takes so long, as with a camera that has vanished
  }
  ASSERT_FALSE(answers.only()) << answers.only()->reason;
  EXPECT_EQ(answers.only().error().code, Code::Timeout);
}

/// A disk that takes a second for each write.
class SlowMemory final : public PositionMemory {
 public:
  explicit SlowMemory(SteppedClock& clock) : clock_(clock) {}
  Result<Axes> Load() override { return Axes{}; }
  Result<void> Save(const Axes&) override {
    clock_.Advance(1s);
    return {};
  }

 private:
  SteppedClock& clock_;
};

class NoFeedbackTest : public MotionTest {
 protected:
  void OpenWithout(std::unique_ptr<PositionMemory> memory = nullptr) {
    controls_->focus = drivers::AxisCapabilities{
        .maximum = Native{1000.0}, .feedback = drivers::Feedback::None, .speed = 100.0, .backlash = 0.0};
    controls_->speed = 100.0;
    controls_->shows = testing::FakeControls::Shows::Target;
    controls_->says_nothing = true;
    Open({}, 0, std::move(memory));
  }
};

TEST_F(NoFeedbackTest, ASecondTargetIsAwaitedFromWhereTheAxisMayBe) {
  OpenWithout();
  Answers<MoveOutcome> first;
  rig_->Move(Axis::Focus, At(600), first.Take());
  Run(1s);
  // It is at 100 by now, though the device tells 600: 4 s to go.
  const auto second = Move(500);
  ASSERT_TRUE(second.only() && second.only()->reached);
  EXPECT_GE(second.only()->elapsed, 4s);
}

TEST_F(NoFeedbackTest, TheTravelCountsFromWhenTheMotorWasTold) {
  OpenWithout(std::make_unique<SlowMemory>(clock_));
  const auto moved = Move(300);
  ASSERT_TRUE(moved.only() && moved.only()->reached);
  EXPECT_GE(moved.only()->elapsed, 4s);
}

}  // namespace
}  // namespace lensd::rig
