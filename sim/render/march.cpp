// Builds the programmes, sorted by vergence, and runs them. Compiled once for every instruction set.
#include "sim/render/march.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <tuple>
#include <utility>

#include "sim/render/cell_walk.h"
#include "sim/render/ray_tracer.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/render/march.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// A lane is a pixel; its light is summed in the order of the aperture points on every target.
HWY_BEFORE_NAMESPACE();
namespace lensd::sim::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// What a ray sees of the cells it meets at (dx, dy) from their middles.
template <class D>
HWY_INLINE hn::Vec<D> LightIn(D d, const CellLight& light, std::ptrdiff_t at, hn::Vec<D> mean, hn::Vec<D> dx,
                              hn::Vec<D> dy) {
  using V = hn::Vec<D>;
  const auto part = [&](CellLight::Part which) { return hn::LoadU(d, light.parts[which].values.data() + at); };
  const V spread = hn::Set(d, 1.0f / 12.0f);
  V sum = hn::Add(mean, hn::Mul(part(CellLight::kSlopeX), dx));
  sum = hn::Add(sum, hn::Mul(part(CellLight::kSlopeY), dy));
  sum = hn::Add(sum, hn::Mul(part(CellLight::kBendX), hn::Sub(hn::Mul(dx, dx), spread)));
  sum = hn::Add(sum, hn::Mul(part(CellLight::kBendY), hn::Sub(hn::Mul(dy, dy), spread)));
  return hn::Add(sum, hn::Mul(part(CellLight::kTwist), hn::Mul(dx, dy)));
}

/// Follows one ray of `kVectors` vectors of pixels and adds what they see.
template <class D, int kVectors>
HWY_INLINE void FollowRays(D d, const std::vector<March::Layer>& layers, const March::Path& path,
                           const March::Step* step, const March::Step* end, int x, int y, float* HWY_RESTRICT sums,
                           float* HWY_RESTRICT counts) {
  using V = hn::Vec<D>;
  using M = hn::Mask<D>;
  const std::ptrdiff_t lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  const V absent = hn::Set(d, March::kAbsent);
  V light[kVectors];
  V known[kVectors];
  M open[kVectors];
  for (int k = 0; k < kVectors; ++k) {
    light[k] = hn::Zero(d);
    known[k] = hn::Set(d, 1.0f);
    open[k] = hn::FirstN(d, static_cast<std::size_t>(lanes));
  }
  for (; step != end; ++step) {
    const March::Layer& layer = layers[static_cast<std::size_t>(step->layer)];
    const PixelRect rect = layer.light.mean.rect;
    const std::ptrdiff_t first =
        static_cast<std::ptrdiff_t>(y + step->offset_y - rect.y) * rect.width + (x + step->offset_x - rect.x);
    bool all_closed = true;
    for (int k = 0; k < kVectors; ++k) {
      const std::ptrdiff_t at = first + k * lanes;
      V vergence = hn::Set(d, step->exit_d);
      M met;
      M seen;
      if (layer.is_wall) {
        met = hn::And(open[k], hn::Gt(hn::LoadU(d, layer.light.mean.values.data() + at), absent));
        seen = met;
      } else {
        vergence = hn::LoadU(d, layer.vergence.values.data() + at);
        met = hn::And(open[k], hn::Ge(vergence, hn::Set(d, step->exit_d)));
        const M side = hn::And(met, hn::Gt(vergence, hn::Set(d, step->enter_d)));
        seen = hn::AndNot(side, met);
        known[k] = hn::IfThenElse(side, hn::Zero(d), known[k]);
      }
      if (!hn::AllFalse(d, seen)) {
        V shows = hn::LoadU(d, layer.light.mean.values.data() + at);
        if (!path.is_centre && !layer.light.parts[0].values.empty()) {
          const float from_x = path.x_px - static_cast<float>(step->offset_x);
          const float from_y = path.y_px - static_cast<float>(step->offset_y);
          const V dx = hn::Add(hn::Set(d, from_x), hn::Mul(hn::Set(d, path.x_per_d), vergence));
          const V dy = hn::Add(hn::Set(d, from_y), hn::Mul(hn::Set(d, path.y_per_d), vergence));
          shows = LightIn(d, layer.light, at, shows, dx, dy);
        }
        light[k] = hn::IfThenElse(seen, shows, light[k]);
      }
      open[k] = hn::AndNot(met, open[k]);
      all_closed = all_closed && hn::AllFalse(d, open[k]);
    }
    if (all_closed) break;
  }
  for (int k = 0; k < kVectors; ++k) {
    hn::StoreU(hn::Add(hn::LoadU(d, sums + k * lanes), light[k]), d, sums + k * lanes);
    hn::StoreU(hn::Add(hn::LoadU(d, counts + k * lanes), known[k]), d, counts + k * lanes);
  }
}

