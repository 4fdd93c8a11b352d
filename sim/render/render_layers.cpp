// Renderers of several surfaces: layers, rays in step, and both together.
#include <algorithm>
#include <cmath>

#include "sim/render/disk_blur.h"
#include "sim/render/march.h"
#include "sim/render/ray_tracer.h"
#include "sim/render/view.h"

namespace lensd::sim {
namespace {

constexpr double kSharp = 0.02;  // px of blur that neither light nor outlines show

/// A wall's light and its cover, both blurred by its disk; light is premultiplied by cover.
struct BlurredLayer {
  Raster light;
  Raster cover;
  double diameter;
  bool one_colour;
};

/// A region's outline is sharp and runs between cells: what it cuts off is blurred as cells. A picture is band-limited;
/// what that makes of the light beyond what cells do is taken as spread evenly over the disk's visible part.
BlurredLayer BlurLayer(const View& view, const Canvas& canvas) {
  const double diameter = std::abs(view.line.At(canvas.PlaneVergence(0, 0)));
  BlurredLayer layer{{}, {}, diameter, canvas.CoversAll() && std::holds_alternative<ConstantPaint>(canvas.paint())};
  const DiskKernel of_picture(diameter, view.shape);
  if (canvas.CoversAll()) {
    const Raster light = canvas.LightOver(Grown(view.region, of_picture.reach));
    layer.light = BlurredBy(of_picture, diameter, light, view.region);
    layer.cover = Raster(view.region);
    std::fill(layer.cover.values.begin(), layer.cover.values.end(), 1.0f);
    return layer;
  }
  const DiskKernel of_cells = DiskKernel::OfCells(diameter, view.shape), of_finer = of_picture - of_cells;
  Raster light = canvas.LightOver(Grown(view.region, of_finer.reach));
  const Raster finer = BlurredBy(of_finer, diameter, light, view.region);
  Raster cover(light.rect);
  for (int y = light.rect.y; y < light.rect.y + light.rect.height; ++y) {
    for (int i = 0; i < light.rect.width; ++i) {
      const bool covered = canvas.Covers(light.rect.x + i, y);
      cover.Row(y)[i] = covered ? 1.0f : 0.0f;
      if (!covered) light.Row(y)[i] = 0.0f;
    }
  }
  layer.light = BlurredBy(of_cells, diameter, light, view.region);
  layer.cover = BlurredBy(of_cells, diameter, cover, view.region);
  for (std::size_t i = 0; i < finer.values.size(); ++i) {
    layer.light.values[i] += layer.cover.values[i] * finer.values[i];
  }
  return layer;
}

/// Nearest first.
std::vector<const Canvas*> ByVergence(const std::vector<Canvas>& canvases) {
  std::vector<const Canvas*> sorted;
  for (const Canvas& canvas : canvases) sorted.push_back(&canvas);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Canvas* a, const Canvas* b) { return a->max_vergence() > b->max_vergence(); });
  return sorted;
}

}  // namespace

bool CanLayers(const View& view) {
  return view.shape.is_even() &&
         std::all_of(view.canvases.begin(), view.canvases.end(), [](const Canvas& canvas) { return canvas.is_wall(); });
}

double LayersBound(const View& view) {
  int blurred = 0;
  bool plain_behind = true;
  for (const Canvas* canvas : ByVergence(view.canvases)) {
    if (std::abs(view.line.At(canvas->max_vergence())) <= kSharp) continue;
    if (++blurred > 1 && !std::holds_alternative<ConstantPaint>(canvas->paint())) plain_behind = false;
  }
  if (blurred <= 1 || (view.canvases.size() == 2 && plain_behind)) return 4e-6;
  return 0.25 *
         LivelinessOf(SharpViewOver(view.canvases, Grown(view.region, static_cast<int>(LargestBlur(view)))).light)
             .range;
}

Raster RenderLayers(const View& view, Raster* doubtful) {
  constexpr float kSure = 1e-4f;
  Raster image(view.region);
  std::vector<float> open(image.values.size(), 1.0f);  // part of the aperture not yet covered
  std::vector<int> outlined(image.values.size());      // blurred outlines of nearer layers across this pixel
  if (doubtful != nullptr) *doubtful = Raster(view.region);
  for (const Canvas* canvas : ByVergence(view.canvases)) {
    const BlurredLayer layer = BlurLayer(view, *canvas);
    for (std::size_t i = 0; i < open.size(); ++i) {
      const float cover = layer.cover.values[i];
      image.values[i] += open[i] * layer.light.values[i];
      const bool related = (outlined[i] > 0 && layer.diameter > kSharp && !layer.one_colour) || outlined[i] > 1;
      const bool unsure = related && open[i] > kSure && cover > kSure;
      if (unsure && doubtful != nullptr) doubtful->values[i] = 1.0f;
      open[i] *= 1.0f - cover;
      if (layer.diameter > kSharp && cover > kSure && cover < 1.0f - kSure) ++outlined[i];
    }
  }
  return image;
}

bool CanMarch(const View& view) {
  return CanMarch(view.canvases) && std::none_of(view.canvases.begin(), view.canvases.end(), [](const Canvas& canvas) {
           return std::holds_alternative<SinusoidPaint>(canvas.paint());
         });
}

namespace {

/// Visits the view in tiles.
template <class Visit>
void ForTiles(const View& view, int width, int height, Visit visit) {
  const PixelRect all = view.region;
  for (int y = all.y; y < all.y + all.height; y += height) {
    for (int x = all.x; x < all.x + all.width; x += width) {
      if (view.stop.stop_requested()) return;
      visit(PixelRect{x, y, std::min(width, all.x + all.width - x), std::min(height, all.y + all.height - y)});
    }
  }
}

}  // namespace

Raster RenderMarch(const View& view, const RayBudget& budget) {
  Raster image(view.region);
  March march(view.canvases, view.line, view.shape, view.pupil, view.region);
  ForTiles(view, 32, 16, [&](PixelRect tile) { march.Render(tile, budget.RaysFor(tile), image); });
  return image;
}

Raster RenderHybrid(const View& view, const RayBudget& budget) {
  Raster doubtful;
  Raster image = RenderLayers(view, &doubtful);
  March march(view.canvases, view.line, view.shape, view.pupil, view.region);
  ForTiles(view, 16, 8, [&](PixelRect tile) {
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      const float* row = doubtful.Row(y) + (tile.x - view.region.x);
      if (std::none_of(row, row + tile.width, [](float value) { return value > 0.0f; })) continue;
      march.Render(tile, budget.RaysFor(tile), image);
      return;
    }
  });
  return image;
}

Raster RenderRays(const View& view, const RayBudget& budget) {
  Raster image(view.region);
  const PixelRect met = Grown(view.region, RayReach(view.canvases, view.line, view.shape, view.pupil));
  std::vector<CellLight> light;
  for (const Canvas& canvas : view.canvases) light.emplace_back(canvas, met);
  ForTiles(view, 64, 64, [&](PixelRect tile) {
    const RayTracer tracer(view.canvases, light, view.line, view.shape, view.pupil, budget.RaysFor(tile));
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width && !view.stop.stop_requested(); ++x) {
        image.Row(y)[x - view.region.x] = static_cast<float>(tracer.LightAt(x, y));
      }
    }
  });
  return image;
}

}  // namespace lensd::sim
