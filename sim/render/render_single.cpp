// Renderers of a single surface over the whole picture.
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <optional>

#include "sim/render/disk_blur.h"
#include "sim/render/disk_kernel.h"
#include "sim/render/varying_blur.h"
#include "sim/render/view.h"

namespace lensd::sim {
namespace {

bool IsSingle(const View& view) {
  return view.canvases.size() == 1 && view.canvases.front().CoversAll();
}

bool HasTexture(const Canvas& canvas) {
  return std::holds_alternative<TexturePaint>(canvas.paint());
}

Raster BlurDiameters(const View& view) {
  Raster diameters = view.canvases.front().VergenceOver(view.region);
  for (float& value : diameters.values) value = static_cast<float>(std::abs(view.line.At(static_cast<double>(value))));
  return diameters;
}

}  // namespace

bool CanFourier(const View& view) {
  return IsSingle(view) && view.canvases.front().is_wall() && !HasTexture(view.canvases.front());
}

Raster RenderFourier(const View& view) {
  const Canvas& canvas = view.canvases.front();
  Raster image(view.region);
  const auto fill = [&](auto light_at) {
    for (int y = view.region.y; y < view.region.y + view.region.height; ++y) {
      for (int x = 0; x < view.region.width; ++x) {
        image.Row(y)[x] = static_cast<float>(light_at(view.region.x + x + 0.5, y + 0.5));
      }
    }
  };
  const auto* wave = std::get_if<SinusoidPaint>(&canvas.paint());
  if (wave == nullptr) {
    fill([&](double x, double y) { return canvas.LightAt(x, y); });
    return image;
  }
  // A product of two cosines is half the sum of two plane waves, one rising and one falling to the right.
  const auto per_pixel = [&](double period) {
    return period == 0.0 ? 0.0 : 2.0 * std::numbers::pi / (period * canvas.magnification());
  };
  const double d = view.line.At(canvas.PlaneVergence(0, 0));
  const double kx = d * per_pixel(wave->period_x_px), ky = d * per_pixel(wave->period_y_px);
  const std::complex<double> rising = view.shape.Transfer(kx, ky), falling = view.shape.Transfer(kx, -ky);
  if (view.shape.is_even()) {  // both are real and the same
    fill([&](double x, double y) { return 0.5 + rising.real() * (canvas.LightAt(x, y) - 0.5); });
    return image;
  }
  fill([&](double x, double y) {
    const auto [phase_x, phase_y] = canvas.PhaseAt(x, y);
    return 0.5 +
           0.25 * (rising * std::polar(1.0, phase_x + phase_y) + falling * std::polar(1.0, phase_x - phase_y)).real();
  });
  return image;
}

bool CanWall(const View& view) {
  return view.shape.is_even() && IsSingle(view) && view.canvases.front().is_wall() && HasTexture(view.canvases.front());
}

Raster RenderWall(const View& view) {
  const Canvas& canvas = view.canvases.front();
  const double diameter = std::abs(view.line.At(canvas.PlaneVergence(0, 0)));
  const DiskKernel kernel(diameter, view.shape);
  return BlurredBy(kernel, diameter, canvas.LightOver(Grown(view.region, kernel.reach)), view.region);
}

bool CanGather(const View& view) {
  return view.shape.is_even() && !view.canvases.empty();
}

double GatherBound(const View& view) {
  if (!IsSingle(view)) return 1.0;
  const Canvas& canvas = view.canvases.front();
  const double largest = LargestBlur(view);
  const PixelRect seen = Grown(view.region, static_cast<int>(std::ceil(view.shape.reach() * largest)));
  const Liveliness lively = LivelinessOf(canvas.LightOver(seen));
  // d changes by g a pixel. The true kernel is the disk with its points moved by d |h| |g . h| on a plane, 0.08 d g on
  // average over the aperture; cells that face the camera shift the disk's middle by d g / 4 instead. A move changes
  // the light by at most the neighbours' difference for each cell boundary it crosses (sqrt 2 of its length, at most).
  double steepest = std::abs(view.line.per_dioptre_px) * std::hypot(canvas.slope_x(), canvas.slope_y());
  double mean_move = 0.08;
  if (!canvas.is_plane()) {
    const Raster vergence = canvas.VergenceOver(seen);
    float step = 0.0f;
    for (int y = seen.y; y + 1 < seen.y + seen.height; ++y) {
      const float* row = vergence.Row(y);
      for (int x = 0; x + 1 < seen.width; ++x) {
        step = std::max({step, std::abs(row[x + 1] - row[x]), std::abs(row[x + seen.width] - row[x])});
      }
    }
    steepest = view.line.per_dioptre_px * static_cast<double>(step) * std::numbers::sqrt2;
    mean_move = 0.25;
  }
  const double corners = 2.0 * view.shape.reach();  // how much farther from the centre than a circle
  const double move = mean_move * corners * corners * largest * steepest * std::numbers::sqrt2;
  if (steepest > 0.5) return lively.range;
  return std::min(lively.range, (move + kLadderMove) * lively.variation);
}

Raster RenderGather(const View& view) {
  if (IsSingle(view)) {
    const Raster diameters = BlurDiameters(view);
    const float largest = *std::max_element(diameters.values.begin(), diameters.values.end());
    const int reach = ReachOf(static_cast<double>(largest), view.shape);
    const Raster light = view.canvases.front().LightOver(Grown(view.region, reach));
    Raster image(view.region);
    BlurVarying(SummedRaster(light), diameters, image, view.shape);
    return image;
  }
  Raster diameters = SharpViewOver(view.canvases, view.region).vergence;
  for (float& value : diameters.values) value = static_cast<float>(std::abs(view.line.At(static_cast<double>(value))));
  const float largest = *std::max_element(diameters.values.begin(), diameters.values.end());
  const Raster light =
      SharpViewOver(view.canvases, Grown(view.region, ReachOf(static_cast<double>(largest), view.shape))).light;
  Raster image(view.region);
  BlurVarying(SummedRaster(light), diameters, image, view.shape);
  return image;
}

bool CanSplat(const View& view) {
  return IsSingle(view);
}

namespace {

/// How a cell's light spreads over the pixels around it: by the shared kernels; under an odd polygon, which they do not
/// know, by shares of area.
class Footprint {
 public:
  /// `away` is the signed diameter.
  Footprint(double away, const ApertureShape& shape) : away_(away), shape_(shape) {
    if (shape.is_even()) kernel_.emplace(std::abs(away), shape);
  }
  int reach() const { return kernel_ ? kernel_->reach : static_cast<int>(std::ceil(Widest() * shape_.reach() + 0.5)); }
  double At(int x, int y) const {
    if (kernel_) return kernel_->At(x, y);
    const double diameter = std::copysign(Widest(), away_);
    return shape_.AreaIn(diameter, x - 0.5, y - 0.5, x + 0.5, y + 0.5) / (diameter * diameter);
  }

