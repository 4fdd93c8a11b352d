// Focus while moving: frames of a lens under way, each told where it was, and the answer that comes of them.
#include <chrono>
#include <cmath>
#include <deque>

#include "rig_on_sim.h"
#include "test_level.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

std::shared_ptr<sim::Pictures> Bricks(double backlash = 0.0, double speed = 8000.0) {
  auto scene = sim::LoadScene(std::string(LENSD_SOURCE_DIR) + "/scenes/tune/brick.toml");
  EXPECT_TRUE(scene) << scene.error().message;
  scene->lens.backlash_steps = backlash;
  scene->lens.speed_steps_per_s = speed;
  return *sim::Pictures::Create(std::make_shared<const sim::Scene>(*std::move(scene)));
}

Result<sim::World> WorldOf(const std::shared_ptr<sim::Pictures>& pictures, const Clock& clock, double start,
                           std::uint64_t seed) {
  return sim::OpenWorld(std::shared_ptr<const sim::Scene>(pictures, &pictures->scene()), clock,
                        {.seed = seed, .focus_start = Native{start}, .pictures = pictures});
}

/// Says of every reading that it is of now, though it is `age` old: a device with a slow answer.
class LateLens final : public drivers::Lens {
 public:
  LateLens(std::unique_ptr<drivers::Lens> inner, const Clock& clock, Duration age)
      : Lens(inner->capabilities()), inner_(std::move(inner)), clock_(clock), age_(age) {}

 private:
  Result<void> DoStartHome(Axis axis) override { return inner_->StartHome(axis); }
  Result<void> DoStartMove(Axis axis, Native target) override { return inner_->StartMove(axis, target); }
  Result<void> DoStop(Axis axis) override { return inner_->Stop(axis); }
  Result<drivers::LensState> DoRead() override {
    auto read = inner_->Read();
    if (!read) return read;
    readings_.push_back(*read);
    while (readings_.size() > 1 && readings_[1].sampled_at <= clock_.Now() - age_) readings_.pop_front();
    drivers::LensState late = readings_.front();
    late.sampled_at = clock_.Now();
    return late;
  }
  std::unique_ptr<drivers::Lens> inner_;
  const Clock& clock_;
  Duration age_;
  std::deque<drivers::LensState> readings_;
};

struct Ran {
  AutofocusOutcome outcome;
  double error_px = 0.0;  ///< of blur, where the lens stands in truth
  double end = 0.0;
};

Ran RunMoving(const std::shared_ptr<sim::Pictures>& scene, double start, std::uint64_t seed, bool optics = true,
              Duration age = {}, Duration latency = {}) {
  SteppedClock clock;
  auto world = WorldOf(scene, clock, start, seed);
  EXPECT_TRUE(world);
  if (!optics) world->device.optics.reset();
  if (age > Duration::zero()) {
    world->device.lens = std::make_unique<LateLens>(std::move(world->device.lens), clock, age);
  }
  RigConfig config;
  config.axes[Axis::Focus].latency = latency;
  auto rig = Rig::Create(config, std::move(world->device), clock);
  EXPECT_TRUE(rig) << rig.error().message;
  Answers<AutofocusOutcome> answers;
  AutofocusRequest request;
  request.method = "moving";
  (*rig)->Autofocus(std::move(request), nullptr, answers.Take());
  while (answers.all.empty() && clock.Now() < Instant{100s}) clock.AdvanceTo((*rig)->Step(clock.Now()));
  Ran ran;
  EXPECT_TRUE(answers.only()) << answers.only().error().message;
  if (!answers.only()) return ran;
  ran.outcome = *answers.only();
  const sim::TrueState state = world->truth->Now();
  ran.error_px = 2.0 * std::abs(state.focal_plane_d - world->truth->subjects().front().vergence_d) /
                 sim::HalfDepthOfFieldD(scene->scene().camera, state);
  ran.end = ran.outcome.position.value;
  return ran;
}

TEST(Moving, FindsTheSubjectFromAnywhere) {
  const auto scene = Bricks();
  const int runs = testing::ByLevel(3, 6, 100);
  for (int i = 0; i < runs; ++i) {
    const double start = 4095.0 * i / std::max(runs - 1, 1);
    const Ran ran = RunMoving(scene, start, static_cast<std::uint64_t>(i) + 1);
    EXPECT_TRUE(ran.outcome.focused) << start << ": " << ran.outcome.reason;
    EXPECT_LE(ran.error_px, 1.0) << start;
    EXPECT_EQ(ran.outcome.method, "moving");
    // The range is 103 px of blur: a pass with a stop at every frame would be as many motions.
    EXPECT_LE(ran.outcome.frames, 60);
    EXPECT_LE(ran.outcome.moves, 5);
  }
}

TEST(Moving, WorksInNativeUnits) {
  const Ran ran = RunMoving(Bricks(), 500, 7, false);
  EXPECT_TRUE(ran.outcome.focused) << ran.outcome.reason;
  EXPECT_LE(ran.error_px, 1.0);
}

TEST(Moving, BacklashShiftsNothing) {
  const Ran ran = RunMoving(Bricks(100), 3000, 3);
  EXPECT_TRUE(ran.outcome.focused) << ran.outcome.reason;
  EXPECT_LE(ran.error_px, 1.0);
}

