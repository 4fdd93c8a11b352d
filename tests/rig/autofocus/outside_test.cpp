// Autofocus with frames that a client's camera takes: the same answer as with the lens' own, frame for frame, and
// nothing but frames of the lens standing where they were wanted.
#include <chrono>

#include "autofocus/session.h"
#include "sim/scene.h"
#include "sim/world.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

/// Forwards, and keeps the last frame it handed out.
class KeepingCamera final : public drivers::Camera {
 public:
  KeepingCamera(std::unique_ptr<drivers::Camera> inner, std::shared_ptr<drivers::Frame> last)
      : Camera(inner->capabilities()), inner_(std::move(inner)), last_(std::move(last)) {}

 private:
  Result<void> DoStart() override { return inner_->Start(); }
  Result<void> DoStop() override { return inner_->Stop(); }
  Result<std::optional<drivers::Frame>> DoPoll() override {
    auto frame = inner_->Poll();
    if (frame && *frame) *last_ = **frame;
    return frame;
  }
  std::unique_ptr<drivers::Camera> inner_;
  std::shared_ptr<drivers::Frame> last_;
};

struct Step {
  double position = 0.0;
  drivers::Frame frame;
};
struct Story {
  std::vector<Step> steps;
  int twice = 0;  ///< frames that were asked for once more where the lens stood, of a camera whose lag is not known
  Result<AutofocusOutcome> end = Fail(Code::Internal, "did not end");
};

class SameAsBuiltIn : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    auto scene = sim::LoadScene(std::string(LENSD_SOURCE_DIR) + "/scenes/" + GetParam());
    ASSERT_TRUE(scene) << scene.error().message;
    scene_ = std::make_shared<const sim::Scene>(*std::move(scene));
    pictures_ = *sim::Pictures::Create(scene_);
  }

  sim::World Open(SteppedClock& clock, double start) {
    return *sim::OpenWorld(scene_, clock, {.seed = 7, .focus_start = Native{start}, .pictures = pictures_});
  }

  static void RunToEnd(Rig& rig, SteppedClock& clock, const Answers<AutofocusOutcome>& answers, auto between) {
    while (answers.all.empty() && clock.Now() < Instant{200s}) {
      const Instant next = rig.Step(clock.Now());
      between();
      clock.AdvanceTo(std::max(next, clock.Now() + 100us));
    }
  }

  Story BuiltIn(double start) {
    Story story;
    SteppedClock clock;
    auto world = Open(clock, start);
    auto last = std::make_shared<drivers::Frame>();
    world.device.camera = std::make_unique<KeepingCamera>(std::move(world.device.camera), last);
    auto rig = *Rig::Create({}, std::move(world.device), clock);
    Answers<AutofocusOutcome> answers;
    rig->Autofocus(
        {}, [&](const AutofocusProgress& now) { story.steps.push_back({now.position.value, *last}); }, answers.Take());
    RunToEnd(*rig, clock, answers, [] {});
    story.end = answers.only();
    return story;
  }

  /// The pictures of `before` given from outside to a lens without a camera. `cut`: only the region of them.
  Story Outside(double start, const Story& before, drivers::Region region) {
    Story story;
    SteppedClock clock;
    auto world = Open(clock, start);
    const double pixel_um = world.device.camera->capabilities().pixel_um;
    world.device.camera.reset();
    auto rig = *Rig::Create({}, std::move(world.device), clock);
    std::optional<FrameWanted> wanted;
    AutofocusRequest request;
    request.regions = {region};
    request.outside = OutsideCamera{
        .pixel_um = pixel_um, .scores_only = false, .wanted = [&](const FrameWanted& now) { wanted = now; }};
    Answers<AutofocusOutcome> answers;
    rig->Autofocus(std::move(request), nullptr, answers.Take());
    RunToEnd(*rig, clock, answers, [&] {
      if (!wanted) return;
      const std::size_t count = story.steps.size();
      const bool here = count > 0 && story.steps.back().position == wanted->position.value;
      const bool again =
          here && (count == before.steps.size() || before.steps[count].position != wanted->position.value);
      if (!again && count == before.steps.size()) return;
      drivers::Frame frame = before.steps[again ? count - 1 : count].frame;
      again ? void(++story.twice) : story.steps.push_back({wanted->position.value, frame});
      EXPECT_EQ(wanted->number, static_cast<int>(story.steps.size()) + story.twice);
      const Duration exposure = frame.exposure_end - frame.exposure_start;
      frame.exposure_start = std::max(clock.Now(), wanted->since);
      frame.exposure_end = frame.exposure_start + exposure;
      clock.AdvanceTo(frame.exposure_end);
      wanted.reset();
      rig->GiveFrame(std::move(frame), [](const Result<void>& taken) { EXPECT_TRUE(taken) << taken.error().message; });
    });
    if (!answers.all.empty()) story.end = answers.only();
    return story;
  }

  std::shared_ptr<const sim::Scene> scene_;
  std::shared_ptr<sim::Pictures> pictures_;
};

