#include "sim/world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "base/clock.h"
#include "io/toml.h"
#include "sim/driver.h"

namespace lensd::sim {
namespace {

using drivers::Axis;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// A small noiseless wall.
Scene SmallScene() {
  Scene scene;
  scene.camera.width = 32;
  scene.camera.height = 24;
  scene.surfaces.push_back({PlaneShape{1.0, 0.0, 0.0}, {}, ConstantPaint{0.5}});
  return scene;
}

/// A world on its own stepped clock.
struct Stage {
  explicit Stage(const Scene& scene, WorldOptions options = {}) {
    auto opened = OpenWorld(std::make_shared<const Scene>(scene), clock, options);
    EXPECT_TRUE(opened.has_value()) << (opened ? "" : opened.error().message);
    if (opened) world = std::move(*opened);
  }
  drivers::Lens& lens() { return *world.device.lens; }
  drivers::Camera& camera() { return *world.device.camera; }

  SteppedClock clock;
  World world;
};

double MeanLevel(const drivers::Frame& frame) {
  return std::accumulate(frame.samples->begin(), frame.samples->end(), 0.0) /
         static_cast<double>(frame.samples->size());
}

TEST(World, MovesFocusAndReportsIt) {
  Stage stage(SmallScene());
  ASSERT_TRUE(stage.lens().StartMove(Axis::Focus, Native{4000}).has_value());
  auto state = stage.lens().Read();
  ASSERT_TRUE(state.has_value());
  EXPECT_TRUE(state->axes[Axis::Focus]->moving);
  // 4000 steps at 8000 a second, with 0.04 s to gain and lose speed: 0.54 s.
  stage.clock.Advance(milliseconds(539));
  EXPECT_TRUE(stage.lens().Read()->axes[Axis::Focus]->moving);
  stage.clock.Advance(milliseconds(2));
  state = stage.lens().Read();
  EXPECT_FALSE(state->axes[Axis::Focus]->moving);
  EXPECT_EQ(state->axes[Axis::Focus]->position, Native{4000});
  stage.clock.Advance(milliseconds(100));
  const TrueState truth = stage.world.truth->Now();
  EXPECT_NEAR(truth.focus_steps, 4000.0, 1e-6);
  EXPECT_NEAR(truth.extension_m, 1.6e-3 * 4000.0 / 8191.0, 1e-12);
}

TEST(World, ExposesOnTheFrameGrid) {
  Stage stage(SmallScene());
  EXPECT_EQ(stage.camera().Poll().error().code, Code::InvalidArgument);
  stage.clock.Advance(milliseconds(1));
  ASSERT_TRUE(stage.camera().Start().has_value());
  auto frame = stage.camera().Poll();
  ASSERT_TRUE(frame.has_value());
  EXPECT_FALSE(frame->has_value());
  const Duration period(std::llround(1e9 / 60.0));
  stage.clock.AdvanceTo(Instant(period + milliseconds(10)));
  frame = stage.camera().Poll();
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  EXPECT_EQ((*frame)->exposure_start, Instant(period));
  EXPECT_EQ((*frame)->exposure_end, Instant(period + milliseconds(10)));
  EXPECT_EQ((*frame)->sequence, 0u);
  EXPECT_FALSE(stage.camera().Poll()->has_value());
  stage.clock.Advance(period * 3);
  EXPECT_EQ((*stage.camera().Poll())->sequence, 3u);
}

TEST(World, LightFollowsTheWorkingFNumber) {
  Scene scene = SmallScene();
  scene.camera.bits = 16;
  Stage stage(scene);
  ASSERT_TRUE(stage.camera().Start().has_value());
  stage.clock.Advance(milliseconds(20));
  auto frame = stage.camera().Poll();
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  EXPECT_NEAR(MeanLevel(**frame) / 65535.0, 0.45, 1e-4);
  ASSERT_TRUE(stage.lens().StartMove(Axis::Focus, Native{8191}).has_value());
  ASSERT_TRUE(stage.lens().StartMove(Axis::Iris, Native{99}).has_value());
  stage.clock.Advance(seconds(3));
  frame = stage.camera().Poll();
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  const double working = 16.0 * (1.0 + 1.6 / 25.0);
  EXPECT_NEAR(MeanLevel(**frame) / 65535.0, 0.45 * 4.0 / (working * working), 1e-4);
}

TEST(World, KnowsTheTruthOfItsRegion) {
  Scene scene = SmallScene();
  scene.surfaces.push_back({PlaneShape{2.0, 0.0, 0.0}, {0.0, 0.0, 0.45, 1.0}, ConstantPaint{0.5}});
  scene.truth_region = {0.25, 0.0, 0.5, 1.0};
  const Stage stage(scene);
  const auto& subjects = stage.world.truth->subjects();
  ASSERT_EQ(subjects.size(), 2u);
  EXPECT_EQ(subjects[0].vergence_d, 1.0);
  EXPECT_EQ(subjects[1].vergence_d, 2.0);
  EXPECT_NEAR(subjects[0].share, 10.0 / 16.0, 1e-12);
}

TEST(World, RefusesAStartOutsideTheRange) {
  SteppedClock clock;
  const auto world = OpenWorld(std::make_shared<const Scene>(SmallScene()), clock, {.focus_start = Native{9000}});
  ASSERT_FALSE(world.has_value());
  EXPECT_EQ(world.error().code, Code::InvalidArgument);
}

Settings DriverSettings(const std::string& text) {
  return *io::ParseToml(text, std::string(LENSD_SOURCE_DIR) + "/scenes/config.toml");
}

TEST(SimDriver, OpensEveryShippedScene) {
  SteppedClock clock;
  for (const std::string name : {"motorcycle", "brick", "blank"}) {
    auto device = OpenSim(DriverSettings("scene = \"" + name + ".toml\"\nseed = 3\n"), clock);
    ASSERT_TRUE(device.has_value()) << device.error().message;
    ASSERT_TRUE(device->optics.has_value());
    ASSERT_TRUE(device->camera->Start().has_value());
    clock.Advance(seconds(1));
    const auto frame = device->camera->Poll();
    ASSERT_TRUE(frame.has_value() && frame->has_value()) << name;
    EXPECT_GT(MeanLevel(**frame), 10.0) << name;
    EXPECT_LT(MeanLevel(**frame), 200.0) << name;
  }
}

TEST(SimDriver, ExplainsItsSettings) {
  SteppedClock clock;
  const auto missing = OpenSim(DriverSettings("seed = 1\n"), clock);
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(missing.error().code, Code::BadData);
  const auto unknown = OpenSim(DriverSettings("scene = \"brick.toml\"\nspeed = 1\n"), clock);
  ASSERT_FALSE(unknown.has_value());
  EXPECT_NE(unknown.error().message.find("config.toml:2: unknown key \"speed\""), std::string::npos);
}

}  // namespace
}  // namespace lensd::sim
