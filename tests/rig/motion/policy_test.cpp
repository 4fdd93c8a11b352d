// The rules of motion: dead band, retries, one approach direction inside the soft limits, and whose motion it was.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <chrono>
#include <random>
#include <string>

#include "test_level.h"
#include "tests/rig/policy_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

// ---- dead bands, retries ------------------------------------------------------------------------------------------

TEST_F(PolicyTest, WithinTheDeadBandNothingMoves) {
  RigConfig config;
  config.axes[Axis::Focus].deadband = 5.0;
  Open(config, 100);
  const auto near = Move(105);
  ASSERT_TRUE(near && near->reached && near->verified);
  EXPECT_EQ(near->position.value, 100.0);
  EXPECT_EQ(controls_->moves, 0);
  ASSERT_TRUE(Move(106));
  EXPECT_EQ(controls_->moves, 1);
}

TEST_F(PolicyTest, TheDeadBandDoesNotKeepBacklashFromBeingTakenUp) {
  Open(WithBacklash(40), 500);
  const auto moved = Move(500);
  ASSERT_TRUE(moved && moved->reached);
  EXPECT_EQ(controls_->focus_targets, (std::vector<double>{460, 500}));
  EXPECT_EQ(moved->bound.value, 0.5);
  ASSERT_TRUE(Move(500));
  EXPECT_EQ(controls_->moves, 2);
}

TEST_F(PolicyTest, WhatComesToRestElsewhereIsSentAgain) {
  Open({}, 100);
  controls_->short_moves = 2;
  controls_->short_by = 5.0;
  const auto moved = Move(600);
  ASSERT_TRUE(moved && moved->reached && !moved->missed) << moved->reason;
  EXPECT_EQ(moved->position.value, 600.0);
  EXPECT_EQ(controls_->moves, 3);
}

TEST_F(PolicyTest, AfterTheRetriesItIsMissed) {
  Open({}, 100);
  controls_->short_moves = 100;
  controls_->short_by = 5.0;
  const auto moved = Move(600);
  ASSERT_TRUE(moved);
  EXPECT_TRUE(moved->missed && !moved->reached && !moved->verified);
  EXPECT_EQ(moved->position.value, 595.0);
  EXPECT_EQ(moved->reason, "missed: stands 5 steps from the target after 2 retries");
  EXPECT_EQ(controls_->moves, 3);
}

TEST_F(PolicyTest, ToleranceIsTheRetryDeadBand) {
  RigConfig config;
  config.axes[Axis::Focus].tolerance = 5.0;
  Open(config, 100);
  controls_->short_moves = 1;
  controls_->short_by = 5.0;
  const auto moved = Move(600);
  ASSERT_TRUE(moved && moved->reached);
  EXPECT_EQ(moved->position.value, 595.0);
  EXPECT_EQ(controls_->moves, 1);
}

TEST_F(PolicyTest, SettlesByReadback) {
  RigConfig config;
  config.axes[Axis::Focus].settle_by_readback = true;
  Open(config, 100);
  const auto moved = Move(200);
  ASSERT_TRUE(moved && moved->settled);
  EXPECT_GE(moved->elapsed, 120ms);
  EXPECT_LE(moved->elapsed, 130ms);
}

TEST_F(PolicyTest, WithoutFeedbackTheSagIsInTheBound) {
  RigConfig config;
  config.axes[Axis::Zoom].sag = 7.0;
  config.axes[Axis::Zoom].backlash = 0.0;
  Open(config);
  const auto moved = Move(50, Axis::Zoom);
  ASSERT_TRUE(moved && moved->reached && !moved->verified);
  EXPECT_EQ(moved->bound.value, 7.5);
  EXPECT_EQ(moved->reason, "no position feedback, and no speed is known: it may still be on its way");
}

// ---- backlash -----------------------------------------------------------------------------------------------------

TEST_F(PolicyTest, AShortMoveTakesUpWhatNobodyHasTakenUp) {
  Open(WithBacklash(40), 500);
  ASSERT_TRUE(Move(510));
  EXPECT_EQ(controls_->focus_targets, (std::vector<double>{470, 510}));
  ASSERT_TRUE(Move(511));
  EXPECT_EQ(controls_->focus_targets.size(), 3u) << "taken up already";
}

