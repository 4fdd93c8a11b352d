// A planning keeps the positions it worked out last, for as long as what they depend on is equal: against a copy, which
// works them out anew, wherever the motors stand.
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "planning/planning.h"
#include "sim/world.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;

struct SimulatedLens {
  std::shared_ptr<sim::Scene> scene = std::make_shared<sim::Scene>();
  rig::RigConfig config;
  SteppedClock clock;
  std::unique_ptr<rig::Rig> rig;

  explicit SimulatedLens(double backlash, bool zooms = false) {
    scene->camera.width = scene->camera.height = 8;
    scene->surfaces.push_back({.shape = sim::PlaneShape{}, .region = {}, .paint = sim::ConstantPaint{}});
    sim::LensSettings& made = scene->lens;
    made.min_focal_length_mm = 25.0;
    made.max_focal_length_mm = zooms ? 50.0 : 25.0;
    made.steps = 900;
    made.iris_steps = 40;
    made.backlash_steps = backlash;
    made.iris_backlash_steps = backlash > 0.0 ? 3.0 : 0.0;
    config.axes[Axis::Focus].backlash = made.backlash_steps;
    config.axes[Axis::Iris].backlash = made.iris_backlash_steps;
    auto world = sim::OpenWorld(scene, clock);
    EXPECT_TRUE(world.has_value());
    auto made_rig = rig::Rig::Create(config, std::move(world->device), clock, nullptr);
    EXPECT_TRUE(made_rig.has_value()) << made_rig.error().message;
    rig = *std::move(made_rig);
    for (int i = 0; i < 200; ++i) {
      rig->Step(clock.Now());
      clock.Advance(std::chrono::milliseconds(5));
    }
  }
};

/// As after a motion that ended elsewhere.
rig::Status With(rig::Status status, Axis axis, double position, double not_taken_up, double more_rest) {
  rig::Arrival& arrival = status.axes[axis]->arrival;
  arrival.position = Native{position};
  arrival.not_taken_up = not_taken_up;
  arrival.rest += more_rest;
  return status;
}

void ExpectSame(const MotorPositions& a, const MotorPositions& b) {
  ASSERT_EQ(a.lens.focal_length_error, b.lens.focal_length_error);
  ASSERT_EQ(a.lens.focus.size(), b.lens.focus.size());
  ASSERT_EQ(a.lens.iris.size(), b.lens.iris.size());
  for (std::size_t i = 0; i < a.lens.focus.size(); ++i) {
    ASSERT_EQ(a.lens.focus[i].bound.value, b.lens.focus[i].bound.value);
    ASSERT_EQ(a.lens.focus[i].focal_plane.value, b.lens.focus[i].focal_plane.value);
  }
  for (std::size_t j = 0; j < a.lens.iris.size(); ++j) {
    ASSERT_EQ(a.lens.iris[j].lowest.value, b.lens.iris[j].lowest.value);
    ASSERT_EQ(a.lens.iris[j].highest.value, b.lens.iris[j].highest.value);
  }
}

TEST(MotorPositions, AreThoseOfNowWhereverTheMotorsStand) {
  SimulatedLens lens(20.0);
  const auto planning = PlanningOf(*lens.rig, lens.config);
  ASSERT_TRUE(planning.has_value());
  const rig::Status first = lens.rig->GetStatus();
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(0.0, 800.0), left(0.0, 20.0), doubt(0.0, 3.0);
  auto before = planning->motors.Of(*planning, first);
  int other = 0;
  for (int i = 0; i < 60; ++i) {
    rig::Status now = With(first, Axis::Focus, place(random), left(random), i % 3 == 0 ? 0.0 : doubt(random));
    if (i % 2 == 0) now = With(now, Axis::Iris, place(random) / 30.0, left(random) / 7.0, 0.0);
    const auto kept = planning->motors.Of(*planning, now);
    // NOLINTNEXTLINE(performance-unnecessary-copy-initialization): a copy knows no positions yet.
    const Planning anew = *planning;
    ExpectSame(*kept, *anew.motors.Of(anew, now));
    EXPECT_EQ(kept, planning->motors.Of(*planning, now)) << "worked out twice";
    other += kept != before && kept->lens.focus.front().bound != before->lens.focus.front().bound;
    before = kept;
  }
  EXPECT_GT(other, 40);
}

TEST(MotorPositions, AreKeptOverMotionsThatChangeNothing) {
  SimulatedLens lens(0.0);
  const auto planning = PlanningOf(*lens.rig, lens.config);
  ASSERT_TRUE(planning.has_value());
  rig::Status first = lens.rig->GetStatus();
  first.axes[Axis::Focus]->arrival.lost_travel = 0.0;
  const auto kept = planning->motors.Of(*planning, first);
  EXPECT_EQ(kept, planning->motors.Of(*planning, With(first, Axis::Focus, 700.0, 0.0, 0.0)));
  const auto wider = planning->motors.Of(*planning, With(first, Axis::Focus, 700.0, 0.0, 2.0));
  EXPECT_NE(kept, wider);
  EXPECT_GT(wider->lens.focus.front().bound, kept->lens.focus.front().bound);
  first.axes[Axis::Focus]->arrival.lost_travel = 0.01;
  const auto loses = planning->motors.Of(*planning, first);
  EXPECT_NE(loses, planning->motors.Of(*planning, With(first, Axis::Focus, 700.0, 0.0, 0.0)));
}

TEST(MotorPositions, CountWhereTheZoomGoes) {
  SimulatedLens lens(0.0, true);
  auto planning = PlanningOf(*lens.rig, lens.config);
  ASSERT_TRUE(planning.has_value());
  rig::Status now = lens.rig->GetStatus();
  now.axes[Axis::Zoom]->arrival.lost_travel = 0.05;
  now.axes[Axis::Zoom]->arrival.position = planning->lens.axes[Axis::Zoom]->low;
  const auto stays = planning->motors.Of(*planning, now);
  planning->zoom = planning->lens.axes[Axis::Zoom]->high;
  const auto goes = planning->motors.Of(*planning, now);
  EXPECT_GT(goes->lens.focal_length_error, stays->lens.focal_length_error);
  const Planning anew = *planning;
  ExpectSame(*goes, *anew.motors.Of(anew, now));
}

TEST(MotorPositions, MayBeAskedForOnAnyThread) {
  SimulatedLens lens(20.0);
  const auto planning = PlanningOf(*lens.rig, lens.config);
  ASSERT_TRUE(planning.has_value());
  const rig::Status first = lens.rig->GetStatus();
  std::vector<rig::Status> statuses;
  std::vector<std::shared_ptr<const MotorPositions>> expected;
  for (int i = 0; i < 3; ++i) {
    statuses.push_back(With(first, Axis::Focus, 100.0 + 200.0 * i, 5.0 * i, 0.0));
    // NOLINTNEXTLINE(performance-unnecessary-copy-initialization): a copy knows no positions yet.
    const Planning anew = *planning;
    expected.push_back(anew.motors.Of(anew, statuses.back()));
  }
  std::atomic<int> wrong = 0;
  const auto ask = [&](std::size_t start) {
    for (std::size_t i = start; i < start + 200; ++i) {
      const auto positions = planning->motors.Of(*planning, statuses[i % 3]);
      const auto& bounds = expected[i % 3]->lens.focus;
      for (std::size_t at = 0; at < bounds.size(); at += 37)
        wrong += positions->lens.focus[at].bound != bounds[at].bound;
    }
  };
  std::thread one(ask, 0), other(ask, 1);
  one.join();
  other.join();
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace lensd::daemon
