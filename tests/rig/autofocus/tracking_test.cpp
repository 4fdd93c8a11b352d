// Tracking: focus held on a wall that moves, and a lens left alone before one that does not.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "autofocus/tracker.h"
#include "sim/scene.h"
#include "sim/world.h"
#include "test_level.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

struct Watched {
  std::vector<AutofocusOutcome> told;
  std::vector<double> errors;  ///< in whole depths of field, every 20 ms from the first answer on
  int moves = 0;
  int idle_motions = 0;  ///< readings of the lens moving or elsewhere while no search was under way
  std::optional<Result<AutofocusOutcome>> end;
};

Watched Track(double sway_m, double sway_s, Duration for_so_long, double rate_hz = 60.0, double start = 2500) {
  auto scene = sim::LoadScene(std::string(LENSD_SOURCE_DIR) + "/scenes/tune/brick.toml");
  EXPECT_TRUE(scene) << scene.error().message;
  scene->surfaces.front().sway_m = sway_m;
  scene->surfaces.front().sway_s = sway_s;
  scene->camera.frame_rate_hz = rate_hz;
  const auto shared = std::make_shared<const sim::Scene>(*std::move(scene));
  SteppedClock clock;
  auto world = sim::OpenWorld(shared, clock, {.seed = 5, .focus_start = Native{start}, .pictures = {}});
  auto rig = *Rig::Create({}, std::move(world->device), clock);
  Watched watched;
  AutofocusRequest request;
  request.track = [&](const AutofocusOutcome& outcome) {
    watched.told.push_back(outcome);
    watched.moves += outcome.moves;
  };
  rig->Autofocus(std::move(request), nullptr, [&](Result<AutofocusOutcome> outcome) { watched.end = outcome; });
  Instant next_score{};
  while (clock.Now() < Instant{for_so_long} && !watched.end) {
    clock.AdvanceTo(rig->Step(clock.Now()));
    if (watched.told.empty() || clock.Now() < next_score) continue;
    next_score = clock.Now() + 20ms;
    const AxisStatus focus = *rig->GetStatus().axes[Axis::Focus];
    watched.idle_motions += watched.told.size() == 1 && (focus.moving || focus.position != watched.told[0].position);
    const sim::TrueState state = world->truth->Now();
    const double subject_d = world->truth->subjects().front().vergence_d + state.sway_d;
    watched.errors.push_back(std::abs(state.focal_plane_d - subject_d) /
                             (2.0 * sim::HalfDepthOfFieldD(shared->camera, state)));
  }
  EXPECT_FALSE(watched.end);
  rig->Stop({}, [](const Result<void>&) {});
  rig->Step(clock.Now());
  EXPECT_TRUE(watched.end);
  if (watched.end) {
    EXPECT_FALSE(*watched.end);
  }
  return watched;
}

double Share(const std::vector<double>& errors, double at_most) {
  return static_cast<double>(std::ranges::count_if(errors, [&](double error) { return error <= at_most; })) /
         static_cast<double>(errors.size());
}

TEST(Tracking, LeavesTheLensAloneBeforeAStillSubject) {
  const Watched watched = Track(0.0, 10.0, std::chrono::seconds(testing::ByLevel(20, 60, 60)), 20.0);
  ASSERT_EQ(watched.told.size(), 1u);
  EXPECT_EQ(watched.idle_motions, 0);
  EXPECT_TRUE(watched.told.front().focused) << watched.told.front().reason;
  EXPECT_EQ(Share(watched.errors, 0.5), 1.0);
}

TEST(Tracking, FollowsASubjectThatMovesAndDoesNotHunt) {
  // 0.9 m +- 0.1 m in 30 s.
  const Duration long_enough = std::chrono::seconds(testing::ByLevel(8, 15, 120));
  const Watched watched = Track(0.1, 30.0, long_enough);
  const double seconds = std::chrono::duration<double>(long_enough).count();
  EXPECT_GE(static_cast<double>(watched.told.size()), seconds / 8);
  EXPECT_LE(static_cast<double>(watched.told.size()), 2 * seconds);
  EXPECT_GE(Share(watched.errors, 1.0), 0.85);
  // A search takes the lens out of focus for a moment, never far: the sweep would.
  EXPECT_GE(Share(watched.errors, 8.0), 0.98);
}

