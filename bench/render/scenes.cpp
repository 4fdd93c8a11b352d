// Whole scenes, where renderers differ in what they know about things hiding each other.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "bench/cpu_time.h"
#include "bench/render/cases.h"
#include "sim/render.h"

namespace lensd::bench {
namespace {

using sim::Algorithm;

constexpr int kWidth = 192;
constexpr int kHeight = 128;

struct Case {
  std::string name;
  sim::Scene scene;
  sim::OpticalState state;
};

/// Noise over four octaves, as lively as a photograph.
sim::TexturePaint Texture(std::uint32_t seed) {
  auto texture = std::make_shared<sim::Texture>();
  *texture = {kWidth, kHeight, std::vector<float>(static_cast<std::size_t>(kWidth) * kHeight, 0.5f)};
  for (const int size : {1, 2, 4, 8}) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const auto cell = static_cast<std::uint32_t>((y / size) * kWidth + x / size) * 2654435761u + seed * 40503u;
        const std::uint32_t mixed = (cell ^ (cell >> 15)) * 2246822519u;
        texture->light[static_cast<std::size_t>(y * kWidth + x)] +=
            0.25f * (static_cast<float>(mixed >> 8) / 16777216.0f - 0.5f);
      }
    }
    seed += 7;
  }
  return {texture, 1.0, false};
}

sim::Scene Empty() {
  sim::Scene scene;
  scene.camera.width = kWidth;
  scene.camera.height = kHeight;
  scene.camera.pixel_um = 5.0;
  return scene;
}

sim::OpticalState FocusedAt(double vergence_d) {
  return {sim::LensModel::Thin, 0.025, 0.008, 1.0 / (40.0 - vergence_d)};
}

std::vector<Case> Cases() {
  sim::Scene layers = Empty();
  layers.surfaces = {{sim::PlaneShape{0.5, 0.0, 0.0}, {}, Texture(1)},
                     {sim::PlaneShape{1.0, 0.0, 0.0}, {0.5, 0.0, 0.5, 1.0}, Texture(2)}};
  sim::Scene wire = Empty();
  wire.surfaces = {{sim::PlaneShape{0.5, 0.0, 0.0}, {}, Texture(3)},
                   {sim::PlaneShape{1.2, 0.0, 0.0}, {0.5, 0.0, 2.0 / kWidth, 1.0}, Texture(4)}};
  sim::Scene tilted = Empty();
  tilted.surfaces = {{sim::PlaneShape{1.0, 0.1, 0.05}, {}, Texture(5)}};
  sim::Scene steps = Empty();
  auto depth = std::make_shared<sim::DepthMap>();
  *depth = {kWidth, kHeight, {}};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool disk = std::hypot(x - 60, y - 64) < 30.0;
      depth->depth_m.push_back(disk ? 0.9f : 1.3f + 0.002f * static_cast<float>(x) + (x / 12 % 3 == 0 ? 0.2f : 0.0f));
    }
  }
  sim::TexturePaint paint = Texture(6);
  paint.stretched = true;
  steps.surfaces = {{sim::DepthMapShape{depth}, {}, paint}};
  sim::Scene colour = Empty();
  colour.surfaces = {{sim::PlaneShape{1.0, 0.0, 0.0}, {}, sim::ConstantPaint{0.5}}};
  sim::Scene sinusoid = Empty();
  sinusoid.surfaces = {{sim::PlaneShape{1.0, 0.0, 0.0}, {}, sim::SinusoidPaint{12.0, 16.0}}};
  sim::Scene wall = Empty();
  wall.surfaces = {{sim::PlaneShape{1.0, 0.0, 0.0}, {}, Texture(7)}};
  return {{"one colour", std::move(colour), FocusedAt(0.75)}, {"sinusoid", std::move(sinusoid), FocusedAt(0.75)},
          {"one wall", std::move(wall), FocusedAt(0.75)},     {"two layers", std::move(layers), FocusedAt(0.75)},
          {"thin wire", std::move(wire), FocusedAt(0.8)},     {"tilted plane", std::move(tilted), FocusedAt(1.0)},
          {"depth map", std::move(steps), FocusedAt(0.8)}};
}

