// Checks what is asked, drops what can never be seen, and takes the first renderer of the table that can make the
// picture within the tolerance. Points of light are added last.
#include "sim/render.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

#include "render/blur_line.h"
#include "render/canvas.h"
#include "render/disk_kernel.h"
#include "render/ray_tracer.h"
#include "render/view.h"

namespace lensd::sim {

struct Renderer::Prepared {
  CameraSettings camera;
  ApertureShape shape;
  std::vector<Canvas> canvases;
  std::vector<LightPoint> lights;
};

namespace {

/// One way to make a picture, cheapest first in the table below.
struct Way {
  Algorithm algorithm;
  std::string_view name;
  bool (*can)(const View&);
  double (*bound)(const View&);
  Raster (*render)(const View&);
  Raster (*render_by_rays)(const View&, const RayBudget&);  ///< instead of bound and render: as exact as asked
};

constexpr double kRounding = 4e-6;  // of sums over a disk in single precision

Raster JustLayers(const View& view) {
  return RenderLayers(view);
}

constexpr Way kWays[] = {
    {Algorithm::Fourier, "fourier", CanFourier, [](const View&) { return 1e-7; }, RenderFourier, nullptr},
    {Algorithm::Wall, "wall", CanWall, [](const View&) { return kRounding; }, RenderWall, nullptr},
    {Algorithm::Gather, "gather", CanGather, GatherBound, RenderGather, nullptr},
    {Algorithm::Plane, "plane", CanPlane, PlaneBound, RenderPlane, nullptr},
    {Algorithm::Layers, "layers", CanLayers, LayersBound, JustLayers, nullptr},
    {Algorithm::Hybrid, "hybrid", [](const View& view) { return CanLayers(view) && CanMarch(view); }, nullptr, nullptr,
     RenderHybrid},
    {Algorithm::March, "march", CanMarch, nullptr, nullptr, RenderMarch},
    {Algorithm::Rays, "rays", [](const View&) { return true; }, nullptr, nullptr, RenderRays},
    {Algorithm::Splat, "splat", CanSplat, [](const View&) { return 1.0; }, RenderSplat, nullptr},
};

Result<const Way*> Choose(const View& view, const RenderOptions& options) {
  for (const Way& way : kWays) {
    if (options.algorithm == Algorithm::Auto) {
      if (way.can(view) && (way.bound == nullptr || way.bound(view) <= options.tolerance)) return &way;
    } else if (way.algorithm == options.algorithm) {
      if (way.can(view)) return &way;
      return Fail(Code::Unsupported,
                  "the renderer '" + std::string(way.name) + "' cannot render this scene; 'auto' can");
    }
  }
  return Fail(Code::InvalidArgument, "there is no such renderer");
}

struct Made {
  Raster image;
  double bound;
};

Made Make(const View& view, const Way& way, const RenderOptions& options) {
  if (way.render_by_rays == nullptr) return {way.render(view), way.bound(view)};
  const bool exactly = options.algorithm != Algorithm::Auto;
  const RayBudget budget(view, options.tolerance, options.rays_per_pixel, exactly);
  return {way.render_by_rays(view, budget), budget.Bound()};
}

/// Whether the wall hides everything of the other surface from every point of the sensor.
bool Hides(const Canvas& wall, const Canvas& other) {
  if (!wall.is_wall() || !wall.CoversAll() || (other.is_plane() && !other.is_wall())) return false;
  return wall.min_vergence() >= other.max_vergence();
}

/// Drops what can never be seen. Of two walls in the same place the first stays.
std::vector<Canvas> VisibleOf(std::vector<Canvas> canvases) {
  std::vector<Canvas> visible;
  for (std::size_t i = 0; i < canvases.size(); ++i) {
    bool hidden = false;
    for (std::size_t j = 0; j < canvases.size(); ++j) {
      const bool tie = Hides(canvases[i], canvases[j]);
      hidden = hidden || (j != i && Hides(canvases[j], canvases[i]) && !(tie && i < j));
    }
    if (!hidden) visible.push_back(canvases[i]);
  }
  return visible;
}

/// A point of light spreads its energy evenly over its disk, one pixel wide at least, wherever nothing stands between.
void AddLight(const View& view, double centre_x, double centre_y, const LightPoint& light, Raster& image) {
  const double vergence = 1.0 / light.distance_m;
  const double away = view.line.At(vergence);
  const double diameter = std::copysign(std::max(std::abs(away), 1.0), away);
  const double reach = view.shape.reach() * std::abs(diameter);
  const double area = view.shape.AreaIn(diameter, -reach, -reach, reach, reach);
  const PixelRect all = image.rect;
  const auto first = [&](double centre, int low) {
    return std::max(low, static_cast<int>(std::floor(centre - reach)));
  };
  const auto last = [&](double centre, int high) {
    return std::min(high, static_cast<int>(std::ceil(centre + reach)));
  };
  for (int y = first(centre_y, all.y); y < last(centre_y, all.y + all.height); ++y) {
    for (int x = first(centre_x, all.x); x < last(centre_x, all.x + all.width); ++x) {
      const double cover = view.shape.AreaIn(diameter, x - centre_x, y - centre_y, x + 1 - centre_x, y + 1 - centre_y);
      if (cover <= 0.0) continue;
      AperturePoint through{};
      if (std::abs(away) >= 1.0) through = {(x + 0.5 - centre_x) / away, (y + 0.5 - centre_y) / away};
      if (!IsSeen(view.canvases, view.line, centre_x, centre_y, vergence, through)) continue;
      image.Row(y)[x - all.x] += static_cast<float>(light.intensity * cover / area);
    }
  }
}

Result<void> CheckState(const OpticalState& state) {
  const auto bad = [](double value) { return !std::isfinite(value) || value <= 0.0; };
  if (bad(state.sensor_distance_m) || bad(state.magnification) ||
      (state.model == LensModel::Thin && bad(state.focal_length_m)) || !std::isfinite(state.aperture_diameter_m) ||
      state.aperture_diameter_m < 0.0) {
    return Fail(Code::InvalidArgument,
                "the lens's focal length, sensor distance and magnification must be finite and above 0, its aperture "
                "finite and not negative");
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
  for (const Way& way : kWays) {
    if (way.algorithm == algorithm) return way.name;
  }
  return "auto";
}

Renderer::Renderer(std::unique_ptr<const Prepared> prepared) : prepared_(std::move(prepared)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

Result<Renderer> Renderer::Create(const Scene& scene) {
  if (scene.lens.aperture_blades != 0 && scene.lens.aperture_blades < 3) {
    return Fail(Code::InvalidArgument, "an aperture has three blades or more, or 0 for a circle");
  }
  if (scene.camera.width <= 0 || scene.camera.height <= 0 || !(scene.camera.pixel_um > 0.0)) {
    return Fail(Code::InvalidArgument, "the scene's camera needs a width, a height and a pixel size above 0");
  }
  auto prepared = std::make_unique<Prepared>();
  prepared->camera = scene.camera;
  prepared->lights = scene.lights;
  prepared->shape = ApertureShape(scene.lens.aperture_blades);
  for (const Surface& surface : scene.surfaces) prepared->canvases.emplace_back(surface, scene.camera);
  prepared->canvases = VisibleOf(std::move(prepared->canvases));
  return Renderer(std::move(prepared));
}

Result<Rendered> Renderer::Render(const OpticalState& state, const RenderOptions& options) const {
  if (Result<void> checked = CheckState(state); !checked) return PassOn(checked);
  const Result<PixelRect> region = RegionOf(prepared_->camera, options);
  if (!region) return PassOn(region);
  const CameraSettings& camera = prepared_->camera;
  std::vector<Canvas> magnified;
  if (state.magnification != 1.0) {
    for (const Canvas& canvas : prepared_->canvases) magnified.push_back(canvas.Magnified(state.magnification));
  }
  const View view{magnified.empty() ? prepared_->canvases : magnified, BlurLineOf(camera, state), *region,
                  prepared_->shape, options.stop};
  const Result<const Way*> way = Choose(view, options);
  if (!way) return PassOn(way);
  Made made = Make(view, **way, options);
  if (options.stop.stop_requested()) return Fail(Code::Cancelled, "rendering was called off");
  for (float& light : made.image.values) light = std::max(light, 0.0f);  // what a band-limited picture overshoots black
  for (const LightPoint& light : prepared_->lights) {
    const auto place = [&](double fraction, int size) {
      return 0.5 * size + (fraction * size - 0.5 * size) * state.magnification;
    };
    AddLight(view, place(light.x, camera.width), place(light.y, camera.height), light, made.image);
  }
  return Rendered{.image = {region->width, region->height, std::move(made.image.values)},
                  .region = *region,
                  .algorithm = (*way)->algorithm,
                  .error_bound = made.bound};
}

}  // namespace lensd::sim
