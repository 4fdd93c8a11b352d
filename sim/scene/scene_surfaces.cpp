// The surfaces and lights of a scene file.
#include <algorithm>
#include <cmath>

#include "sim/scene/scene_images.h"
#include "sim/scene/scene_parts.h"

namespace lensd::sim {
namespace {

constexpr Range kShare{0.0, 1.0};

/// A picture's own error, with the place that named it: the reader of a scene wants to know both.
template <class Picture>
std::shared_ptr<const Picture> Load(SettingsReader& read, std::string_view key,
                                    Result<std::shared_ptr<const Picture>> (*load)(const std::string&)) {
  const auto path = read.OptionalPath(key);
  if (!path) {
    if (!read.Has(key)) read.Reject(key, "is missing");
    return nullptr;
  }
  auto picture = load(*path);
  if (!picture) {
    read.Reject(key, "cannot be used: " + picture.error().message);
    return nullptr;
  }
  return *picture;
}

PlaneShape ReadPlane(SettingsReader& read, const Region& region) {
  const auto vergence = read.OptionalNumbers("vergence_d", 3, {-1e4, 1e4});
  if (!vergence) {
    if (!read.Has("vergence_d")) read.Reject("vergence_d", "is missing");
    return {};
  }
  const PlaneShape plane{(*vergence)[0], (*vergence)[1], (*vergence)[2]};
  for (const double x : {region.x, region.x + region.w}) {
    for (const double y : {region.y, region.y + region.h}) {
      const double corner = plane.u0_d + plane.ux_d * (2.0 * x - 1.0) + plane.uy_d * (2.0 * y - 1.0);
      if (corner < -1e-12 || corner > 1000.0) {
        read.Reject("vergence_d", "must stay between 0 and 1000 dioptres over the region");
      }
    }
  }
  return plane;
}

SinusoidPaint ReadSinusoid(SettingsReader& read) {
  const auto periods = read.OptionalNumbers("sinusoid_px", 2, {0.0, 1e6});
  if (!periods) return {};
  const bool flat = periods->front() == 0.0 && periods->back() == 0.0;
  if (flat) read.Reject("sinusoid_px", "needs a period above 0 along x or y");
  return {periods->front(), periods->back()};
}

Paint ReadPaint(SettingsReader& read, bool on_depth_map) {
  int given = 0;
  for (const std::string_view key : {"texture", "sinusoid_px", "constant", "gradient"}) given += read.Has(key) ? 1 : 0;
  if (given != 1) read.Reject("", "needs exactly one of texture, sinusoid_px, constant and gradient");
  if (read.Has("texture")) {
    TexturePaint paint;
    paint.stretched = on_depth_map && !read.Has("texture_px_per_image_px");
    paint.texture_px_per_image_px = read.Number("texture_px_per_image_px", 1.0, {1e-4, 1e4});
    paint.texture = Load(read, "texture", LoadTexture);
    return paint;
  }
  if (read.Has("sinusoid_px")) return ReadSinusoid(read);
  if (read.Has("gradient")) {
    const auto ends = read.OptionalNumbers("gradient", 2, kShare).value_or(std::vector{0.0, 1.0});
    return GradientPaint{ends.front(), ends.back()};
  }
  return ConstantPaint{read.Number("constant", 0.5, kShare)};
}

}  // namespace

Result<PreparedFrame> ReadPreparedFrame(const Settings& table, const CameraSettings& camera) {
  SettingsReader read(table, "[[frame]]");
  PreparedFrame frame;
  const auto path = read.OptionalPath("file");
  if (!path && !read.Has("file")) read.Reject("file", "is missing");
  if (path) {
    auto loaded = LoadPreparedFrame(*path, camera);
    if (!loaded) read.Reject("file", "cannot be used: " + loaded.error().message);
    if (loaded) frame = *std::move(loaded);
  }
  if (auto done = read.Finish(); !done) return PassOn(done);
  return frame;
}

Region ReadRegion(SettingsReader& read, std::string_view key, Region fallback) {
  const auto numbers = read.OptionalNumbers(key, 4, kShare);
  if (!numbers) return fallback;
  const Region region{(*numbers)[0], (*numbers)[1], (*numbers)[2], (*numbers)[3]};
  constexpr double kRounding = 1e-9;
  if (region.w <= 0.0 || region.h <= 0.0 || region.x + region.w > 1.0 + kRounding ||
      region.y + region.h > 1.0 + kRounding) {
    read.Reject(key, "must be x, y, w, h as fractions of the frame, not empty and inside it");
  }
  return region;
}

double ReadDistance(SettingsReader& read, std::string_view key) {
  const Settings* found = read.Any(key);
  const double infinity = std::numeric_limits<double>::infinity();
  if (found != nullptr && found->AsNumber() == infinity) return infinity;
  return read.RequiredNumber(key, {1e-3, 1e9});
}

Result<Surface> ReadSurface(const Settings& table) {
  SettingsReader read(table, "[[surface]]");
  Surface surface;
  surface.region = ReadRegion(read, "region", surface.region);
  read.RequiredText("kind");
  const auto kind = read.Choice("kind", {"wall", "plane", "depth-map"}, 0);
  if (kind == 0) {
    const double distance_m = ReadDistance(read, "distance_m");
    surface.shape = PlaneShape{1.0 / distance_m, 0.0, 0.0};
    surface.sway_m = read.Number("sway_m", surface.sway_m, {0.0, 1e3});
    surface.sway_s = read.Number("sway_s", surface.sway_s, {1e-3, 1e6});
    if (!(surface.sway_m < distance_m)) read.Reject("sway_m", "must be less than distance_m");
  }
  if (kind == 1) surface.shape = ReadPlane(read, surface.region);
  if (kind == 2) surface.shape = DepthMapShape{Load(read, "file", LoadDepthMap)};
  surface.paint = ReadPaint(read, kind == 2);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return surface;
}

Result<LightPoint> ReadLight(const Settings& table) {
  LightPoint light;
  SettingsReader read(table, "[[light]]");
  light.x = read.Number("x", light.x, kShare);
  light.y = read.Number("y", light.y, kShare);
  light.distance_m = ReadDistance(read, "distance_m");
  light.intensity = read.Number("intensity", light.intensity, {0.0, 1e9});
  if (auto done = read.Finish(); !done) return PassOn(done);
  return light;
}

}  // namespace lensd::sim
