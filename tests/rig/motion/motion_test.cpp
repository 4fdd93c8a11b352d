// Every motion ends once, with the truth, whatever the lens does.
#include <chrono>
#include <random>

#include <gmock/gmock.h>

#include "tests/rig/motion_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

TEST_F(MotionTest, ReachesAndSettlesAndSaysWhere) {
  RigConfig config;
  config.axes[Axis::Focus].settle = 50ms;
  Open(config);
  const auto answers = Move(600);
  ASSERT_TRUE(answers.only());
  const MoveOutcome& outcome = *answers.only();
  EXPECT_TRUE(outcome.reached && outcome.settled && outcome.verified);
  EXPECT_EQ(outcome.position.value, 600.0);
  EXPECT_EQ(outcome.reason, "");
  // 500 steps at 1000 a second, 50 ms of settling, and a few polls.
  EXPECT_GE(outcome.elapsed, 550ms);
  EXPECT_LE(outcome.elapsed, 560ms);
  // 0..1000 steps over 0..1 mm of extension behind 25 mm: U = e/(f (f + e)).
  EXPECT_NEAR(outcome.extension->value, 0.6e-3, 1e-15);
  EXPECT_NEAR(outcome.vergence->value, 0.6e-3 / (0.025 * 0.0256), 1e-12);
  EXPECT_NEAR(outcome.extension_bound->value, 0.5e-6, 1e-12);
}

TEST_F(MotionTest, IrisTellsItsFNumber) {
  Open();
  Answers<MoveOutcome> answers;
  rig_->Move(Axis::Iris, {.kind = Target::Kind::FNumber, .value = 4.0, .from = {}, .take_up = {}}, answers.Take());
  RunUntil(answers);
  ASSERT_TRUE(answers.only());
  // 100 steps over three stops: two stops end at step 33.33, rounded to 33.
  EXPECT_EQ(answers.only()->position.value, 33.0);
  EXPECT_NEAR(answers.only()->f_number->value, 2.0 * std::pow(8.0, 0.33), 1e-12);
}

TEST_F(MotionTest, WithoutFeedbackNothingIsVerified) {
  Open();
  Answers<MoveOutcome> answers;
  rig_->Move(Axis::Zoom, At(50), answers.Take());
  RunUntil(answers);
  ASSERT_TRUE(answers.only());
  EXPECT_TRUE(answers.only()->reached);
  EXPECT_FALSE(answers.only()->verified);
  EXPECT_EQ(answers.only()->reason, "no position feedback, and no speed is known: it may still be on its way");
}

TEST_F(MotionTest, WaitingForAnotherAxisIsNotAStall) {
  Open();
  controls_->stalled = controls_->waiting = true;
  Answers<MoveOutcome> answers;
  rig_->Move(Axis::Focus, At(600), answers.Take());
  Run(60s);
  EXPECT_TRUE(answers.all.empty());
  controls_->waiting = false;  // its turn has come, and it stands still
  RunUntil(answers, 5s);
  ASSERT_TRUE(answers.only());
  EXPECT_FALSE(answers.only()->reached);
  EXPECT_THAT(answers.only()->reason, ::testing::HasSubstr("stalled"));
}

TEST_F(MotionTest, ALensThatIsGoneIsAskedNowAndThenAndComesBackWithoutATarget) {
  Open();
  Answers<MoveOutcome> answers;
  rig_->Move(Axis::Focus, At(600), answers.Take());
  Run(100ms);
  controls_->disconnected = true;
  RunUntil(answers, 1s);
  ASSERT_FALSE(answers.only());
  EXPECT_EQ(answers.only().error().code, Code::Disconnected);
  const int reads = controls_->reads;
  Run(10s);
  EXPECT_LE(controls_->reads - reads, 25);
  EXPECT_FALSE(rig_->GetStatus().connected);
  Answers<MoveOutcome> refused;
  rig_->Move(Axis::Focus, At(300), refused.Take());
  RunUntil(refused, 10ms);  // at once, not at the next look
  EXPECT_EQ(refused.only().error().code, Code::Disconnected);
  controls_->disconnected = false;
  Run(1s);
  const Status status = rig_->GetStatus();
  EXPECT_TRUE(status.connected);
  EXPECT_EQ(status.axes[Axis::Focus]->target, status.axes[Axis::Focus]->position);
}

