// A simulated world on its own stepped clock, for tests.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <numeric>

#include "base/clock.h"
#include "sim/world.h"

namespace lensd::sim {

/// A small, evenly lit, noiseless wall at 1 m.
inline Scene SmallScene() {
  Scene scene;
  scene.camera.width = 32;
  scene.camera.height = 24;
  scene.surfaces.push_back({PlaneShape{1.0, 0.0, 0.0}, {}, ConstantPaint{0.5}});
  return scene;
}

struct Stage {
  explicit Stage(const Scene& scene, const WorldOptions& options = {}) {
    auto opened = OpenWorld(std::make_shared<const Scene>(scene), clock, options);
    EXPECT_TRUE(opened.has_value()) << (opened ? "" : opened.error().message);
    if (opened) world = std::move(*opened);
  }
  drivers::Lens& lens() { return *world.device.lens; }
  drivers::Camera& camera() { return *world.device.camera; }
  void Wait(int milliseconds) { clock.Advance(std::chrono::milliseconds(milliseconds)); }
  double FocusCount() { return lens().Read()->axes[drivers::Axis::Focus]->position.value; }
  double FocusPlace() { return world.truth->Now().focus_steps; }

  SteppedClock clock;
  World world;
};

inline double MeanLevel(const drivers::Frame& frame) {
  return std::accumulate(frame.samples->begin(), frame.samples->end(), 0.0) /
         static_cast<double>(frame.samples->size());
}

}  // namespace lensd::sim