TEST_F(PolicyTest, AStopInMidMoveLeavesTheBacklashInDoubt) {
  Open(WithBacklash(40), 500);
  Answers<MoveOutcome> away;
  Answers<void> stopped;
  rig_->Move(Axis::Focus, At(900), away.Take());
  Run(200ms);
  rig_->Stop({}, stopped.Take());
  Run(100ms);
  EXPECT_FALSE(FocusStatus().moved_by_another);
  EXPECT_EQ(FocusStatus().bound.value, 40.5);
  const double here = Focus();
  const auto moved = Move(here + 10);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->bound.value, 0.5);
  EXPECT_EQ(controls_->focus_targets.size(), 3u);
}

TEST_F(PolicyTest, UnknownBacklashIsNotTakenUpAndWidensTheBound) {
  drivers::AxisCapabilities can{.maximum = Native{1000.0}, .feedback = drivers::Feedback::Encoder};
  controls_->focus = can;
  Open({}, 500);
  const auto back = Move(300);
  ASSERT_TRUE(back && back->reached);
  EXPECT_EQ(controls_->moves, 1);
  EXPECT_EQ(back->bound.value, 100.5);
  EXPECT_NE(back->reason.find("backlash is not known"), std::string::npos) << back->reason;
  const auto far = Move(450);
  ASSERT_TRUE(far);
  EXPECT_EQ(far->bound.value, 0.5) << "150 steps up take up more than any such lens has";
  EXPECT_EQ(far->reason, "");
}

/// Whatever the limits, the backlash and the targets: no command leaves the soft limits, every move arrives from the
/// approach side, and what could not be taken up is in the bound.
RC_GTEST_PROP(PolicyProperty, TheTakeUpStaysWithinTheSoftLimits, ()) {
  const int low = *rc::gen::inRange(0, 900);
  const int high = *rc::gen::inRange(low + 1, 1001);
  const int backlash = *rc::gen::inRange(0, 300);
  const bool near = *rc::gen::arbitrary<bool>();
  RigConfig config;
  AxisConfig& focus = config.axes[Axis::Focus];
  focus.limits = {Native{static_cast<double>(low)}, Native{static_cast<double>(high)}};
  focus.backlash = backlash;
  focus.approach_near = near;
  const bool near_positive = *rc::gen::arbitrary<bool>();
  focus.direction = near_positive ? drivers::Direction::NearPositive : drivers::Direction::NearNegative;
  const bool up = near == near_positive;
  SteppedClock clock;
  auto controls = std::make_shared<testing::FakeControls>();
  controls->speed = 1e5;
  auto rig = Rig::Create(config, testing::MakeFakeDevice(clock, controls, *rc::gen::inRange(0, 1001)), clock);
  RC_ASSERT(rig.has_value());
  // Near both ends, mostly.
  const auto target =
      rc::gen::oneOf(rc::gen::inRange(low, std::min(low + 10, high) + 1),
                     rc::gen::inRange(std::max(low, high - 10), high + 1), rc::gen::inRange(low, high + 1));
  for (const int to : *rc::gen::container<std::vector<int>>(target)) {
    controls->focus_targets.clear();
    Answers<MoveOutcome> answers;
    (*rig)->Move(Axis::Focus, At(to), answers.Take());
    const Instant end = clock.Now() + 20s;
    while (answers.all.empty() && clock.Now() < end)
      clock.AdvanceTo(std::max((*rig)->Step(clock.Now()), clock.Now() + 1ms));
    RC_ASSERT(answers.all.size() == 1u);
    RC_ASSERT(answers.all[0].has_value() && answers.all[0]->reached);
    RC_ASSERT(answers.all[0]->position.value == to);
    for (const double commanded : controls->focus_targets) RC_ASSERT(commanded >= low && commanded <= high);
    RC_ASSERT(controls->focus_targets.size() <= 2u);
    const double room = up ? to - low : high - to;
    RC_ASSERT(answers.all[0]->bound.value <= 0.5 + std::max(0.0, backlash - room) + 1e-9);
  }
}

// ---- another hand on the lens -------------------------------------------------------------------------------------

TEST_F(PolicyTest, AnothersMotionIsSeenAndAdopted) {
  Open(WithBacklash(40), 500);
  ASSERT_TRUE(Move(600));
  EXPECT_TRUE(FocusStatus().moved_by_us);
  controls_->foreign_target = 450;
  Run(2s);
  EXPECT_TRUE(FocusStatus().moved_by_another && !FocusStatus().moved_by_us);
  EXPECT_EQ(FocusStatus().position.value, 450.0);
  EXPECT_EQ(FocusStatus().target.value, 450.0);
  EXPECT_EQ(FocusStatus().bound.value, 40.5) << "who knows which way it came";
  const auto relative = rig_->Resolve(Axis::Focus, {.kind = Target::Kind::NativeRelative, .value = 10, .from = {}});
  EXPECT_EQ(relative->value, 460.0);
  ASSERT_TRUE(Move(460));
  EXPECT_FALSE(FocusStatus().moved_by_another);
}

