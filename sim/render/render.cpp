// Checks what is asked, drops what can never be seen, and takes the first renderer of the table that can make the
// picture within the tolerance. Points of light are added last.
#include "sim/render.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

#include "sim/render/blur_line.h"
#include "sim/render/canvas.h"
#include "sim/render/disk_kernel.h"
#include "sim/render/ray_tracer.h"
#include "sim/render/short_periods.h"
#include "sim/render/view.h"

namespace lensd::sim {

struct Renderer::Prepared {
  CameraSettings camera;
  LensSettings lens;
  ApertureShape shape;
  std::vector<Canvas> canvases;
  std::vector<LightPoint> lights;
};

namespace {

/// Which pupils a renderer knows.
enum class Pupils { Perfect, Uniform, Any };

/// One way to make a picture, cheapest first in the table below.
struct Way {
  Algorithm algorithm;
  std::string_view name;
  Pupils pupils;
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
    {Algorithm::Fourier, "fourier", Pupils::Perfect, CanFourier, [](const View&) { return 1e-7; }, RenderFourier,
     nullptr},
    {Algorithm::Wall, "wall", Pupils::Perfect, CanWall, [](const View&) { return kRounding; }, RenderWall, nullptr},
    {Algorithm::Gather, "gather", Pupils::Perfect, CanGather,
     [](const View& view) { return GatherBound(view) + kRounding; }, RenderGather, nullptr},
    {Algorithm::Pupil, "pupil", Pupils::Any, CanPupil, PupilBound, RenderPupil, nullptr},
    {Algorithm::Plane, "plane", Pupils::Perfect, CanPlane, PlaneBound, RenderPlane, nullptr},
    {Algorithm::Layers, "layers", Pupils::Perfect, CanLayers, LayersBound, JustLayers, nullptr},
    {Algorithm::Hybrid, "hybrid", Pupils::Perfect, [](const View& view) { return CanLayers(view) && CanMarch(view); },
     nullptr, nullptr, RenderHybrid},
    {Algorithm::March, "march", Pupils::Uniform, CanMarch, nullptr, nullptr, RenderMarch},
    {Algorithm::Rays, "rays", Pupils::Any, [](const View&) { return true; }, nullptr, nullptr, RenderRays},
    {Algorithm::Splat, "splat", Pupils::Perfect, CanSplat, [](const View&) { return 1.0; }, RenderSplat, nullptr},
};

bool Can(const Way& way, const View& view) {
  if (way.pupils == Pupils::Perfect && !view.pupil.is_perfect()) return false;
  if (way.pupils == Pupils::Uniform && !view.pupil.is_uniform()) return false;
  return way.can(view);
}

Result<const Way*> Choose(const View& view, const RenderOptions& options) {
  for (const Way& way : kWays) {
    if (options.algorithm == Algorithm::Auto) {
      if (Can(way, view) && (way.bound == nullptr || way.bound(view) <= options.tolerance)) return &way;
    } else if (way.algorithm == options.algorithm) {
      if (Can(way, view)) return &way;
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

/// The surfaces in a picture so many times as large; none where they may stay as they are.
std::vector<Canvas> MagnifiedOf(const std::vector<Canvas>& canvases, double magnification) {
  std::vector<Canvas> magnified;
  if (magnification == 1.0) return magnified;
  for (const Canvas& canvas : canvases) magnified.push_back(canvas.Magnified(magnification));
  return magnified;
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

/// The same through a pupil that is not perfect: ray by ray, each as wide as a pixel where it lands.
void AddLightByRays(const View& view, double centre_x, double centre_y, const LightPoint& light, Raster& image) {
  const double vergence = 1.0 / light.distance_m;
  const FieldPoint at = view.pupil.FieldAt(centre_x, centre_y);
  const BlurLine line = view.pupil.LineAt(view.line, at);
  const double away = line.At(vergence);
  const double widest = std::abs(away) + 2.0 * view.pupil.Reach(vergence);
  const auto rays = SpreadOverAperture(static_cast<int>(std::clamp(32.0 * widest * widest, 4096.0, 1e6)), view.shape);
  const double each = light.intensity / static_cast<double>(rays.size());
  std::vector<double> sums(image.values.size());  // so many rays would leave their mark on single precision
  for (const AperturePoint& through : rays) {
    if (!view.pupil.Passes(through, at)) continue;
    if (!IsSeen(view.canvases, line, centre_x, centre_y, vergence, through)) continue;
    const AperturePoint off = view.pupil.LandsOff(through, at);
    const double left = centre_x + through.x * away + off.x - 0.5, top = centre_y + through.y * away + off.y - 0.5;
    const int x = static_cast<int>(std::floor(left)), y = static_cast<int>(std::floor(top));
    const double right = left - x, lower = top - y;
    const auto add = [&](int column, int row, double share) {
      if (image.Holds(column, row)) {
        sums[static_cast<std::size_t>(image.Row(row) - image.values.data() + (column - image.rect.x))] += each * share;
      }
    };
    add(x, y, (1.0 - right) * (1.0 - lower));
    add(x + 1, y, right * (1.0 - lower));
    add(x, y + 1, (1.0 - right) * lower);
    add(x + 1, y + 1, right * lower);
  }
  for (std::size_t i = 0; i < sums.size(); ++i) image.values[i] += static_cast<float>(sums[i]);
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
  prepared->lens = scene.lens;
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
  const std::vector<Canvas> magnified = MagnifiedOf(prepared_->canvases, state.magnification);
  const Pupil pupil(prepared_->lens, camera, state);
  const View view{magnified.empty() ? prepared_->canvases : magnified,
                  BlurLineOf(camera, state),
                  *region,
                  prepared_->shape,
                  pupil,
                  options.stop};
  const Result<const Way*> way = Choose(view, options);
  if (!way) return PassOn(way);
  Made made = Make(view, **way, options);
  if (options.stop.stop_requested()) return Fail(Code::Cancelled, "rendering was called off");
  for (float& light : made.image.values) light = std::max(light, 0.0f);  // what a band-limited picture overshoots black
  for (const LightPoint& light : prepared_->lights) {
    const auto place = [&](double fraction, int size) {
      return 0.5 * size + (fraction * size - 0.5 * size) * state.magnification;
    };
    const auto add = pupil.is_perfect() ? AddLight : AddLightByRays;
    add(view, place(light.x, camera.width), place(light.y, camera.height), light, made.image);
  }
  return Rendered{.image = {region->width, region->height, std::move(made.image.values)},
                  .region = *region,
                  .algorithm = (*way)->algorithm,
                  .error_bound = made.bound};
}

double Renderer::ShortPeriodError(const OpticalState& state) const {
  const CameraSettings& camera = prepared_->camera;
  const std::vector<Canvas> magnified = MagnifiedOf(prepared_->canvases, state.magnification);
  const Pupil pupil(prepared_->lens, camera, state);
  return sim::ShortPeriodError({magnified.empty() ? prepared_->canvases : magnified,
                                BlurLineOf(camera, state),
                                {0, 0, camera.width, camera.height},
                                prepared_->shape,
                                pupil,
                                {}});
}

}  // namespace lensd::sim