TEST_F(MotionTest, BacklashIsTakenUpFromOneSideOnly) {
  RigConfig config;
  config.axes[Axis::Focus].backlash = 40.0;
  Open(config, 500);
  ASSERT_TRUE(Move(600).only());
  EXPECT_EQ(controls_->moves, 1);
  const auto back = Move(300);
  EXPECT_EQ(controls_->moves, 3);
  ASSERT_TRUE(back.only());
  EXPECT_EQ(back.only()->position.value, 300.0);
  // 600 to 260 and up to 300 again.
  EXPECT_GE(back.only()->elapsed, 380ms);
}

TEST_F(MotionTest, TakeUpStaysInsideTheSoftLimitsAndTheBoundSaysSo) {
  RigConfig config;
  config.axes[Axis::Focus].backlash = 40.0;
  config.axes[Axis::Focus].limits = {Native{280}, Native{900}};
  Open(config, 500);
  const auto back = Move(300);
  ASSERT_TRUE(back.only());
  EXPECT_EQ(back.only()->bound.value, 0.5 + 20.0);
}

TEST_F(MotionTest, NothingOutsideTheSoftLimitsMoves) {
  RigConfig config;
  config.axes[Axis::Focus].limits = {Native{50}, Native{900}};
  Open(config);
  const auto answers = Move(901);
  ASSERT_FALSE(answers.only());
  EXPECT_EQ(answers.only().error().code, Code::OutOfRange);
  EXPECT_EQ(controls_->moves, 0);
}

TEST_F(MotionTest, AStallIsReportedAndTheMotorStopped) {
  Open();
  controls_->stalled = true;
  const auto answers = Move(600);
  ASSERT_TRUE(answers.only());
  EXPECT_FALSE(answers.only()->reached);
  EXPECT_NE(answers.only()->reason.find("stalled"), std::string::npos) << answers.only()->reason;
  EXPECT_LE(answers.only()->elapsed, 1100ms);
  EXPECT_GT(controls_->stops, 0);
}

TEST_F(MotionTest, ASlowMotorIsGivenUpAtTheDeadline) {
  RigConfig config;
  config.axes[Axis::Focus].speed = 1000.0;
  Open(config);
  controls_->speed = 20.0;
  const auto answers = Move(600);
  ASSERT_TRUE(answers.only());
  EXPECT_FALSE(answers.only()->reached);
  // Twice the 0.5 s the travel should take and two seconds more.
  EXPECT_NEAR(std::chrono::duration<double>(answers.only()->elapsed).count(), 3.0, 0.01);
}

TEST_F(MotionTest, AReadingFromBeforeTheCommandProvesNothing) {
  Open({}, 100);
  ASSERT_TRUE(Move(600).only());
  Answers<MoveOutcome> away;
  rig_->Move(Axis::Focus, At(100), away.Take());
  Run(20ms);
  controls_->stale = true;  // from here on the lens repeats where it was 20 ms into the motion
  RunUntil(away);
  ASSERT_TRUE(away.only());
  EXPECT_FALSE(away.only()->reached);
}

TEST_F(MotionTest, LostRepliesAreRetriedAFewTimes) {
  Open();
  controls_->lost_move_replies = 2;
  controls_->lost_read_replies = 2;
  const auto answers = Move(600);
  ASSERT_TRUE(answers.only());
  EXPECT_TRUE(answers.only()->reached);
}

TEST_F(MotionTest, ALensThatNoLongerAnswersIsATimeout) {
  Open();
  Answers<MoveOutcome> answers;
  rig_->Move(Axis::Focus, At(600), answers.Take());
  Run(20ms);
  controls_->lost_read_replies = 100000;
  RunUntil(answers);
  ASSERT_FALSE(answers.only());
  EXPECT_EQ(answers.only().error().code, Code::Timeout);
  EXPECT_FALSE(rig_->GetStatus().connected);
}

