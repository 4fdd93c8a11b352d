// The picture is blurred by each rung of a ladder of diameters where a pixel needs it, and pixels between two rungs mix
// both. Works tile by tile, so that few rungs are alive at a time.
#include "sim/render/varying_blur.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "sim/render/disk_blur.h"

namespace lensd::sim {
namespace {

constexpr int kTileWidth = 32;
constexpr int kGrain = 16;  // columns are blurred by that many at once
constexpr int kTileHeight = 16;

/// The ladder: rungs an eighth of a pixel apart where kernels are interpolated between eighths anyway, wider where
/// disks hold many cells. Each part doubles the step of the part before it.
struct LadderPart {
  double from;
  double step;
  int first;  ///< rung number at `from`
};
constexpr LadderPart kLadder[] = {
    {0.0, 0.125, 0}, {8.125, 0.25, 65}, {16.125, 0.5, 97}, {48.125, 1.0, 161}, {128.125, 2.0, 241}};

/// A diameter's place on the ladder: whole rungs at whole numbers, linear in between. The steps grow, so that the
/// lowest of the parts' lines is the ladder everywhere.
template <class T>
T RungOf(T diameter_px) {
  T rung = std::numeric_limits<T>::max();
  for (const LadderPart& part : kLadder) {
    rung = std::min(rung, T(part.first) + (diameter_px - T(part.from)) * T(1.0 / part.step));
  }
  return rung;
}

double DiameterOf(int rung) {
  const LadderPart* part = kLadder;
  for (const LadderPart& next : kLadder) {
    if (rung >= next.first) part = &next;
  }
  return part->from + (rung - part->first) * part->step;
}

class Ladder {
 public:
  explicit Ladder(const ApertureShape& shape) : shape_(shape) {}
  const DiskFilter& Filter(int rung) {
    const auto found = filters_.find(rung);
    if (found != filters_.end()) return found->second;
    const double diameter = DiameterOf(rung);
    const DiskFilter filter(DiskKernel::Sparse(diameter, shape_), DiskFilter::MethodFor(diameter));
    return filters_.emplace(rung, filter).first->second;
  }

 private:
  const ApertureShape& shape_;
  std::map<int, DiskFilter> filters_;
};

/// The columns of a tile in which each rung from `first` on has a share, as [from, to) relative to the tile.
struct Spans {
  int first = 0;
  std::vector<std::pair<int, int>> columns;
};

Raster RungsOf(const Raster& diameters, PixelRect tile) {
  Raster rungs(tile);
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    const float* from = diameters.Row(y) + (tile.x - diameters.rect.x);
    float* to = rungs.Row(y);
    for (int x = 0; x < tile.width; ++x) to[x] = RungOf(from[x]);
  }
  return rungs;
}

Spans SpansOf(const Raster& rungs) {
  const PixelRect tile = rungs.rect;
  const float* top = rungs.Row(tile.y);
  std::vector<float> low(top, top + tile.width), high = low;
  for (int y = tile.y + 1; y < tile.y + tile.height; ++y) {
    const float* row = rungs.Row(y);
    for (std::size_t x = 0; x < low.size(); ++x) {
      low[x] = std::min(low[x], row[x]);
      high[x] = std::max(high[x], row[x]);
    }
  }
  Spans spans;
  spans.first = static_cast<int>(*std::min_element(low.begin(), low.end()));
  const int last = static_cast<int>(std::ceil(*std::max_element(high.begin(), high.end())));
  spans.columns.assign(static_cast<std::size_t>(last - spans.first + 1), {tile.width, 0});
  for (int x = 0; x < tile.width; ++x) {
    const auto i = static_cast<std::size_t>(x);
    for (int rung = static_cast<int>(low[i]); rung <= static_cast<int>(std::ceil(high[i])); ++rung) {
      auto& [from, to] = spans.columns[static_cast<std::size_t>(rung - spans.first)];
      from = std::min(from, x);
      to = x + 1;
    }
  }
  for (auto& [from, to] : spans.columns) {
    if (from >= to) continue;
    from = from / kGrain * kGrain;
    to = std::min(tile.width, (to + kGrain - 1) / kGrain * kGrain);
  }
  return spans;
}

void BlurTile(const SummedRaster& source, Ladder& ladder, const Raster& rungs, Raster& out) {
  const PixelRect tile = rungs.rect;
  const Spans spans = SpansOf(rungs);
  for (int y = tile.y; y < tile.y + tile.height; ++y) std::fill_n(out.Row(y) + (tile.x - out.rect.x), tile.width, 0.0f);
  for (std::size_t i = 0; i < spans.columns.size(); ++i) {
    const auto [from, to] = spans.columns[i];
    if (from >= to) continue;
    const int rung = spans.first + static_cast<int>(i);
    Raster blurred({tile.x + from, tile.y, to - from, tile.height});
    ladder.Filter(rung).Blur(source, blurred);
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      const float* rung_row = rungs.Row(y) + from;
      const float* blurred_row = blurred.Row(y);
      float* to_row = out.Row(y) + (tile.x - out.rect.x) + from;
      for (int x = 0; x < to - from; ++x) {
        const float weight = std::max(0.0f, 1.0f - std::abs(rung_row[x] - static_cast<float>(rung)));
        to_row[x] += weight * blurred_row[x];
      }
    }
  }
}

}  // namespace

int ReachOf(double diameter_px, const ApertureShape& shape) {
  return DiskKernel::LargestReach(DiameterOf(static_cast<int>(std::ceil(RungOf(diameter_px)))), shape);
}

void BlurVarying(const SummedRaster& source, const Raster& diameters, Raster& out, const ApertureShape& shape) {
  const auto [low, high] = std::minmax_element(diameters.values.begin(), diameters.values.end());
  if (*low == *high) {
    const auto diameter = static_cast<double>(*low);
    out = BlurredBy(DiskKernel(diameter, shape), diameter, source.cells(), out.rect);
    return;
  }
  Ladder ladder(shape);
  const PixelRect all = out.rect;
  for (int y = 0; y < all.height; y += kTileHeight) {
    for (int x = 0; x < all.width; x += kTileWidth) {
      const PixelRect tile{all.x + x, all.y + y, std::min(kTileWidth, all.width - x),
                           std::min(kTileHeight, all.height - y)};
      BlurTile(source, ladder, RungsOf(diameters, tile), out);
    }
  }
}

}  // namespace lensd::sim
