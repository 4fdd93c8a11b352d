// A rig on a simulated lens and camera, on a stepped clock, driven the way a worker drives it.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>

#include "base/clock.h"
#include "rig/rig.h"
#include "sim/world.h"

namespace lensd::testing {

/// The scene of a TOML text; its pictures are shared by all who ask for the same text.
inline std::shared_ptr<const sim::Scene> SceneFromText(const std::string& text) {
  std::string path = (std::filesystem::temp_directory_path() / "lensd-scene-XXXXXX.toml").string();
  const int descriptor = mkstemps(path.data(), 5);
  close(descriptor);
  std::ofstream(path) << text;
  auto scene = sim::LoadScene(path);
  std::filesystem::remove(path);
  if (!scene) throw std::runtime_error(scene.error().message);
  return std::make_shared<const sim::Scene>(*std::move(scene));
}

struct RigOnSim {
  explicit RigOnSim(const std::string& scene, std::uint64_t seed = 1, double start = 0.0,
                    const std::function<void(rig::RigConfig&)>& configure = {},
                    std::shared_ptr<const rig::Calibration> calibration = nullptr) {
    sim::WorldOptions options;
    options.seed = seed;
    options.focus_start = Native{start};
    auto world = sim::OpenWorld(SceneFromText(scene), clock, options);
    if (!world) throw std::runtime_error(world.error().message);
    truth = world->truth;
    simulation = world->device.simulation;
    rig::RigConfig config;
    if (configure) configure(config);
    auto made = rig::Rig::Create(config, std::move(world->device), clock, std::move(calibration));
    if (!made) throw std::runtime_error(made.error().message);
    rig = *std::move(made);
  }

  void Run(Duration how_long) {
    RunUntil([] { return false; }, how_long);
  }
  /// Until `done` or the time is over.
  void RunUntil(const std::function<bool()>& done, Duration at_most) {
    const Instant end = clock.Now() + at_most;
    while (!done() && clock.Now() < end) {
      const Instant next = rig->Step(clock.Now());
      clock.AdvanceTo(std::min(std::max(next, clock.Now() + std::chrono::microseconds(100)), end));
    }
  }

  SteppedClock clock;
  std::shared_ptr<const sim::Truth> truth;
  std::shared_ptr<drivers::Simulation> simulation;
  std::unique_ptr<rig::Rig> rig;
};

}  // namespace lensd::testing