TEST_P(SameAsBuiltIn, FrameForFrame) {
  const auto& r = scene_->truth_region;
  for (const double part : {0.1, 0.5, 0.9}) {
    const double start = std::floor(part * scene_->lens.steps);
    const Story one = BuiltIn(start);
    const Story other = Outside(start, one, {r.x, r.y, r.w, r.h});
    ASSERT_TRUE(one.end);
    ASSERT_TRUE(other.end) << other.end.error().message;
    ASSERT_EQ(one.steps.size(), other.steps.size());
    for (std::size_t i = 0; i < one.steps.size(); ++i) EXPECT_EQ(one.steps[i].position, other.steps[i].position) << i;
    EXPECT_EQ(one.end->focused, other.end->focused);
    EXPECT_EQ(one.end->method, other.end->method);
    EXPECT_EQ(one.end->frames + other.twice, other.end->frames);
    // One after the first long move, two at the end, and up to two for each of three doubts in vain (a blank scene).
    EXPECT_LE(other.twice, 9);
    EXPECT_EQ(one.end->moves, other.end->moves);
    EXPECT_EQ(one.end->position, other.end->position);
    EXPECT_EQ(one.end->confidence, other.end->confidence);
    EXPECT_EQ(one.end->reason, other.end->reason);
    ASSERT_EQ(one.end->sigma.has_value(), other.end->sigma.has_value());
    if (one.end->sigma) {
      EXPECT_EQ(one.end->sigma->value, other.end->sigma->value);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, SameAsBuiltIn,
                         ::testing::Values("tune/brick.toml", "tune/gravel-dim.toml", "blank.toml"),
                         [](const auto& scene) {
                           std::string name = scene.param;
                           std::erase_if(name, [](char c) { return std::isalnum(c) == 0; });
                           return name;
                         });

class OutsideTest : public RigTest {
 protected:
  void TearDown() override { rig_.reset(); }  // who still waits is told, while there is somewhere to tell it
  /// A session of scores on the fake lens, which has a camera that must not stream.
  void Begin(bool scores = true, std::string method = "auto", std::optional<Duration> deadline = Duration(60s)) {
    AutofocusRequest request;
    request.method = std::move(method);
    request.deadline = deadline;
    request.outside = OutsideCamera{
        .pixel_um = 5.0, .scores_only = scores, .wanted = [this](const FrameWanted& now) { wanted_ = now; }};
    rig_->Autofocus(std::move(request), nullptr, answers_.Take());
  }
  void RunUntilWanted() {
    for (int i = 0; i < 20000 && !wanted_ && answers_.all.empty(); ++i) Run(1ms);
  }
  Result<void> Score(double sharpness, Duration since_wanted = 0ms) {
    const Instant start = wanted_->since + since_wanted;
    clock_.AdvanceTo(start + 5ms);
    std::optional<Result<void>> answer;
    rig_->GiveScore({sharpness, 0.01 * sharpness, start, start + 5ms},
                    [&](Result<void> taken) { answer = std::move(taken); });
    const FrameWanted before = *std::exchange(wanted_, std::nullopt);
    for (int i = 0; i < 100 && !answer; ++i) Run(1ms);
    EXPECT_TRUE(answer);
    if (!answer || !*answer) wanted_ = before;
    return answer.value_or(Fail(Code::Internal, "no answer"));
  }
  double SharpnessHere() {
    const double blur = (Focus() - controls_->sharp_at) / 20.0;
    return 1.0 / (1.0 + blur * blur);
  }
  Answers<AutofocusOutcome> answers_;
  std::optional<FrameWanted> wanted_;
};

TEST_F(OutsideTest, ScoresOfAnyScaleFindTheSubject) {
  for (const double unit : {1e-6, 1.0, 1e9}) {
    Open();
    answers_.all.clear();
    wanted_.reset();
    Begin();
    while (answers_.all.empty()) {
      RunUntilWanted();
      if (answers_.all.empty()) {
        ASSERT_TRUE(wanted_);
        ASSERT_TRUE(Score(unit * SharpnessHere()));
      }
    }
    ASSERT_TRUE(answers_.only());
    EXPECT_TRUE(answers_.only()->focused) << answers_.only()->reason;
    EXPECT_EQ(answers_.only()->method, "sweep");
    EXPECT_NEAR(answers_.only()->position.value, 600.0, 10.0);
    EXPECT_EQ(controls_->camera_starts, 0);
  }
}

TEST_F(OutsideTest, AnExposureThatBeganTooEarlyIsRefusedAndTheFrameIsStillWanted) {
  Open();
  Begin();
  RunUntilWanted();
  ASSERT_TRUE(wanted_);
  Run(20ms);
  const int number = wanted_->number;
  const auto early = Score(1.0, -1ms);
  ASSERT_FALSE(early);
  EXPECT_EQ(early.error().code, Code::InvalidArgument);
  EXPECT_NE(early.error().message.find("1000 us before"), std::string::npos) << early.error().message;
  ASSERT_TRUE(Score(1.0));
  RunUntilWanted();
  EXPECT_EQ(wanted_->number, number + 1);
}

TEST_F(OutsideTest, WhatDoesNotFitIsRefused) {
  Open();
  EXPECT_EQ(answers_.all.size(), 0u);
  std::optional<Result<void>> taken;
  rig_->GiveScore({1.0, 0.1, {}, {}}, [&](Result<void> answer) { taken = std::move(answer); });
  Run(5ms);
  ASSERT_TRUE(taken);
  EXPECT_FALSE(*taken);  // no session

  Begin(true, "defocus");
  Run(5ms);
  EXPECT_EQ(answers_.only().error().code, Code::InvalidArgument);
  answers_.all.clear();

  Begin(false);
  RunUntilWanted();
  EXPECT_FALSE(Score(1.0));  // pictures were promised
  drivers::Frame small;
  small.width = small.height = 8;
  small.samples = std::make_shared<std::vector<std::uint16_t>>(64, 100);
  small.exposure_start = small.exposure_end = clock_.Now();
  rig_->GiveFrame(small, [&](Result<void> answer) { taken = std::move(answer); });
  Run(5ms);
  EXPECT_FALSE(*taken);
  EXPECT_NE(taken->error().message.find("16 x 16"), std::string::npos) << taken->error().message;
}

TEST_F(OutsideTest, PicturesMustKeepTheirSize) {
  Open();
  Begin(false);
  for (const int size : {64, 32}) {
    RunUntilWanted();
    ASSERT_TRUE(wanted_);
    drivers::Frame frame;
    frame.width = frame.height = size;
    frame.samples = std::make_shared<std::vector<std::uint16_t>>(static_cast<std::size_t>(size * size), 100);
    frame.exposure_start = wanted_->since;
    frame.exposure_end = clock_.Now();
    wanted_.reset();
    std::optional<Result<void>> taken;
    rig_->GiveFrame(frame, [&](Result<void> answer) { taken = std::move(answer); });
    Run(5ms);
    ASSERT_TRUE(taken);
    EXPECT_EQ(taken->has_value(), size == 64);
  }
  EXPECT_TRUE(answers_.all.empty());
}

TEST_F(OutsideTest, AnotherCommandOrTheDeadlineEndsIt) {
  Open({}, 321);
  Begin();
  RunUntilWanted();
  Answers<MoveOutcome> moved;
  rig_->Move(Axis::Focus, At(500), moved.Take());
  RunUntil(moved);
  EXPECT_EQ(answers_.only().error().code, Code::Superseded);

  Open({}, 321);
  answers_.all.clear();
  wanted_.reset();
  Begin(true, "auto", 3s);
  RunUntilWanted();
  ASSERT_TRUE(Score(1.0));
  RunUntil(answers_, 30s);
  ASSERT_TRUE(answers_.only());
  EXPECT_FALSE(answers_.only()->focused);
  EXPECT_NE(answers_.only()->reason.find("deadline"), std::string::npos);
  EXPECT_NEAR(Focus(), 321.0, 1.0);
}

// Frames every four seconds: a search takes longer than the minute that a quick one has.
TEST_F(OutsideTest, TheDeadlineFollowsHowOftenFramesCome) {
  Open();
  Begin(true, "sweep", std::nullopt);
  while (answers_.all.empty()) {
    RunUntilWanted();
    if (!answers_.all.empty()) break;
    ASSERT_TRUE(wanted_);
    ASSERT_EQ(wanted_->samples.size(), static_cast<std::size_t>(wanted_->number - 1));
    ASSERT_TRUE(Score(SharpnessHere(), 4s));
  }
  ASSERT_TRUE(answers_.only());
  EXPECT_TRUE(answers_.only()->focused) << answers_.only()->reason;
  EXPECT_GT(answers_.only()->elapsed, 60s);
  EXPECT_NEAR(answers_.only()->position.value, 600.0, 10.0);
}

// A client that falls silent is waited for a minute before its first frame, and never for more than an hour.
TEST_F(OutsideTest, SilenceHasAnEnd) {
  Open();
  Begin(true, "sweep", std::nullopt);
  RunUntil(answers_, 70s);
  ASSERT_TRUE(answers_.only());
  EXPECT_EQ(answers_.only()->cause, autofocus::Cause::Deadline);
  EXPECT_NEAR(std::chrono::duration<double>(answers_.only()->elapsed).count(), 60.0, 1.0);
}

TEST_F(OutsideTest, RangeAndStepHoldForFramesFromOutside) {
  Open();
  AutofocusRequest request;
  request.outside =
      OutsideCamera{.pixel_um = 5.0, .scores_only = true, .wanted = [this](const FrameWanted& now) { wanted_ = now; }};
  request.range = {At(400.0), At(900.0)};
  request.step = SearchStep{SearchStep::Kind::Native, 25.0};
  rig_->Autofocus(std::move(request), nullptr, answers_.Take());
  std::vector<double> places;
  while (answers_.all.empty()) {
    RunUntilWanted();
    if (!answers_.all.empty()) break;
    ASSERT_TRUE(wanted_);
    places.push_back(wanted_->position.value);
    ASSERT_TRUE(Score(SharpnessHere()));
  }
  ASSERT_TRUE(answers_.only());
  EXPECT_TRUE(answers_.only()->focused) << answers_.only()->reason;
  EXPECT_EQ(answers_.only()->samples.size(), places.size());
  EXPECT_EQ(places.front(), 400.0);  // the lens stood outside
  for (std::size_t i = 0; i <= 20; ++i) EXPECT_NEAR(places.at(i + 1), 400.0 + 25.0 * static_cast<double>(i), 1.0);
  EXPECT_LE(*std::ranges::max_element(places), 900.0);
}

}  // namespace
}  // namespace lensd::rig