void FollowRow(const std::vector<March::Layer>& layers, const March::Path& path, const March::Step* step,
               const March::Step* end, int x, int y, int width, float* sums, float* counts) {
  const hn::ScalableTag<float> wide;
  const hn::CappedTag<float, 1> single;
  const int lanes = static_cast<int>(hn::Lanes(wide));
  int i = 0;
  for (; i + 2 * lanes <= width; i += 2 * lanes)
    FollowRays<decltype(wide), 2>(wide, layers, path, step, end, x + i, y, sums + i, counts + i);
  for (; i + lanes <= width; i += lanes)
    FollowRays<decltype(wide), 1>(wide, layers, path, step, end, x + i, y, sums + i, counts + i);
  for (; i < width; ++i)
    FollowRays<decltype(single), 1>(single, layers, path, step, end, x + i, y, sums + i, counts + i);
}

/// A programme for each ray, run over every row of a part of the picture. Steps whose cells all end nearer
/// than `nearest_d` (the nearest depth in reach) meet nothing and are passed over.
void FollowPart(const std::vector<March::Layer>& layers, const std::vector<March::Step>& steps,
                std::span<const March::Path> paths, std::span<const int> first_step, float nearest_d, PixelRect part,
                float* sums, float* counts) {
  for (std::size_t ray = 0; ray < paths.size(); ++ray) {
    const March::Step* step = steps.data() + first_step[ray];
    const March::Step* end = steps.data() + first_step[ray + 1];
    while (step != end && step->exit_d > nearest_d && !layers[static_cast<std::size_t>(step->layer)].is_wall) ++step;
    for (int row = 0; row < part.height; ++row) {
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(row) * part.width;
      FollowRow(layers, paths[ray], step, end, part.x, part.y + row, part.width, sums + at, counts + at);
    }
  }
}

}  // namespace lensd::sim::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lensd::sim {
namespace {

HWY_EXPORT(FollowPart);

March::Layer LayerOf(const Canvas& canvas, PixelRect rect) {
  March::Layer layer{canvas.is_wall(), CellLight(canvas, rect),
                     canvas.is_wall() ? Raster() : canvas.VergenceOver(rect)};
  if (canvas.CoversAll()) return layer;
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      if (canvas.Covers(x, y)) continue;
      if (layer.is_wall) {
        layer.light.mean.Row(y)[x - rect.x] = March::kAbsent;
      } else {
        layer.vergence.Row(y)[x - rect.x] = -std::numeric_limits<float>::infinity();
      }
    }
  }
  return layer;
}

float NearestIn(const std::vector<March::Layer>& layers, PixelRect rect) {
  float nearest = -std::numeric_limits<float>::infinity();
  for (const March::Layer& layer : layers) {
    if (layer.is_wall) continue;
    const PixelRect held = layer.vergence.rect;
    const int left = std::max(rect.x, held.x);
    const int right = std::min(rect.x + rect.width, held.x + held.width);
    for (int y = std::max(rect.y, held.y); y < std::min(rect.y + rect.height, held.y + held.height); ++y) {
      const float* row = layer.vergence.Row(y) - held.x;
      for (int x = left; x < right; ++x) nearest = std::max(nearest, row[x]);
    }
  }
  return nearest;
}

/// Sorts the steps from `first` on by vergence. Stretches of different surfaces may overlap: cut at every vergence
/// where any stretch begins or ends, they either coincide or do not.
void Interleave(std::vector<March::Step>& steps, std::size_t first_step) {
  const auto first = static_cast<std::ptrdiff_t>(first_step);
  const std::vector<March::Step> whole(steps.begin() + first, steps.end());
  std::vector<float> cuts;
  for (const March::Step& step : whole) {
    cuts.push_back(step.enter_d);
    cuts.push_back(step.exit_d);
  }
  std::sort(cuts.begin(), cuts.end(), std::greater<>());
  cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
  steps.resize(first_step);
  for (March::Step step : whole) {
    const float exit = step.exit_d;
    for (const float cut : cuts) {
      if (cut >= step.enter_d || cut <= exit) continue;
      step.exit_d = cut;
      steps.push_back(step);
      step.enter_d = cut;
    }
    step.exit_d = exit;
    steps.push_back(step);
  }
  std::stable_sort(steps.begin() + first, steps.end(), [](const March::Step& a, const March::Step& b) {
    return a.enter_d != b.enter_d ? a.enter_d > b.enter_d : a.exit_d > b.exit_d;
  });
}

}  // namespace

bool CanMarch(const std::vector<Canvas>& canvases) {
  return std::all_of(canvases.begin(), canvases.end(),
                     [](const Canvas& canvas) { return canvas.is_wall() || !canvas.is_plane(); });
}

March::March(const std::vector<Canvas>& canvases, BlurLine line, const ApertureShape& shape, const Pupil& pupil,
             PixelRect region)
    : canvases_(canvases), line_(line), shape_(shape), pupil_(pupil), reach_(RayReach(canvases, line, shape, pupil)) {
  for (const Canvas& canvas : canvases) layers_.push_back(LayerOf(canvas, Grown(region, reach_)));
}