 private:
  double Widest() const { return std::max(std::abs(away_), 1.0); }

  double away_;
  const ApertureShape& shape_;
  std::optional<DiskKernel> kernel_;
};

}  // namespace

Raster RenderSplat(const View& view) {
  const Canvas& canvas = view.canvases.front();
  const int reach = ReachOf(LargestBlur(view), view.shape) + 2;
  const double slope_x = view.line.per_dioptre_px * canvas.slope_x();
  const double slope_y = view.line.per_dioptre_px * canvas.slope_y();
  const PixelRect all = view.region;
  std::vector<double> sums(static_cast<std::size_t>(all.width) * static_cast<std::size_t>(all.height));
  std::vector<double> shares(sums.size());
  const PixelRect from = Grown(all, reach);
  for (int y = from.y; y < from.y + from.height; ++y) {
    for (int x = from.x; x < from.x + from.width; ++x) {
      const double away = view.line.At(static_cast<double>(canvas.CellVergence(x, y)));
      const double light = static_cast<double>(canvas.CellLight(x, y));
      const Footprint footprint(away, view.shape);
      const int span = footprint.reach();
      for (int py = std::max(all.y, y - span); py <= std::min(all.y + all.height - 1, y + span); ++py) {
        for (int px = std::max(all.x, x - span); px <= std::min(all.x + all.width - 1, x + span); ++px) {
          double share = footprint.At(px - x, py - y);
          if (share == 0.0) continue;
          if (std::abs(away) > 1.0) share *= 1.0 + ((px - x) * slope_x + (py - y) * slope_y) / away;
          const auto i = static_cast<std::size_t>(py - all.y) * static_cast<std::size_t>(all.width) +
                         static_cast<std::size_t>(px - all.x);
          sums[i] += share * light;
          shares[i] += share;
        }
      }
    }
  }
  Raster image(all);
  for (std::size_t i = 0; i < sums.size(); ++i) image.values[i] = static_cast<float>(sums[i] / shares[i]);
  return image;
}

}  // namespace lensd::sim
