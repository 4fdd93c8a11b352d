// Slopes and bends along x and y by filters over the samples, one after the other for what changes along both.
#include "sim/render/cell_light.h"

#include <vector>

#include "sim/render/band_filter.h"

namespace lensd::sim {
namespace {

using Filter = std::vector<double>;

struct Filters {
  Filter slope, bend;
};

/// Along one axis; the samples are pixel means, which a wave has lost amplitude in.
const Filters& FiltersOfMeans() {
  static const Filters filters{FilterWith([](double w) { return ParabolaOf(w).slope / PixelMeanOf(w); }),
                               FilterWith([](double w) { return ParabolaOf(w).bend / PixelMeanOf(w); })};
  return filters;
}

enum class FilterWay { Across, Down };

/// Filters `from` along its rows or columns into the cells of `rect`.
Raster Filtered(const Raster& from, const Filter& filter, PixelRect rect, FilterWay way) {
  Raster result(rect);
  const std::ptrdiff_t step = way == FilterWay::Down ? from.rect.width : 1;
  std::vector<double> sums(static_cast<std::size_t>(rect.width));
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    const float* row = from.Row(y) + (rect.x - from.rect.x);
    std::fill(sums.begin(), sums.end(), 0.0);
    for (int k = -kBandReach; k <= kBandReach; ++k) {
      const float* at = row + k * step;
      const double weight = filter[static_cast<std::size_t>(k + kBandReach)];
      for (std::size_t x = 0; x < sums.size(); ++x) sums[x] += weight * static_cast<double>(at[x]);
    }
    float* out = result.Row(y);
    for (std::size_t x = 0; x < sums.size(); ++x) out[x] = static_cast<float>(sums[x]);
  }
  return result;
}

}  // namespace

CellLight::CellLight(const Canvas& canvas, PixelRect rect) : mean(canvas.LightOver(rect)) {
  if (std::holds_alternative<ConstantPaint>(canvas.paint())) return;
  const Filters& filters = FiltersOfMeans();
  const Raster samples = canvas.LightOver(Grown(rect, kBandReach));
  const PixelRect higher{rect.x, rect.y - kBandReach, rect.width, rect.height + 2 * kBandReach};
  const Raster slopes = Filtered(samples, filters.slope, higher, FilterWay::Across);
  parts[kSlopeX] = Filtered(samples, filters.slope, rect, FilterWay::Across);
  parts[kSlopeY] = Filtered(samples, filters.slope, rect, FilterWay::Down);
  parts[kBendX] = Filtered(samples, filters.bend, rect, FilterWay::Across);
  parts[kBendY] = Filtered(samples, filters.bend, rect, FilterWay::Down);
  parts[kTwist] = Filtered(slopes, filters.slope, rect, FilterWay::Down);
}

double CellLight::At(int x, int y, double dx, double dy) const {
  const auto of = [&](Part part) { return static_cast<double>(parts[part].At(x, y)); };
  const double flat = static_cast<double>(mean.At(x, y));
  if (parts[kTwist].values.empty()) return flat;
  return flat + of(kSlopeX) * dx + of(kSlopeY) * dy + of(kBendX) * (dx * dx - 1.0 / 12.0) +
         of(kBendY) * (dy * dy - 1.0 / 12.0) + of(kTwist) * dx * dy;
}

}  // namespace lensd::sim
