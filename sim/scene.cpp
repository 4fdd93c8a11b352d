#include "sim/scene.h"

#include "io/toml.h"
#include "scene_parts.h"

namespace lensd::sim {
namespace {

// Far more than a scene needs, few enough that a slip of the pen does not eat the machine.
constexpr std::size_t kMostParts = 4096;

/// Reads each table of an array of tables into `parts`.
template <class Part>
Result<void> ReadParts(SettingsReader& read, std::string_view key, Result<Part> (*read_part)(const Settings&),
                       std::vector<Part>& parts) {
  const auto tables = read.Tables(key);
  if (tables.size() > kMostParts) read.Reject(key, "has more than " + std::to_string(kMostParts) + " entries");
  for (const Settings* table : tables) {
    auto part = read_part(*table);
    if (!part) return PassOn(std::move(part));
    parts.push_back(std::move(*part));
  }
  return {};
}

Result<Region> ReadTruthRegion(const Settings* table) {
  const Region fallback = Scene{}.truth_region;
  if (table == nullptr) return fallback;
  SettingsReader read(*table, "[truth]");
  const Region region = ReadRegion(read, "region", fallback);
  if (auto done = read.Finish(); !done) return PassOn(std::move(done));
  return region;
}

Result<Scene> SceneFromSettings(const Settings& settings) {
  Scene scene;
  SettingsReader read(settings, "the scene");
  if (read.RequiredNumber("version") != 1.0) read.Reject("version", "must be 1");
  auto camera = ReadCamera(read.Table("camera"));
  if (!camera) return PassOn(std::move(camera));
  scene.camera = *camera;
  auto lens = ReadLens(read.Table("lens"));
  if (!lens) return PassOn(std::move(lens));
  scene.lens = *lens;
  if (auto done = ReadParts(read, "surface", ReadSurface, scene.surfaces); !done) return PassOn(std::move(done));
  if (auto done = ReadParts(read, "light", ReadLight, scene.lights); !done) return PassOn(std::move(done));
  if (auto done = ReadParts(read, "fault", ReadFault, scene.faults); !done) return PassOn(std::move(done));
  auto region = ReadTruthRegion(read.Table("truth"));
  if (!region) return PassOn(std::move(region));
  scene.truth_region = *region;
  if (scene.surfaces.empty() && scene.lights.empty()) read.Reject("", "needs a [[surface]] or a [[light]] to look at");
  if (auto done = read.Finish(); !done) return PassOn(std::move(done));
  return scene;
}

}  // namespace

Result<Scene> LoadScene(const std::string& path) {
  const auto settings = io::ReadTomlFile(path);
  if (!settings) return std::unexpected(settings.error());
  return SceneFromSettings(*settings);
}

}  // namespace lensd::sim