TEST_F(PolicyTest, AMoveThatAnotherTakesAwaySaysSo) {
  Open({}, 100);
  const auto end = TakenAway();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->moved_by_another && !end->reached);
  EXPECT_EQ(end->reason, "moved by another program");
  EXPECT_EQ(controls_->stops, 0) << "the other one's motion is left alone";
}

TEST_F(PolicyTest, WithoutFeedbackAnothersTargetIsSeenAllTheSame) {
  controls_->focus =
      drivers::AxisCapabilities{.maximum = Native{1000.0}, .feedback = drivers::Feedback::None, .backlash = 0.0};
  RigConfig config;
  config.axes[Axis::Focus].speed = 1000.0;
  Open(config, 100);
  const auto end = TakenAway();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->moved_by_another && !end->reached);
}

/// Whoever moved it last is said until somebody moves it again, wherever and how fast the other one goes.
RC_GTEST_PROP(PolicyProperty, WhatAnotherTookAwayStaysItsOwnUntilTheNextMove, ()) {
  const int from = *rc::gen::inRange(350, 651), way = *rc::gen::element(-1, 1);
  const int to = from + way * *rc::gen::inRange(300, 351), elsewhere = from - way * *rc::gen::inRange(50, 351);
  const bool follows = *rc::gen::arbitrary<bool>();
  SteppedClock clock;
  auto controls = std::make_shared<testing::FakeControls>();
  controls->speed = *rc::gen::inRange(200, 2000);
  RigConfig config;
  if (!follows) {
    controls->focus =
        drivers::AxisCapabilities{.maximum = Native{1000.0}, .feedback = drivers::Feedback::None, .backlash = 0.0};
    config.axes[Axis::Focus].speed = controls->speed;
  }
  auto rig = Rig::Create(config, testing::MakeFakeDevice(clock, controls, from), clock);
  RC_ASSERT(rig.has_value());
  const auto run = [&](Duration how_long) {
    for (const Instant end = clock.Now() + how_long; clock.Now() < end;)
      clock.AdvanceTo(std::max((*rig)->Step(clock.Now()), clock.Now() + 1ms));
  };
  const auto focus = [&] { return *(*rig)->GetStatus().axes[Axis::Focus]; };
  run(100ms);
  Answers<MoveOutcome> answers, back;
  (*rig)->Move(Axis::Focus, At(to), answers.Take());
  run(50ms);
  controls->foreign_target = elsewhere;
  for (int i = 0; i < 100'000 && answers.all.empty(); ++i) run(1ms);
  RC_ASSERT(answers.all.size() == 1u && answers.all[0].has_value());
  RC_PRE(answers.all[0]->moved_by_another);
  for (int i = 0; i < 30; ++i) {
    RC_ASSERT(focus().moved_by_another && !focus().moved_by_us);
    run(100ms);
  }
  (*rig)->Move(Axis::Focus, At(from), back.Take());
  for (int i = 0; i < 100'000 && back.all.empty(); ++i) run(1ms);
  RC_ASSERT(back.all.size() == 1u && back.all[0].has_value());
  if (back.all[0]->reached) RC_ASSERT(focus().moved_by_us && !focus().moved_by_another);
}

// ---- storms -------------------------------------------------------------------------------------------------------

TEST_F(PolicyTest, AThousandTargetsASecondEndAtTheLastWithItsBacklashTakenUp) {
  Open(WithBacklash(40), 500);
  std::mt19937 random(11);
  constexpr int kCommands = 10000;
  std::vector<int> answered(kCommands, 0);
  std::optional<MoveOutcome> last;
  double to = 0;
  for (int i = 0; i < kCommands; ++i) {
    to = std::uniform_int_distribution(0, 1000)(random);
    rig_->Move(Axis::Focus, At(to), [&, i](Result<MoveOutcome> answer) {
      ++answered[i];
      if (answer) last = *answer;
    });
    Run(1ms);
  }
  Run(5s);
  EXPECT_EQ(std::count(answered.begin(), answered.end(), 1), kCommands);
  ASSERT_TRUE(last && last->verified);
  EXPECT_EQ(last->position.value, to);
  EXPECT_EQ(last->bound.value, to >= 40 ? 0.5 : 40.5 - to);
}

}  // namespace
}  // namespace lensd::rig
