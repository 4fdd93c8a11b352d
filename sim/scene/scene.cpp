// A scene file into plain data, with every key checked and every unknown one refused with its line.
#include "sim/scene.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <type_traits>
#include <variant>

#include "io/toml.h"
#include "sim/camera/lens_grid.h"
#include "sim/scene/scene_parts.h"

namespace lensd::sim {
namespace {

// Far more than a scene needs, few enough that a slip of the pen does not eat the machine.
constexpr std::size_t kMostParts = 4096;

/// Reads each table of an array of tables into `parts`.
template <class Part>
Result<void> ReadParts(SettingsReader& read, std::string_view key,
                       const std::type_identity_t<std::function<Result<Part>(const Settings&)>>& read_part,
                       std::vector<Part>& parts) {
  const auto tables = read.Tables(key);
  Result<void> first;
  if (tables.size() > kMostParts) read.Reject(key, "has more than " + std::to_string(kMostParts) + " entries");
  for (const Settings* table : tables) {
    auto part = read_part(*table);
    if (part) {
      parts.push_back(std::move(*part));
    } else if (first) {
      first = PassOn(part);
    }
  }
  return first;
}

Result<Region> ReadTruthRegion(const Settings* table) {
  const Region fallback = Scene{}.truth_region;
  if (table == nullptr) return fallback;
  SettingsReader read(*table, "[truth]");
  const Region region = ReadRegion(read, "region", fallback);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return region;
}

/// Every table is read, past those with mistakes; the first of these is the answer.
Result<void> ReadTables(SettingsReader& read, Scene& scene) {
  Result<void> first;
  const auto keep = [&](const auto& done) {
    if (!done && first) first = PassOn(done);
    return done.has_value();
  };
  const auto camera = ReadCamera(read.Table("camera"));
  if (keep(camera)) scene.camera = *camera;
  const auto lens = ReadLens(read.Table("lens"));
  if (keep(lens)) scene.lens = *lens;
  keep(ReadParts(read, "surface", ReadSurface, scene.surfaces));
  keep(ReadParts(read, "light", ReadLight, scene.lights));
  keep(ReadParts(read, "fault", ReadFault, scene.faults));
  const Settings* truth = read.Table("truth");
  const auto region = ReadTruthRegion(truth);
  if (keep(region)) scene.truth_region = *region;
  read.Any("frame");  // its size has to be the camera's
  if (!first) return first;
  const auto prepared = [&](const Settings& table) { return ReadPreparedFrame(table, scene.camera); };
  return ReadParts<PreparedFrame>(read, "frame", prepared, scene.frames);
}

Result<Scene> SceneFromSettings(const Settings& settings) {
  Scene scene;
  SettingsReader read(settings, "the scene");
  if (read.RequiredNumber("version") != 1.0) read.Reject("version", "must be 1");
  if (const auto tables = ReadTables(read, scene); !tables) {
    (void)read.Finish();  // what else is wrong is told where all mistakes are asked for
    return PassOn(tables);
  }
  const bool sways = std::ranges::any_of(scene.surfaces, [](const Surface& surface) { return surface.sway_m > 0; });
  if (sways && (scene.surfaces.size() + scene.lights.size() > 1 || scene.lens.model != LensModel::Thin)) {
    read.Reject("surface", "has a wall that sways (sway_m): it must be the only thing there, before a thin lens");
  }
  if (scene.surfaces.empty() && scene.lights.empty()) read.Reject("", "needs a [[surface]] or a [[light]] to look at");
  constexpr double kNearest = 0.95;  // of the way to the nearest thing
  if (1e-3 * scene.lens.centre_shift_mm * SpanOf(scene).near_d > kNearest) {
    read.Reject("lens", "has a centre_shift_mm that moves the lens into the scene");
  }
  if (auto done = read.Finish(); !done) return PassOn(done);
  return scene;
}

}  // namespace

/// A plane n.X = d comes nearer by n_z times the way: its vergence in every direction changes by the same factor.
Scene SeenFrom(const Scene& scene, double ahead_m) {
  Scene seen = scene;
  for (Surface& surface : seen.surfaces) {
    if (auto* plane = std::get_if<PlaneShape>(&surface.shape)) {
      const double nearer = 1.0 / (1.0 - ahead_m * plane->u0_d);
      *plane = {plane->u0_d * nearer, plane->ux_d * nearer, plane->uy_d * nearer};
      continue;
    }
    auto& map = std::get<DepthMapShape>(surface.shape);
    DepthMap depths = *map.depth;
    for (float& depth_m : depths.depth_m) depth_m -= static_cast<float>(ahead_m);
    map.depth = std::make_shared<const DepthMap>(std::move(depths));
  }
  for (LightPoint& light : seen.lights) light.distance_m -= ahead_m;
  return seen;
}

double SwayD(const Scene& scene, double seconds) {
  const auto sways = std::ranges::find_if(scene.surfaces, [](const Surface& surface) { return surface.sway_m > 0; });
  if (sways == scene.surfaces.end()) return 0.0;
  const double before_d = std::get<PlaneShape>(sways->shape).u0_d;
  const double moved_m = sways->sway_m * std::sin(2.0 * std::numbers::pi * seconds / sways->sway_s);
  return 1.0 / (1.0 / before_d + moved_m) - before_d;
}

Result<Scene> LoadScene(const std::string& path) {
  const auto settings = io::ReadTomlFile(path);
  if (!settings) return PassOn(settings);
  return SceneFromSettings(*settings);
}

}  // namespace lensd::sim
