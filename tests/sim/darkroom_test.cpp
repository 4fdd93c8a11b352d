// Frames made on a thread of their own: the same frames, polls that do not wait, work that can be called off.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "stage.h"

namespace lensd::sim {
namespace {

using drivers::Axis;
using drivers::Frame;

/// Polls until a frame comes; none after a minute.
std::optional<Frame> Wait(drivers::Camera& camera) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (std::chrono::steady_clock::now() < end) {
    auto frame = camera.Poll();
    EXPECT_TRUE(frame.has_value());
    if (!frame || *frame) return frame ? *frame : std::nullopt;
    std::this_thread::yield();
  }
  return std::nullopt;
}

TEST(Darkroom, MakesTheFramesThatPollWouldMake) {
  Scene scene = SmallScene();
  scene.surfaces[0].paint = SinusoidPaint{8.0, 5.0};
  scene.camera.full_well_e = 5000.0;
  scene.lens.backlash_steps = 20.0;
  Stage direct(scene, {.seed = 7});
  Stage aside(scene, {.seed = 7, .aside = true});
  for (Stage* stage : {&direct, &aside}) ASSERT_TRUE(stage->camera().Start().has_value());
  for (const double target : {300.0, 900.0, 850.0}) {
    for (Stage* stage : {&direct, &aside}) {
      ASSERT_TRUE(stage->lens().StartMove(Axis::Focus, Native{target}).has_value());
      stage->Wait(37);
    }
    const auto expected = Wait(direct.camera());
    EXPECT_FALSE(aside.camera().Poll()->has_value()) << "a poll waited";
    const auto frame = Wait(aside.camera());
    ASSERT_TRUE(expected && frame);
    EXPECT_EQ(frame->sequence, expected->sequence);
    EXPECT_EQ(frame->exposure_end, expected->exposure_end);
    EXPECT_EQ(*frame->samples, *expected->samples);
  }
}

/// An odd number of blades before a tilted plane is left to single rays: hours for this frame.
Scene HopelessScene() {
  Scene scene = SmallScene();
  scene.camera.width = 4000;
  scene.camera.height = 3000;
  auto texture = std::make_shared<Texture>(Texture{2, 2, {0.0f, 1.0f, 1.0f, 0.0f}});
  scene.surfaces = {{PlaneShape{1.0, 0.9, 0.0}, {}, TexturePaint{texture, 1.0, false}}};
  scene.lens.aperture_blades = 5;
  scene.lens.min_f_number = 1.0;
  scene.lens.initial_f_number = 1.0;
  return scene;
}

TEST(Darkroom, CallsOffWhatNobodyWaitsFor) {
  Stage stage(HopelessScene(), {.focus_start = Native{8000}, .aside = true});
  ASSERT_TRUE(stage.camera().Start().has_value());
  stage.Wait(100);
  EXPECT_FALSE(stage.camera().Poll()->has_value());
  EXPECT_FALSE(stage.camera().Poll()->has_value());
  ASSERT_TRUE(stage.camera().Stop().has_value());
  ASSERT_TRUE(stage.camera().Start().has_value());
  stage.Wait(100);
  EXPECT_FALSE(stage.camera().Poll()->has_value());
  // The end of the stage calls off the second frame.
}

TEST(Darkroom, GivesUpOnAFrameThatTakesForEver) {
  Stage stage(HopelessScene(), {.focus_start = Native{8000}, .aside = true});
  ASSERT_TRUE(stage.camera().Start().has_value());
  stage.Wait(100);
  EXPECT_FALSE(stage.camera().Poll()->has_value());
  stage.Wait(9900);
  EXPECT_FALSE(stage.camera().Poll()->has_value());
  stage.Wait(200);
  const auto frame = stage.camera().Poll();
  ASSERT_FALSE(frame.has_value());
  EXPECT_EQ(frame.error().code, Code::Timeout);
}

}  // namespace
}  // namespace lensd::sim
