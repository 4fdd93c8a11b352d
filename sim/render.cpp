#include "sim/render.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "blur_line.h"
#include "canvas.h"
#include "disk_kernel.h"
#include "ray_tracer.h"
#include "varying_blur.h"

namespace lensd::sim {

struct Renderer::Prepared {
  CameraSettings camera;
  std::vector<Canvas> canvases;
  std::vector<LightPoint> lights;
};

namespace {

/// The picture without blur: in each cell the nearest surface's light and vergence.
struct Picture {
  Raster light;
  Raster vergence;
};

Picture PictureOver(const std::vector<Canvas>& canvases, PixelRect rect) {
  Picture picture{Raster(rect), Raster(rect)};
  bool first = true;
  for (const Canvas& canvas : canvases) {
    const Raster light = canvas.LightOver(rect);
    const Raster vergence = canvas.VergenceOver(rect);
    std::size_t i = 0;
    for (int y = rect.y; y < rect.y + rect.height; ++y) {
      for (int x = rect.x; x < rect.x + rect.width; ++x, ++i) {
        const bool nearer = vergence.values[i] > picture.vergence.values[i] || (first && canvas.CoversAll());
        if (!nearer || !canvas.Covers(x, y)) continue;
        picture.light.values[i] = light.values[i];
        picture.vergence.values[i] = vergence.values[i];
      }
    }
    first = false;
  }
  return picture;
}

Raster RenderRays(const std::vector<Canvas>& canvases, const BlurLine& line, PixelRect region, int rays_per_pixel) {
  const RayTracer tracer(canvases, line, rays_per_pixel);
  Raster image(region);
  for (int y = region.y; y < region.y + region.height; ++y) {
    for (int x = 0; x < region.width; ++x) {
      image.Row(y)[x] = static_cast<float>(tracer.LightAt(region.x + x + 0.5, y + 0.5));
    }
  }
  return image;
}

Raster RenderGather(const std::vector<Canvas>& canvases, const BlurLine& line, PixelRect region) {
  Raster diameters = PictureOver(canvases, region).vergence;
  float largest = 0.0f;
  for (float& value : diameters.values) {
    value = static_cast<float>(std::abs(line.At(static_cast<double>(value))));
    largest = std::max(largest, value);
  }
  const int reach = ReachOf(static_cast<double>(largest));
  const SummedRaster source(PictureOver(canvases, Grown(region, reach)).light);
  Raster image(region);
  BlurVarying(source, diameters, image);
  return image;
}

/// A point of light spreads its energy evenly over its disk, one pixel wide at least, wherever nothing stands between.
void AddLight(const std::vector<Canvas>& canvases, const BlurLine& line, const CameraSettings& camera,
              const LightPoint& light, Raster& image) {
  const double centre_x = light.x * camera.width;
  const double centre_y = light.y * camera.height;
  const double vergence = 1.0 / light.distance_m;
  const double away = line.At(vergence);
  const double diameter = std::max(std::abs(away), 1.0);
  const double area = DiskInRectangle(diameter, -diameter, -diameter, diameter, diameter);
  const PixelRect all = image.rect;
  const auto first = [&](double centre, int low) {
    return std::max(low, static_cast<int>(std::floor(centre - 0.5 * diameter)));
  };
  const auto last = [&](double centre, int high) {
    return std::min(high, static_cast<int>(std::ceil(centre + 0.5 * diameter)));
  };
  for (int y = first(centre_y, all.y); y < last(centre_y, all.y + all.height); ++y) {
    for (int x = first(centre_x, all.x); x < last(centre_x, all.x + all.width); ++x) {
      const double cover = DiskInRectangle(diameter, x - centre_x, y - centre_y, x + 1 - centre_x, y + 1 - centre_y);
      if (cover <= 0.0) continue;
      AperturePoint through{};
      if (std::abs(away) >= 1.0) through = {(x + 0.5 - centre_x) / away, (y + 0.5 - centre_y) / away};
      if (!IsSeen(canvases, line, centre_x, centre_y, vergence, through)) continue;
      image.Row(y)[x - all.x] += static_cast<float>(light.intensity * cover / area);
    }
  }
}

Result<void> CheckState(const OpticalState& state) {
  const auto bad = [](double value) { return !std::isfinite(value) || value <= 0.0; };
  if (bad(state.sensor_distance_m) || (state.model == LensModel::Thin && bad(state.focal_length_m)) ||
      !std::isfinite(state.aperture_diameter_m) || state.aperture_diameter_m < 0.0) {
    return Fail(Code::InvalidArgument,
                "the lens's focal length and sensor distance must be finite and above 0, its aperture finite and not "
                "negative");
  }
  return {};
}

Result<PixelRect> RegionOf(const CameraSettings& camera, const RenderOptions& options) {
  const PixelRect frame{0, 0, camera.width, camera.height};
  const PixelRect region = options.region.value_or(frame);
  const bool inside = region.x >= 0 && region.y >= 0 && region.width > 0 && region.height > 0 &&
                      region.width <= frame.width - region.x && region.height <= frame.height - region.y;
  if (!inside) {
    return Fail(Code::InvalidArgument, "the region to render must hold pixels and lie inside the " +
                                           std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                                           " frame");
  }
  return region;
}

}  // namespace

std::string_view NameOf(Algorithm algorithm) {
  switch (algorithm) {
    case Algorithm::Auto:
      return "auto";
    case Algorithm::Rays:
      return "rays";
    case Algorithm::Gather:
      return "gather";
  }
  return "auto";
}

Renderer::Renderer(std::unique_ptr<const Prepared> prepared) : prepared_(std::move(prepared)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

Result<Renderer> Renderer::Create(const Scene& scene) {
  if (scene.camera.width <= 0 || scene.camera.height <= 0 || !(scene.camera.pixel_um > 0.0)) {
    return Fail(Code::InvalidArgument, "the scene's camera needs a width, a height and a pixel size above 0");
  }
  auto prepared = std::make_unique<Prepared>();
  prepared->camera = scene.camera;
  prepared->lights = scene.lights;
  for (const Surface& surface : scene.surfaces) prepared->canvases.emplace_back(surface, scene.camera);
  return Renderer(std::move(prepared));
}

Result<Rendered> Renderer::Render(const OpticalState& state, const RenderOptions& options) const {
  if (Result<void> checked = CheckState(state); !checked) return PassOn(std::move(checked));
  const Result<PixelRect> region = RegionOf(prepared_->camera, options);
  if (!region) return std::unexpected(region.error());
  const BlurLine line = BlurLineOf(prepared_->camera, state);
  const std::vector<Canvas>& canvases = prepared_->canvases;
  const bool rays = options.algorithm == Algorithm::Rays;
  Raster image =
      rays ? RenderRays(canvases, line, *region, options.rays_per_pixel) : RenderGather(canvases, line, *region);
  for (const LightPoint& light : prepared_->lights) AddLight(canvases, line, prepared_->camera, light, image);
  return Rendered{.image = {region->width, region->height, std::move(image.values)},
                  .region = *region,
                  .algorithm = rays ? Algorithm::Rays : Algorithm::Gather,
                  .error_bound = rays ? 0.0 : 1.0};
}

}  // namespace lensd::sim