/// Vergence of the nearest surface, pixel by pixel; 0 where there is none.
std::vector<double> NearestVergence(const sim::Scene& scene) {
  const int width = scene.camera.width, height = scene.camera.height;
  std::vector<double> vergence;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double fx = (x + 0.5) / width, fy = (y + 0.5) / height;
      double nearest = 0.0;
      for (const sim::Surface& surface : scene.surfaces) {
        const sim::Region& r = surface.region;
        if (fx < r.x || fx >= r.x + r.w || fy < r.y || fy >= r.y + r.h) continue;
        if (const auto* plane = std::get_if<sim::PlaneShape>(&surface.shape)) {
          nearest = std::max(nearest, plane->u0_d + plane->ux_d * (2 * fx - 1) + plane->uy_d * (2 * fy - 1));
        } else {
          const sim::DepthMap& map = *std::get<sim::DepthMapShape>(surface.shape).depth;
          const auto column = static_cast<std::size_t>(fx * map.width), row = static_cast<std::size_t>(fy * map.height);
          const auto at = row * static_cast<std::size_t>(map.width) + column;
          nearest = std::max(nearest, 1.0 / static_cast<double>(map.depth_m[at]));
        }
      }
      vergence.push_back(nearest);
    }
  }
  return vergence;
}

/// Pixels within a blur radius of a cell at whose edge the nearest surface changes by more than a tenth of a dioptre or
/// a pixel of blur.
std::vector<char> BoundaryOf(const Case& tested) {
  const int width = tested.scene.camera.width, height = tested.scene.camera.height;
  const std::vector<double> vergence = NearestVergence(tested.scene);
  const auto blur = [&](double v) { return SignedBlurPx(tested.scene.camera, tested.state, v); };
  double widest = 0.0;
  for (const double v : vergence) widest = std::max(widest, std::abs(blur(v)));
  const int reach = static_cast<int>(std::ceil(0.5 * widest)) + 1;
  std::vector<char> boundary(vergence.size());
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y * width + x); };
  const auto mark = [&](int x, int y) {
    for (int j = std::max(0, y - reach); j <= std::min(height - 1, y + reach); ++j) {
      for (int i = std::max(0, x - reach); i <= std::min(width - 1, x + reach); ++i) boundary[at(i, j)] = 1;
    }
  };
  const auto breaks = [&](double a, double b) { return std::abs(a - b) > 0.1 || std::abs(blur(a) - blur(b)) > 1.0; };
  for (int y = 0; y + 1 < height; ++y) {
    for (int x = 0; x + 1 < width; ++x) {
      const double here = vergence[at(x, y)];
      if (breaks(here, vergence[at(x + 1, y)]) || breaks(here, vergence[at(x, y + 1)])) mark(x, y);
    }
  }
  return boundary;
}

/// The scene of a file, in focus at its nearest subject, its farthest and halfway between in vergence.
Result<std::vector<Case>> CasesOf(const std::string& path) {
  auto scene = sim::LoadScene(path);
  if (!scene) return PassOn(scene);
  const std::vector<double> vergence = NearestVergence(*scene);
  const auto [far, near] = std::ranges::minmax(vergence);
  const double f = 1e-3 * scene->lens.min_focal_length_mm;
  std::vector<Case> cases;
  for (const auto& [name, focus_d] : {std::pair("far", far), {"middle", (far + near) / 2.0}, {"near", near}}) {
    const sim::OpticalState state{scene->lens.model, f, f / scene->lens.initial_f_number, 1.0 / (1.0 / f - focus_d)};
    cases.push_back({path.substr(path.find_last_of('/') + 1) + ", " + name, *scene, state});
  }
  return cases;
}