TEST(Tracking, FollowsASteadyMotionOneWay) {
  // The first part of a slow sway is even: 0.3 m to either side in 120 s is 16 mm a second.
  const Watched watched = Track(0.3, 120.0, std::chrono::seconds(testing::ByLevel(6, 12, 20)));
  ASSERT_GE(watched.told.size(), 2u);
  int turns = 0;
  for (std::size_t i = 2; i < watched.told.size(); ++i) {
    const double step = (watched.told[i].position - watched.told[i - 1].position).value;
    const double before = (watched.told[i - 1].position - watched.told[i - 2].position).value;
    // Half a depth of field is 79 steps here: what is less is the scatter of the answers.
    turns += step * before < 0 && std::min(std::abs(step), std::abs(before)) > 20.0;
  }
  EXPECT_EQ(turns, 0);
  EXPECT_GE(Share(watched.errors, 1.0), 0.85);
}

TEST(Tracking, FollowsAPaceThatLeavesTheDepthOfFieldWhileItSearches) {
  // 0.05 and 0.1 m/s at most: 0.3 m to either side of 0.9 m in 38 and 19 s.
  for (const double speed : {0.05, 0.1}) {
    const Duration long_enough = std::chrono::seconds(testing::ByLevel(5, 10, 40));
    const Watched watched = Track(0.3, 0.6 * std::numbers::pi / speed, long_enough);
    std::printf("%.2f m/s: %zu searches, within half a depth of field %.0f %% of the time, a whole one %.0f %%\n",
                speed, watched.told.size(), 100 * Share(watched.errors, 0.5), 100 * Share(watched.errors, 1.0));
    EXPECT_GE(watched.told.size(), 3u);
    EXPECT_GE(Share(watched.errors, 1.0), 0.5);
  }
}

TEST(Tracking, IsRefusedWhereItCannotBe) {
  SteppedClock clock;
  auto controls = std::make_shared<testing::FakeControls>();
  auto rig = *Rig::Create({}, testing::MakeFakeDevice(clock, controls, 100.0), clock);
  AutofocusRequest request;
  request.track = [](const AutofocusOutcome&) {};
  request.regions = {{0.0, 0.0, 0.5, 0.5}, {0.5, 0.5, 0.5, 0.5}};
  Answers<AutofocusOutcome> answers;
  rig->Autofocus(std::move(request), nullptr, answers.Take());
  rig->Step(clock.Now());
  EXPECT_EQ(answers.only().error().code, Code::InvalidArgument);
}

class TrackerTest : public ::testing::Test {
 protected:
  /// So many frames of that sharpness, 20 ms apart; how many of them asked for a search.
  int Show(double sharpness, int frames, double light = 0.5) {
    int asked = 0;
    for (int i = 0; i < frames; ++i) {
      now_ += 20ms;
      autofocus::FocusScore score{.gradient_energy = sharpness * light * light, .noise = 0.001, .mean = light};
      asked += tracker_.Changed(score, 8, 10000, now_) ? 1 : 0;
    }
    return asked;
  }
  autofocus::Tracker tracker_;
  Instant now_{};
};

TEST_F(TrackerTest, OnlyALastingChangeIsOne) {
  tracker_.SearchEnded(true, now_);
  EXPECT_EQ(Show(1.0, 100), 0);
  EXPECT_EQ(Show(0.93, 100), 0);  // inside the dead zone
  EXPECT_EQ(Show(0.5, 2) + Show(1.0, 1) + Show(0.5, 2) + Show(1.0, 5), 0);
  EXPECT_GT(Show(0.5, 3), 0);
}

TEST_F(TrackerTest, AnotherLightIsAnotherScene) {
  tracker_.SearchEnded(true, now_);
  EXPECT_EQ(Show(1.0, 100), 0);
  EXPECT_EQ(Show(1.0, 10, 0.45), 0);  // a cloud
  EXPECT_GT(Show(1.0, 5, 0.2), 0);
}

TEST_F(TrackerTest, SearchesAreRare) {
  tracker_.SearchEnded(true, now_);
  EXPECT_EQ(Show(1.0, 4) + Show(0.5, 10), 0);  // 280 ms: too soon
  EXPECT_GT(Show(0.5, 5), 0);
  // After refusals the next try comes later and later.
  int frames_to_next[4] = {};
  for (int& frames : frames_to_next) {
    tracker_.SearchEnded(false, now_);
    while (Show(0.5, 1) == 0) ++frames;
  }
  EXPECT_GE(frames_to_next[1], 2 * frames_to_next[0] - 2);
  EXPECT_GE(frames_to_next[2], 2 * frames_to_next[1] - 2);
  EXPECT_LE(frames_to_next[3], 250);
}

}  // namespace
}  // namespace lensd::rig
