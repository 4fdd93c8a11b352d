#include "sim/driver.h"

#include <utility>

#include "sim/world.h"

namespace lensd::sim {

Result<drivers::Device> OpenSim(const Settings& settings, const Clock& clock) {
  SettingsReader read(settings, "driver \"sim\"");
  const auto path = read.OptionalPath("scene");
  if (!path) read.Reject("", "needs a scene: scene = \"FILE.toml\"");
  WorldOptions options;
  options.seed = static_cast<std::uint64_t>(read.Integer("seed", 1, {0.0, 9e15}));
  if (auto done = read.Finish(); !done) return PassOn(std::move(done));
  options.aside = dynamic_cast<const MonotonicClock*>(&clock) != nullptr;
  auto scene = LoadScene(*path);
  if (!scene) return PassOn(std::move(scene));
  auto world = OpenWorld(std::make_shared<const Scene>(std::move(*scene)), clock, options);
  if (!world) return PassOn(std::move(world));
  return std::move(world->device);
}

}  // namespace lensd::sim