// 10 ms at full speed are 80 steps, or two pixels of blur.
TEST(Moving, PositionsAreThoseOfTheExposure) {
  const Ran ran = RunMoving(Bricks(), 3000, 3, true, 10ms, 10ms);
  EXPECT_TRUE(ran.outcome.focused) << ran.outcome.reason;
  EXPECT_LE(ran.error_px, 1.0);
  const Ran unaware = RunMoving(Bricks(), 3000, 3, true, 10ms);
  if (unaware.outcome.focused) {
    EXPECT_GT(unaware.error_px, ran.error_px);
    EXPECT_LE(unaware.error_px, 4.0);
  }
}

// A fast lens goes on slowly: three frames over its range would show no peak.
TEST(Moving, AFastLensIsPaced) {
  const Ran ran = RunMoving(Bricks(0, 80000.0), 3000, 3);
  EXPECT_TRUE(ran.outcome.focused) << ran.outcome.reason;
  EXPECT_LE(ran.error_px, 1.0);
  EXPECT_GE(ran.outcome.frames, 30);
}

TEST(Moving, FramesKnowWhereTheLensWas) {
  const auto scene = Bricks();
  SteppedClock clock;
  auto world = WorldOf(scene, clock, 3000, 1);
  auto rig = *Rig::Create({}, std::move(world->device), clock);
  AutofocusRequest request;
  request.method = "moving";
  int in_motion = 0;
  Answers<AutofocusOutcome> answers;
  std::deque<std::pair<Instant, double>> truth;
  const auto note = [&](const AutofocusProgress& now) {
    if (now.frames < 3 || !rig->GetStatus().axes[Axis::Focus]->moving) return;
    // In the middle of an exposure that ended one or two readings ago the lens was there within a few steps.
    while (truth.front().first < clock.Now() - 40ms) truth.pop_front();
    const auto nearest =
        std::ranges::min_element(truth, {}, [&](const auto& was) { return std::abs(was.second - now.position.value); });
    ++in_motion;
    EXPECT_NEAR(nearest->second, now.position.value, 16.0);
    const double age_ms = std::chrono::duration<double, std::milli>(clock.Now() - nearest->first).count();
    EXPECT_GE(age_ms, 4.0);  // half an exposure at least
    EXPECT_LE(age_ms, 14.0);
  };
  rig->Autofocus(std::move(request), note, answers.Take());
  while (answers.all.empty() && clock.Now() < Instant{100s}) {
    const Instant next = rig->Step(clock.Now());
    truth.emplace_back(clock.Now(), rig->GetStatus().axes[Axis::Focus]->position.value);
    clock.AdvanceTo(next);
  }
  ASSERT_TRUE(answers.only());
  EXPECT_GE(in_motion, 20);
}

class MovingFakeTest : public RigTest {};

TEST_F(MovingFakeTest, RefusesALensThatCannotBeToldInMotion) {
  AutofocusRequest request;
  request.method = "moving";
  const auto refused = [&] {
    Answers<AutofocusOutcome> answers;
    auto rig = *Rig::Create({}, testing::MakeFakeDevice(clock_, controls_), clock_);
    rig->Autofocus(request, nullptr, answers.Take());
    rig->Step(clock_.Now());
    EXPECT_FALSE(answers.only());
    EXPECT_EQ(answers.only().error().code, Code::Unsupported);
    return answers.only().error().message;
  };
  controls_->focus =
      drivers::AxisCapabilities{.maximum = Native{1000.0}, .feedback = drivers::Feedback::None, .speed = 100.0};
  EXPECT_NE(refused().find("where it is while it moves"), std::string::npos);
  controls_->focus = drivers::AxisCapabilities{.maximum = Native{1000.0}};
  EXPECT_NE(refused().find("speed"), std::string::npos);
  controls_->focus = drivers::AxisCapabilities{.maximum = Native{1000.0}, .speed = 100.0};
  EXPECT_NE(refused().find("frame rate"), std::string::npos);
}

TEST(Moving, StopsAndDeadlinesEndIt) {
  const auto scene = Bricks();
  for (const bool stop : {true, false}) {
    SteppedClock clock;
    auto world = WorldOf(scene, clock, 3000, 1);
    auto rig = *Rig::Create({}, std::move(world->device), clock);
    AutofocusRequest request;
    request.method = "moving";
    request.deadline = 10ms;
    Answers<AutofocusOutcome> refused;
    rig->Autofocus(request, nullptr, refused.Take());
    while (refused.all.empty()) clock.AdvanceTo(rig->Step(clock.Now()));
    // Just as long as its frames alone take: the way to its start is too much.
    const double least = *refused.only().error().facts->minimum;
    request.deadline = std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(least));
    const Instant late = clock.Now() + *request.deadline - 50ms;
    Answers<AutofocusOutcome> answers;
    rig->Autofocus(std::move(request), nullptr, answers.Take());
    while (clock.Now() < late) clock.AdvanceTo(rig->Step(clock.Now()));
    EXPECT_TRUE(answers.all.empty());
    Answers<void> stopped;
    if (stop) rig->Stop({}, stopped.Take());
    while (answers.all.empty() && clock.Now() < Instant{100s}) clock.AdvanceTo(rig->Step(clock.Now()));
    if (stop) {
      EXPECT_EQ(answers.only().error().code, Code::Cancelled);
      continue;
    }
    ASSERT_TRUE(answers.only());
    EXPECT_FALSE(answers.only()->focused);
    EXPECT_NEAR(answers.only()->position.value, 3000.0, 1.0);
  }
}

}  // namespace
}  // namespace lensd::rig