/// Whether a renderer blurs by kernels on the grid of pixels, at least in part.
bool ByKernels(Algorithm algorithm) {
  return algorithm != Algorithm::Fourier && algorithm != Algorithm::March && algorithm != Algorithm::Rays;
}

/// The error that a share of the pixels (of the boundary, of the others, or all) exceeds, in levels.
std::optional<double> ErrorOf(const sim::LightImage& image, const sim::LightImage& truth,
                              const std::vector<char>& boundary, std::optional<char> wanted, double below) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    if (!wanted || boundary[i] == *wanted)
      errors.push_back(255.0 * std::abs(static_cast<double>(image.light[i]) - static_cast<double>(truth.light[i])));
  }
  if (errors.size() < 100) return std::nullopt;
  const auto at = static_cast<std::ptrdiff_t>(below * static_cast<double>(errors.size() - 1));
  std::nth_element(errors.begin(), errors.begin() + at, errors.end());
  return errors[static_cast<std::size_t>(at)];
}

}  // namespace

Result<std::vector<RenderRow>> SceneRows(const std::string& path) {
  struct Try {
    Algorithm algorithm;
    int rays;
  };
  constexpr Try kTries[] = {{Algorithm::Auto, 0},   {Algorithm::Fourier, 0}, {Algorithm::Wall, 0},
                            {Algorithm::Gather, 0}, {Algorithm::Plane, 0},   {Algorithm::Layers, 0},
                            {Algorithm::March, 64}, {Algorithm::March, 512}, {Algorithm::March, 4096},
                            {Algorithm::Rays, 64},  {Algorithm::Rays, 512}};
  std::vector<RenderRow> rows;
  auto cases = path.empty() ? Result<std::vector<Case>>(Cases()) : CasesOf(path);
  if (!cases) return PassOn(cases);
  const int truth_rays = path.empty() ? 100000 : 20000;
  for (const Case& tested : *cases) {
    const auto renderer = sim::Renderer::Create(tested.scene);
    if (!renderer) continue;
    const std::vector<char> boundary = BoundaryOf(tested);
    // Rays in step are the same rays, only quicker; a tilted plane needs them one by one.
    auto truth = renderer->Render(tested.state, {.algorithm = Algorithm::March, .rays_per_pixel = truth_rays});
    if (!truth) truth = renderer->Render(tested.state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 6000});
    if (!truth) continue;
    const double fine = renderer->ShortPeriodError(tested.state);
    for (const Try& attempt : kTries) {
      sim::RenderOptions options{.algorithm = attempt.algorithm};
      if (!path.empty() && attempt.algorithm == Algorithm::Rays && attempt.rays > 64) continue;  // minutes
      if (attempt.rays > 0) options.rays_per_pixel = attempt.rays;
      Result<sim::Rendered> rendered = Fail(Code::Internal, "not rendered");
      const double ms = MedianCpuMs(
          attempt.algorithm == Algorithm::Rays ? 1 : 3, [] {},
          [&] { rendered = renderer->Render(tested.state, options); });
      if (!rendered) continue;
      std::string name(NameOf(attempt.algorithm));
      if (attempt.algorithm == Algorithm::Auto) name += " (" + std::string(NameOf(rendered->algorithm)) + ")";
      rows.push_back({.family = "scene",
                      .scene = tested.name,
                      .renderer = std::move(name),
                      .rays = attempt.rays > 0 ? std::optional(attempt.rays) : std::nullopt,
                      .elapsed_ms = ms,
                      .interior_error = ErrorOf(rendered->image, truth->image, boundary, 0, 0.999),
                      .boundary_error = ErrorOf(rendered->image, truth->image, boundary, 1, 0.999),
                      .error_bound = 255.0 * (rendered->error_bound + (ByKernels(rendered->algorithm) ? fine : 0.0)),
                      .p99_error = ErrorOf(rendered->image, truth->image, boundary, std::nullopt, 0.99)});
    }
  }
  return rows;
}

}  // namespace lensd::bench
