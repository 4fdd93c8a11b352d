// Autofocus and frames through a rig: what is promised about them whatever happens on the way.
#include <algorithm>
#include <chrono>

#include "autofocus/session.h"
#include "tests/rig/rig_fixture.h"

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
  EXPECT_NE(answers.only()->reason.find("deadline, 2 s: a search of the whole range may take"), std::string::npos)
      << answers.only()->reason;
  EXPECT_NEAR(Focus(), 321.0, 1.0);
  // Two seconds of search, then the way back with its take-up.
  EXPECT_LE(answers.only()->elapsed, 2s + 4s);
}

TEST_F(RigAutofocusTest, TheCurveSoFarComesWithEveryFrameAndWithTheAnswer) {
  Open();
  const auto answers = Autofocus();
  ASSERT_TRUE(answers.only());
  const AutofocusOutcome& outcome = *answers.only();
  ASSERT_TRUE(outcome.focused) << outcome.reason;
  for (std::size_t i = 0; i < progress_.size(); ++i) {
    ASSERT_EQ(progress_[i].samples.size(), i + 1);
    EXPECT_EQ(progress_[i].samples.back().position, progress_[i].position);
  }
  ASSERT_EQ(outcome.samples.size(), progress_.size());
  const auto sharpest = std::ranges::max_element(outcome.samples, {}, &AutofocusSample::score);
  EXPECT_NEAR(sharpest->position.value, 600.0, 5.0);
  Instant last{};
  for (std::size_t i = 0; i < outcome.samples.size(); ++i) {
    const AutofocusSample& sample = outcome.samples[i];
    EXPECT_EQ(sample.frame, static_cast<int>(i));
    EXPECT_EQ(sample.region, 0);
    EXPECT_EQ(sample.state, AutofocusSample::State::Standing);
    EXPECT_GT(sample.bound.value, 0.0);
    EXPECT_NEAR(sample.vergence->value, sample.position.value * 1e-6 / (0.025 * (0.025 + sample.position.value * 1e-6)),
                1e-9);
    EXPECT_GT(sample.score_sigma, 0.0);
    EXPECT_GE(sample.exposure_start, last);
    EXPECT_EQ(sample.exposure_end - sample.exposure_start, 5ms);
    last = sample.exposure_end;
  }
  ASSERT_TRUE(outcome.subject);
  EXPECT_EQ(outcome.subject->by, autofocus::FoundBy::Sharpness);
  EXPECT_EQ(outcome.subject->region, 0);
  EXPECT_NEAR(outcome.subject->position.value, 600.0, 5.0);
  EXPECT_NEAR(outcome.subject->vergence->value, 0.6e-3 / (0.025 * 0.0256), 0.01);
  EXPECT_GT(outcome.subject->sigma->value, 0.0);
}

TEST_F(RigAutofocusTest, NoFrameIsTakenOutsideOfTheRange) {
  for (const char* method : {"auto", "sweep", "moving", "fibonacci"}) {
    controls_->told_rate_hz = 100.0;
    RigConfig config;
    config.axes[Axis::Focus].speed = 1000.0;
    Open(config, 100.0);
    AutofocusRequest request;
    request.method = method;
    request.range = {At(800.0), At(450.0)};
    const auto answers = Autofocus(request);
    ASSERT_TRUE(answers.only()) << method << answers.only().error().message;
    EXPECT_TRUE(answers.only()->focused) << method << ": " << answers.only()->reason;
    EXPECT_NEAR(answers.only()->position.value, 600.0, 5.0) << method;
    for (const AutofocusSample& sample : answers.only()->samples) {
      EXPECT_GE(sample.position.value, 450.0 - 1.0) << method;
      EXPECT_LE(sample.position.value, 800.0 + 1.0) << method;
    }
  }
}

TEST_F(RigAutofocusTest, ASubjectOutsideOfTheRangeIsRefusedAsThatAndTheLensGoesBack) {
  Open({}, 100.0);
  AutofocusRequest request;
  request.range = {At(200.0), At(570.0)};
  const auto answers = Autofocus(request);
  ASSERT_TRUE(answers.only());
  EXPECT_FALSE(answers.only()->focused);
  EXPECT_EQ(answers.only()->cause, autofocus::Cause::EndOfTravel) << answers.only()->reason;
  EXPECT_NE(answers.only()->reason.find("the range asked for"), std::string::npos) << answers.only()->reason;
  EXPECT_FALSE(answers.only()->subject);
  EXPECT_FALSE(answers.only()->samples.empty());
  EXPECT_NEAR(Focus(), 100.0, 1.0);
}

