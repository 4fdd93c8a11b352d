// What the simulated USB cameras of the drivers' tests look at.
#pragma once

#include "sim/scene.h"

namespace lensd::testing {

/// A grating 1 m away before a lens of 1024 steps.
inline sim::Scene GratingScene(int width, int height, double speed_steps_per_s) {
  sim::Scene scene;
  scene.camera.width = width;
  scene.camera.height = height;
  scene.lens.steps = 1024;
  scene.lens.speed_steps_per_s = speed_steps_per_s;
  scene.surfaces.push_back({sim::PlaneShape{1.0, 0.0, 0.0}, {}, sim::SinusoidPaint{8.0, 0.0}});
  return scene;
}

}  // namespace lensd::testing
