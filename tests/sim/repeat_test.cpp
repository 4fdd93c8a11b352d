// Whole frames: the same bits in debug, release and sanitizer builds, and with other threads at work meanwhile.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <thread>

#include "base/clock.h"
#include "stage.h"

namespace lensd::sim {
namespace {

using drivers::Axis;

std::uint64_t AddToHash(std::uint64_t hash, const drivers::Frame& frame) {
  for (const std::uint16_t sample : *frame.samples) {
    for (const int byte : {sample & 255, sample >> 8})
      hash = (hash ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3u;
  }
  return hash;
}

/// Gravel, noise, backlash, ringing, moves that are not waited for: FNV-1a over all samples. Where a
/// change of the renderer, the mechanics or the noise is meant, the new value belongs here; where it is not, or where
/// builds differ, something has lost its determinism.
TEST(Repeat, FramesAreTheSameBitsInEveryBuild) {
  auto scene = LoadScene(LENSD_SOURCE_DIR "/scenes/regimes/worn-mechanics.toml");
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  scene->camera.width = 160;
  scene->camera.height = 120;
  scene->lens.ring_hz = 15.0;
  Stage stage(*scene, {.seed = 42, .focus_start = Native{1500}});
  ASSERT_TRUE(stage.camera().Start().has_value());
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const double target : {2400.0, 2000.0, 2050.0, 2300.0, 100.0}) {
    ASSERT_TRUE(stage.lens().StartMove(Axis::Focus, Native{target}).has_value());
    for (int i = 0; i < 4; ++i) {
      stage.Wait(23);
      const auto frame = stage.camera().Poll();
      ASSERT_TRUE(frame.has_value());
      if (*frame) hash = AddToHash(hash, **frame);
    }
  }
  EXPECT_EQ(hash, 15862685995504867017u);
}

/// In real time: one thread moves, one films, one keeps the score, and a second world shares the pictures.
TEST(Repeat, LensCameraAndTruthMayBeUsedFromDifferentThreads) {
  Scene scene = SmallScene();
  scene.surfaces[0].paint = SinusoidPaint{8.0, 5.0};
  scene.camera.frame_rate_hz = 1000.0;
  scene.camera.exposure_ms = 0.5;
  const auto shared = std::make_shared<const Scene>(scene);
  const auto pictures = *Pictures::Create(shared);
  const MonotonicClock clock;
  auto first = OpenWorld(shared, clock, {.pictures = pictures});
  auto second = OpenWorld(shared, clock, {.pictures = pictures});
  ASSERT_TRUE(first.has_value() && second.has_value());
  const Instant end = clock.Now() + std::chrono::milliseconds(200);
  int frames = 0;
  const auto film = [&](drivers::Camera& camera, int& count) {
    ASSERT_TRUE(camera.Start().has_value());
    while (clock.Now() < end) count += camera.Poll()->has_value() ? 1 : 0;
  };
  int other_frames = 0;
  std::thread filming([&] { film(*first->device.camera, frames); });
  std::thread filming_too([&] { film(*second->device.camera, other_frames); });
  std::thread scoring([&] {
    while (clock.Now() < end) EXPECT_GE(first->truth->Now().focus_steps, -1.0);
  });
  for (int i = 1; clock.Now() < end; ++i) {
    EXPECT_TRUE(first->device.lens->StartMove(Axis::Focus, Native{100.0 * (i % 80)}).has_value());
    EXPECT_TRUE(first->device.lens->Read().has_value());
    std::this_thread::yield();
  }
  filming.join();
  filming_too.join();
  scoring.join();
  EXPECT_GT(frames, 0);
  EXPECT_GT(other_frames, 0);
}

}  // namespace
}  // namespace lensd::sim