TEST_F(RigAutofocusTest, TheFirstPassGoesByTheStep) {
  for (const SearchStep step :
       {SearchStep{SearchStep::Kind::Native, 50.0}, SearchStep{SearchStep::Kind::Extension, 50e-6},
        SearchStep{SearchStep::Kind::Blur, 5.0}}) {
    Open();
    AutofocusRequest request;
    request.step = step;
    const auto answers = Autofocus(request);
    ASSERT_TRUE(answers.only()) << answers.only().error().message;
    const AutofocusOutcome& outcome = *answers.only();
    EXPECT_TRUE(outcome.focused) << outcome.reason;
    EXPECT_EQ(outcome.method, "sweep");
    // 1 mm of travel in steps of 50 um (of a blur of 5 px at f/2 with 5 um pixels): 21 places after the first frame.
    for (std::size_t i = 0; i < 21; ++i) {
      EXPECT_NEAR(outcome.samples.at(i + 1).position.value, 50.0 * static_cast<double>(i), 1.0) << i;
    }
    EXPECT_LT(outcome.samples.at(22).position.value, 700.0);  // the finer pass begins
  }
}

TEST_F(RigAutofocusTest, AStepThatCannotBeIsRefusedWithWhatCan) {
  Open();
  struct {
    SearchStep step;
    const char* parameter;
    double least, most;
    const char* unit;
  } const cases[] = {{{SearchStep::Kind::Native, 0.4}, "step.relative", 1.0, 250.0, "steps"},
                     {{SearchStep::Kind::Native, 260.0}, "step.relative", 1.0, 250.0, "steps"},
                     {{SearchStep::Kind::Extension, 0.5e-6}, "step.extensionUm", 1.0, 250.0, "um"},
                     {{SearchStep::Kind::Blur, 26.0}, "step.blurPx", 0.1, 25.0, "px"}};
  for (const auto& one : cases) {
    AutofocusRequest request;
    request.step = one.step;
    const auto answers = Autofocus(request);
    ASSERT_FALSE(answers.only());
    const Error& error = answers.only().error();
    EXPECT_EQ(error.code, Code::OutOfRange);
    EXPECT_EQ(error.facts->parameter, one.parameter);
    EXPECT_NEAR(*error.facts->minimum, one.least, 1e-9);
    EXPECT_NEAR(*error.facts->maximum, one.most, 1e-9);
    EXPECT_EQ(error.facts->unit, one.unit);
  }
  AutofocusRequest chosen;
  chosen.step = SearchStep{SearchStep::Kind::Native, 20.0};
  chosen.method = "defocus";
  EXPECT_EQ(Autofocus(chosen).only().error().code, Code::InvalidArgument);
  chosen.method = "hill-climb";
  EXPECT_TRUE(Autofocus(chosen).only());
  chosen.step->value = 15.0;  // its finest would be less than a position
  EXPECT_EQ(Autofocus(chosen).only().error().code, Code::OutOfRange);
}

TEST_F(RigAutofocusTest, ARangeOutsideOfTheTravelIsRefusedWithTheTravel) {
  Open();
  for (const bool first : {true, false}) {
    AutofocusRequest request;
    request.range = {At(first ? 1400.0 : 100.0), At(first ? 100.0 : 1400.0)};
    const auto answers = Autofocus(request);
    ASSERT_FALSE(answers.only());
    const Error& error = answers.only().error();
    EXPECT_EQ(error.code, Code::OutOfRange);
    EXPECT_EQ(error.facts->parameter, first ? "range.from" : "range.to");
    EXPECT_EQ(error.facts->minimum, 0.0);
    EXPECT_EQ(error.facts->maximum, 1000.0);
  }
  AutofocusRequest nothing;
  nothing.range = {At(300.0), At(300.0)};
  EXPECT_EQ(Autofocus(nothing).only().error().code, Code::InvalidArgument);
}

TEST_F(RigAutofocusTest, ADeadlineTooShortForAnySearchSaysHowLongOneTakes) {
  controls_->told_rate_hz = 100.0;
  Open();
  AutofocusRequest request;
  request.deadline = 10ms;
  const auto answers = Autofocus(request);
  ASSERT_FALSE(answers.only());
  const Error& error = answers.only().error();
  EXPECT_EQ(error.code, Code::OutOfRange);
  EXPECT_EQ(error.facts->parameter, "deadlineMs");
  EXPECT_GT(*error.facts->minimum, 10.0);
  EXPECT_NE(error.message.find("frames of"), std::string::npos) << error.message;
  EXPECT_NE(error.message.find("whole range"), std::string::npos) << error.message;
  EXPECT_EQ(controls_->moves, 0);
  // What is just long enough by that figure is tried.
  request.deadline =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(*error.facts->minimum));
  EXPECT_TRUE(Autofocus(request).only());
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
  EXPECT_NE(answers.only()->reason.find("could not be moved back"), std::string::npos) << answers.only()->reason;
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
