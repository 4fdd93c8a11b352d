// How much faster than life the simulation runs on a stepped clock: printed, not judged.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <iostream>

#include "base/clock.h"
#include "sim/world.h"

namespace lensd::sim {
namespace {

/// A coarse sweep and a fine one, as autofocus would make them: 40 frames.
int Sweep(drivers::Device& device, SteppedClock& clock, double steps) {
  int frames = 0;
  EXPECT_TRUE(device.camera->Start().has_value());
  for (int i = 0; i < 40; ++i) {
    const double at = i < 30 ? i / 29.0 : 0.52 + 0.002 * (i - 30);
    EXPECT_TRUE(device.lens->StartMove(drivers::Axis::Focus, Native{std::round(at * (steps - 1.0))}).has_value());
    clock.Advance(std::chrono::milliseconds(200));
    const auto frame = device.camera->Poll();
    if (frame && *frame) ++frames;
  }
  return frames;
}

TEST(SimSpeed, OfAThousandAutofocusRuns) {
#ifndef NDEBUG
  GTEST_SKIP() << "only an optimised build has a speed worth reporting";
#endif
  const auto scene = LoadScene(LENSD_SOURCE_DIR "/scenes/brick.toml");
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  const auto shared = std::make_shared<const Scene>(*scene);
  const auto pictures = *Pictures::Create(shared);
  constexpr int kRuns = 6;
  int frames = 0;
  std::chrono::steady_clock::time_point start;
  for (int run = 0; run <= kRuns; ++run) {
    if (run == 1) start = std::chrono::steady_clock::now();  // the first run renders, the others share its pictures
    SteppedClock clock;
    auto world = OpenWorld(shared, clock, {.seed = static_cast<std::uint64_t>(run), .pictures = pictures});
    ASSERT_TRUE(world.has_value());
    const int got = Sweep(world->device, clock, shared->lens.steps);
    EXPECT_EQ(got, 40);
    if (run > 0) frames += got;
  }
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  const double per_run_s = taken.count() / kRuns;
  std::cout << frames << " frames of 640x480 in " << taken.count() << " s: " << 1e3 * taken.count() / frames
            << " ms a frame, 1000 runs of 40 frames in " << 1000.0 * per_run_s << " s on one core\n";
  RecordProperty("milliseconds_per_frame", std::to_string(1e3 * taken.count() / frames));
}

}  // namespace
}  // namespace lensd::sim
