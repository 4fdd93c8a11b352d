// The driver "sim": a scene file becomes a lens with nominal optics, and a camera.
#include "sim/driver.h"

#include <utility>

#include "sim/world.h"

namespace lensd::sim {

namespace {

struct SimSettings {
  std::string scene;
  std::uint64_t seed = 1;
};

SimSettings ReadKeys(SettingsReader& read) {
  const auto path = read.OptionalPath("scene");
  if (!path) read.Reject("", "needs a scene: scene = \"FILE.toml\"");
  const auto seed = static_cast<std::uint64_t>(read.Integer("seed", 1, {0.0, 9e15}));
  return {path.value_or(""), seed};
}

Result<SimSettings> ReadSettings(const Settings& settings) {
  SettingsReader read(settings, "driver \"sim\"");
  SimSettings keys = ReadKeys(read);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return keys;
}

}  // namespace

Result<void> CheckSim(const Settings& settings) {
  SettingsReader read(settings, "driver \"sim\"");
  const SimSettings keys = ReadKeys(read);
  const auto done = read.Finish();
  // Beside a mistake here, those of the scene are told too where all are asked for.
  const auto scene = keys.scene.empty() ? Result<Scene>(Scene{}) : LoadScene(keys.scene);
  if (!done) return done;
  if (!scene) return PassOn(scene);
  return {};
}

Result<drivers::Device> OpenSim(const Settings& settings, const Clock& clock) {
  const auto read = ReadSettings(settings);
  if (!read) return PassOn(read);
  WorldOptions options;
  options.seed = read->seed;
  options.aside = dynamic_cast<const MonotonicClock*>(&clock) != nullptr;
  auto scene = LoadScene(read->scene);
  if (!scene) return PassOn(scene);
  auto world = OpenWorld(std::make_shared<const Scene>(std::move(*scene)), clock, options);
  if (!world) return PassOn(world);
  return std::move(world->device);
}

}  // namespace lensd::sim