TEST_F(MotionTest, MoveRepliesThatStayLostAreATimeout) {
  Open();
  controls_->lost_move_replies = 100000;
  const auto answers = Move(600);
  ASSERT_FALSE(answers.only());
  EXPECT_EQ(answers.only().error().code, Code::Timeout);
}

TEST_F(MotionTest, UnpluggedInMidMoveAndPluggedInAgain) {
  Open();
  Answers<MoveOutcome> answers;
  rig_->Move(Axis::Focus, At(600), answers.Take());
  Run(100ms);
  controls_->disconnected = true;
  RunUntil(answers);
  ASSERT_FALSE(answers.only());
  EXPECT_EQ(answers.only().error().code, Code::Disconnected);
  EXPECT_EQ(Move(200).only().error().code, Code::Disconnected);
  controls_->disconnected = false;
  ASSERT_TRUE(Move(200).only());
  EXPECT_TRUE(rig_->GetStatus().connected);
}

TEST_F(MotionTest, HomingEndsAtTheReference) {
  Open({}, 700);
  Answers<MoveOutcome> answers;
  rig_->Home(Axis::Focus, answers.Take());
  RunUntil(answers);
  ASSERT_TRUE(answers.only());
  EXPECT_TRUE(answers.only()->reached);
  EXPECT_EQ(answers.only()->position.value, 0.0);
  Answers<MoveOutcome> iris;
  rig_->Home(Axis::Iris, iris.Take());
  RunUntil(iris);
  EXPECT_EQ(iris.only().error().code, Code::Unsupported);
}

TEST_F(MotionTest, StopEndsAMotionWithinAPollAndTheTargetBecomesTheReadback) {
  Open();
  Answers<MoveOutcome> moved;
  rig_->Move(Axis::Focus, At(900), moved.Take());
  Run(200ms);
  Answers<void> stopped;
  rig_->Stop({}, stopped.Take());
  Run(2ms);
  ASSERT_TRUE(stopped.only());
  EXPECT_EQ(moved.only().error().code, Code::Cancelled);
  Run(100ms);
  const auto status = rig_->GetStatus().axes[Axis::Focus];
  EXPECT_FALSE(status->moving);
  EXPECT_NEAR(status->position.value, 300.0, 5.0);
  EXPECT_EQ(status->target, status->position);
}

/// On a bus a reading takes longer than the stop did.
TEST_F(MotionTest, AStopIsAnsweredBeforeTheNextReading) {
  Open();
  Answers<MoveOutcome> moved;
  rig_->Move(Axis::Focus, At(900), moved.Take());
  Run(200ms);
  const int reads = controls_->reads;
  Answers<void> stopped;
  rig_->Stop({}, stopped.Take());
  const Instant next = rig_->Step(clock_.Now());
  ASSERT_TRUE(stopped.only());
  EXPECT_EQ(moved.only().error().code, Code::Cancelled);
  EXPECT_EQ(controls_->reads, reads);
  EXPECT_GT(controls_->stops, 0);
  EXPECT_LE(next, clock_.Now()) << "the reading is only put off";
}

TEST_F(MotionTest, StopAfterAMoveInOneBreathNeverLetsItBegin) {
  Open();
  Answers<MoveOutcome> moved;
  Answers<void> stopped;
  rig_->Move(Axis::Focus, At(900), moved.Take());
  rig_->Stop({Axis::Focus}, stopped.Take());
  Run(10ms);
  EXPECT_EQ(moved.only().error().code, Code::Cancelled);
  EXPECT_EQ(controls_->moves, 0);
}

TEST_F(MotionTest, AxesMoveSideBySide) {
  Open();
  Answers<MoveOutcome> focus, iris;
  rig_->Move(Axis::Focus, At(400), focus.Take());
  rig_->Move(Axis::Iris, At(80), iris.Take());
  RunUntil(focus);
  RunUntil(iris);
  EXPECT_TRUE(focus.only() && focus.only()->reached);
  EXPECT_TRUE(iris.only() && iris.only()->reached);
}

