// What the scene shows from the lens centre, how lively that is, and how many rays a part of it needs; the factors were
// measured and are held by tests/sim.
#include "sim/render/view.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lensd::sim {

SharpView SharpViewOver(const std::vector<Canvas>& canvases, PixelRect rect) {
  SharpView picture{Raster(rect), Raster(rect)};
  std::vector<char> taken(picture.light.values.size());
  for (const Canvas& canvas : canvases) {
    const Raster light = canvas.LightOver(rect);
    const Raster vergence = canvas.VergenceOver(rect);
    std::size_t i = 0;
    for (int y = rect.y; y < rect.y + rect.height; ++y) {
      for (int x = rect.x; x < rect.x + rect.width; ++x, ++i) {
        if (!canvas.Covers(x, y) || (taken[i] != 0 && vergence.values[i] <= picture.vergence.values[i])) continue;
        picture.light.values[i] = light.values[i];
        picture.vergence.values[i] = vergence.values[i];
        taken[i] = 1;
      }
    }
  }
  return picture;
}

double LargestBlur(const View& view) {
  double largest = 0.0;
  const PixelRect r = view.region;
  for (const Canvas& canvas : view.canvases) {
    std::vector<double> vergences{canvas.min_vergence(), canvas.max_vergence()};
    if (canvas.is_plane()) {
      vergences.clear();
      for (const int x : {r.x, r.x + r.width}) {
        for (const int y : {r.y, r.y + r.height}) vergences.push_back(canvas.PlaneVergence(x, y));
      }
    }
    for (const double vergence : vergences) {
      largest = std::max(largest, std::abs(view.line.At(vergence)) + 2.0 * view.pupil.Reach(vergence));
    }
  }
  return largest;
}

Liveliness LivelinessOf(const Raster& light) {
  constexpr int kBlock = 16;
  Liveliness result;
  const auto [low, high] = std::minmax_element(light.values.begin(), light.values.end());
  result.range = static_cast<double>(*high) - static_cast<double>(*low);
  const PixelRect all = light.rect;
  for (int top = all.y; top < all.y + all.height; top += kBlock) {
    for (int left = all.x; left < all.x + all.width; left += kBlock) {
      const int bottom = std::min(top + kBlock, all.y + all.height - 1);
      const int right = std::min(left + kBlock, all.x + all.width - 1);
      double along_x = 0.0;
      double along_y = 0.0;
      for (int y = top; y < bottom; ++y) {
        const float* row = light.Row(y) - all.x;
        for (int x = left; x < right; ++x) {
          along_x += static_cast<double>(std::abs(row[x + 1] - row[x]));
          along_y += static_cast<double>(std::abs(row[x + all.width] - row[x]));
        }
      }
      const double cells = static_cast<double>(kBlock * kBlock);
      result.variation = std::max({result.variation, along_x / cells, along_y / cells});
    }
  }
  return result;
}

RayBudget::RayBudget(const View& view, double tolerance, int most, bool exactly)
    : region_(view.region),
      margin_(static_cast<int>(std::ceil(view.shape.reach() * LargestBlur(view)))),
      tolerance_(tolerance),
      most_(most),
      exactly_(exactly) {
  SharpView sharp = SharpViewOver(view.canvases, Grown(region_, margin_ + 1));
  light_ = std::move(sharp.light);
  diameters_ = std::move(sharp.vergence);
  for (float& value : diameters_.values) value = static_cast<float>(std::abs(view.line.At(static_cast<double>(value))));
}

RayBudget::Need RayBudget::NeedOf(PixelRect part) const {
  const PixelRect seen = Grown(part, margin_);
  float largest = 0.0f, smallest = std::numeric_limits<float>::infinity();
  double squares = 0.0;
  for (int y = seen.y; y < seen.y + seen.height; ++y) {
    const float* light = light_.Row(y) + (seen.x - light_.rect.x);
    const float* diameter = diameters_.Row(y) + (seen.x - light_.rect.x);
    for (int x = 0; x < seen.width; ++x) {
      largest = std::max(largest, diameter[x]);
      smallest = std::min(smallest, diameter[x]);
      const auto across = static_cast<double>(light[x + 1] - light[x]);
      const auto down = static_cast<double>(light[x + light_.rect.width] - light[x]);
      squares += across * across + down * down;
    }
  }
  // Light that varies from cell to cell with standard deviation s makes neighbours differ by sqrt(2) s.
  const double spread = std::sqrt(squares / (4.0 * static_cast<double>(seen.width) * seen.height));
  // Where one thing hides another it is chance, too, which of them a ray meets. The factor is measured on a photograph
  // with depth, at the pixels within a blur radius of its edges.
  const double chances = largest - smallest > 1.0f ? 3.4 * 1.7 : 3.4;
  return {chances * spread, std::max(1.0, 0.785 * static_cast<double>(largest) * static_cast<double>(largest))};
}

double RayBudget::ErrorOf(Need need, int rays) {
  // Where rays are fewer than the disk's cells they hit or miss cells nearly at random. Where there are more, each cell
  // gets its share but for what the lattice leaves uneven along the cell's edges. The factor and the power are measured
  // on white noise with 6 to 52 rays a cell (tests/sim/render_test.cpp holds the bound against rays without end).
  const double few = 1.0 / std::sqrt(static_cast<double>(rays));
  const double rays_a_cell = rays / need.cells;
  const double many = 0.9 / (std::sqrt(need.cells) * rays_a_cell) * std::pow(std::max(1.0, rays_a_cell), 0.35);
  return need.one_ray * std::min(few, many);
}

int RayBudget::RaysFor(PixelRect part) const {
  constexpr int kFewest = 34;
  if (exactly_) return most_;
  const Need need = NeedOf(part);
  int rays = std::min(kFewest, most_);
  while (rays < most_ && ErrorOf(need, rays) > tolerance_) rays = std::min(most_, rays * 5 / 4);
  return rays;
}

double RayBudget::Bound() const {
  if (!exactly_) {
    const double error = ErrorOf(NeedOf(region_), most_);
    return std::max(error, tolerance_);
  }
  return ErrorOf(NeedOf(region_), most_);
}

}  // namespace lensd::sim