const March::Bundle& March::BundleOf(int rays_per_pixel) {
  Bundle& bundle = bundles_[rays_per_pixel];
  if (!bundle.first_step.empty()) return bundle;
  bundle.first_step.push_back(0);
  const std::vector<PixelRay> rays = SpreadOverPixel(rays_per_pixel, shape_);
  for (const PixelRay& ray : rays) {
    if (pupil_.is_perfect()) {
      AddProgramme(ray, bundle);
    } else if (pupil_.Passes(ray.through, {})) {
      const AperturePoint off = pupil_.LandsOff(ray.through, {});
      AddProgramme({{ray.on_sensor.x - off.x, ray.on_sensor.y - off.y}, ray.through}, bundle);
    }
  }
  bundle.passing = static_cast<double>(bundle.paths.size()) / static_cast<double>(rays.size());
  AddProgramme({}, bundle);
  bundle.paths.back().is_centre = true;
  return bundle;
}

void March::AddProgramme(PixelRay ray, Bundle& bundle) const {
  const std::size_t first = bundle.steps.size();
  const auto [from, h] = ray;
  bundle.paths.push_back(
      {static_cast<float>(from.x - h.x * line_.at_infinity_px), static_cast<float>(from.y - h.y * line_.at_infinity_px),
       static_cast<float>(-h.x * line_.per_dioptre_px), static_cast<float>(-h.y * line_.per_dioptre_px), false});
  for (std::size_t i = 0; i < canvases_.size(); ++i) {
    const Canvas& canvas = canvases_[i];
    const double near = canvas.max_vergence();
    const double far = canvas.is_wall() ? near : canvas.min_vergence();
    const auto x_at = [&](double vergence) { return 0.5 + from.x - h.x * line_.At(vergence); };
    const auto y_at = [&](double vergence) { return 0.5 + from.y - h.y * line_.At(vergence); };
    CellWalk walk(x_at(near), y_at(near), x_at(far), y_at(far));
    double entered = near;
    for (;;) {
      const double leaves = walk.AtEnd() ? far : near + (far - near) * walk.Until();
      bundle.steps.push_back(
          {static_cast<int>(i), walk.x(), walk.y(), static_cast<float>(entered), static_cast<float>(leaves)});
      if (walk.AtEnd()) break;
      walk.Advance();
      entered = leaves;
    }
  }
  if (canvases_.size() > 1) Interleave(bundle.steps, first);
  bundle.first_step.push_back(static_cast<int>(bundle.steps.size()));
}

void March::Render(PixelRect part, int rays_per_pixel, Raster& image) {
  const Bundle& bundle = BundleOf(rays_per_pixel);
  const auto pixels = static_cast<std::size_t>(part.width) * static_cast<std::size_t>(part.height);
  const float nearest = NearestIn(layers_, Grown(part, reach_));
  // Single precision adds up a few hundred rays without a trace; the chunks are added in double.
  constexpr std::size_t kChunk = 256;
  std::vector<double> light(pixels);
  std::vector<double> counts(pixels);
  std::vector<float> chunk_light;
  std::vector<float> chunk_counts;
  const auto follow = [&](std::size_t first_ray, std::size_t rays) {
    chunk_light.assign(pixels, 0.0f);
    chunk_counts.assign(pixels, 0.0f);
    HWY_DYNAMIC_DISPATCH(FollowPart)
    (layers_, bundle.steps, {bundle.paths.data() + first_ray, rays}, {bundle.first_step.data() + first_ray, rays + 1},
     nearest, part, chunk_light.data(), chunk_counts.data());
  };
  const std::size_t rays = bundle.first_step.size() - 2;
  for (std::size_t first = 0; first < rays; first += kChunk) {
    follow(first, std::min(kChunk, rays - first));
    for (std::size_t i = 0; i < pixels; ++i) {
      light[i] += static_cast<double>(chunk_light[i]);
      counts[i] += static_cast<double>(chunk_counts[i]);
    }
  }
  if (std::find(counts.begin(), counts.end(), 0.0) != counts.end()) {
    // The ray through the lens centre, the last, never meets a side: it speaks where all others did.
    follow(rays, 1);
    for (std::size_t i = 0; i < pixels; ++i) {
      if (counts[i] == 0.0) std::tie(light[i], counts[i]) = std::pair(static_cast<double>(chunk_light[i]), 1.0);
    }
  }
  std::size_t i = 0;
  for (int y = part.y; y < part.y + part.height; ++y) {
    for (int x = part.x; x < part.x + part.width; ++x, ++i) {
      image.Row(y)[x - image.rect.x] = static_cast<float>(bundle.passing * (light[i] / counts[i]));
    }
  }
}

}  // namespace lensd::sim
#endif