// The last target wins, and every caller is answered once.
TEST_F(MotionTest, RetargetStorm) {
  Open();
  std::mt19937 random(7);
  std::uniform_int_distribution<int> position(0, 1000);
  constexpr int kCommands = 10000;
  std::vector<int> answered(kCommands, 0);
  int superseded = 0, reached = 0, last = 0;
  for (int i = 0; i < kCommands; ++i) {
    last = position(random);
    rig_->Move(Axis::Focus, At(last), [&, i](Result<MoveOutcome> answer) {
      ++answered[i];
      if (!answer)
        superseded += answer.error().code == Code::Superseded;
      else
        reached += answer->reached;
    });
    Run(1ms);
  }
  Run(5s);
  EXPECT_EQ(std::count(answered.begin(), answered.end(), 1), kCommands);
  EXPECT_EQ(superseded + reached, kCommands);
  EXPECT_EQ(Focus(), last);
}

TEST_F(MotionTest, DestroyedInMidMoveEverybodyIsTold) {
  Open();
  Answers<MoveOutcome> moving, noted;
  Answers<LensedFrame> picture;
  rig_->Move(Axis::Focus, At(900), moving.Take());
  Run(50ms);
  rig_->Snapshot(picture.Take());
  rig_->Move(Axis::Iris, At(50), noted.Take());
  rig_.reset();
  EXPECT_EQ(moving.only().error().code, Code::Cancelled);
  EXPECT_EQ(noted.only().error().code, Code::Cancelled);
  EXPECT_EQ(picture.only().error().code, Code::Cancelled);
}

TEST_F(MotionTest, CommandsFromACallbackAreCarriedOut) {
  Open();
  Answers<MoveOutcome> second;
  rig_->Move(Axis::Focus, At(200), [&](Result<MoveOutcome>) { rig_->Move(Axis::Focus, At(300), second.Take()); });
  RunUntil(second);
  ASSERT_TRUE(second.only());
  EXPECT_EQ(Focus(), 300.0);
}

TEST_F(MotionTest, TargetsOfEveryKind) {
  Open({}, 500);
  using Kind = Target::Kind;
  const auto focus = [&](Kind kind, double value) {
    return rig_->Resolve(Axis::Focus, {.kind = kind, .value = value, .from = {}, .take_up = {}});
  };
  EXPECT_EQ(focus(Kind::NativeRelative, -20)->value, 480.0);
  EXPECT_EQ(focus(Kind::TowardNear, 20)->value, 520.0);
  EXPECT_EQ(focus(Kind::Extension, 0.25e-3)->value, 250.0);
  // e = f²/(Z - f): 0.625 mm for 1.025 m is off the grid by less than half a step.
  EXPECT_EQ(focus(Kind::Distance, 1.025)->value, 625.0);
  EXPECT_EQ(focus(Kind::Vergence, 1.0 / 1.025)->value, 625.0);
  EXPECT_EQ(focus(Kind::Distance, INFINITY)->value, 0.0);
  EXPECT_EQ(focus(Kind::Distance, 0.02).error().code, Code::OutOfRange);
  EXPECT_EQ(focus(Kind::FNumber, 4).error().code, Code::InvalidArgument);
  EXPECT_EQ(focus(Kind::Native, NAN).error().code, Code::InvalidArgument);
  EXPECT_EQ(rig_->Resolve(Axis::Filter, At(1)).error().code, Code::Unsupported);
  // From the sensor the same subject is 1.025 + 0.025625 m away.
  const Target from_sensor{
      .kind = Kind::Distance, .value = 1.050625, .from = optics::DistanceFrom::Sensor, .take_up = {}};
  EXPECT_EQ(rig_->Resolve(Axis::Focus, from_sensor)->value, 625.0);
}

TEST_F(MotionTest, NearIsTheOtherWayWhereTheWiringIs) {
  RigConfig config;
  config.axes[Axis::Focus].direction = drivers::Direction::NearNegative;
  Open(config, 500);
  EXPECT_EQ(
      rig_->Resolve(Axis::Focus, {.kind = Target::Kind::TowardNear, .value = 20, .from = {}, .take_up = {}})->value,
      480.0);
  EXPECT_EQ(
      rig_->Resolve(Axis::Focus, {.kind = Target::Kind::Extension, .value = 0.25e-3, .from = {}, .take_up = {}})->value,
      750.0);
}

}  // namespace
}  // namespace lensd::rig
