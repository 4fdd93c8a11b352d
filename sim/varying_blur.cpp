#include "varying_blur.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace lensd::sim {
namespace {

constexpr int kTileWidth = 32;
constexpr int kTileHeight = 16;

/// The ladder: rungs a thirty-second of a pixel apart where disks are small and one cell matters, wider where disks
/// hold many cells. Each part doubles the step of the part before it.
struct LadderPart {
  double from;
  double step;
  int first;  ///< rung number at `from`
};
constexpr LadderPart kLadder[] = {{1.0, 0.03125, 0}, {2.0, 0.0625, 32}, {4.0, 0.125, 64}, {8.0, 0.25, 96},
                                  {16.0, 0.5, 128},  {48.0, 1.0, 192},  {128.0, 2.0, 272}};

/// A diameter's place on the ladder: whole rungs at whole numbers, linear in between.
double RungOf(double diameter_px) {
  const LadderPart* part = kLadder;
  for (const LadderPart& next : kLadder) {
    if (diameter_px >= next.from) part = &next;
  }
  return part->first + (std::max(diameter_px, 1.0) - part->from) / part->step;
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
  const DiskFilter& Filter(int rung) {
    const auto found = filters_.find(rung);
    if (found != filters_.end()) return found->second;
    return filters_.emplace(rung, DiskFilter(DiameterOf(rung))).first->second;
  }

 private:
  std::map<int, DiskFilter> filters_;
};

void BlurTile(const SummedRaster& source, Ladder& ladder, const Raster& diameters, PixelRect tile, Raster& out) {
  Raster rungs(tile);
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    for (int x = 0; x < tile.width; ++x) {
      rungs.Row(y)[x] = static_cast<float>(RungOf(static_cast<double>(diameters.At(tile.x + x, y))));
    }
  }
  const auto [low, high] = std::minmax_element(rungs.values.begin(), rungs.values.end());
  const int first = static_cast<int>(*low);
  const int last = static_cast<int>(std::ceil(*high));
  Raster sum(tile);
  Raster blurred(tile);
  for (int rung = first; rung <= last; ++rung) {
    ladder.Filter(rung).Blur(source, blurred);
    for (std::size_t i = 0; i < sum.values.size(); ++i) {
      const float weight = std::max(0.0f, 1.0f - std::abs(rungs.values[i] - static_cast<float>(rung)));
      sum.values[i] += weight * blurred.values[i];
    }
  }
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    std::copy_n(sum.Row(y), tile.width, out.Row(y) + (tile.x - out.rect.x));
  }
}

}  // namespace

int ReachOf(double diameter_px) {
  return DiskKernel(DiameterOf(static_cast<int>(std::ceil(RungOf(diameter_px))))).reach;
}

void BlurVarying(const SummedRaster& source, const Raster& diameters, Raster& out) {
  const auto [low, high] = std::minmax_element(diameters.values.begin(), diameters.values.end());
  if (*low == *high) {
    DiskFilter(static_cast<double>(*low)).Blur(source.cells(), out);
    return;
  }
  Ladder ladder;
  const PixelRect all = out.rect;
  for (int y = 0; y < all.height; y += kTileHeight) {
    for (int x = 0; x < all.width; x += kTileWidth) {
      const PixelRect tile{all.x + x, all.y + y, std::min(kTileWidth, all.width - x),
                           std::min(kTileHeight, all.height - y)};
      BlurTile(source, ladder, diameters, tile, out);
    }
  }
}

}  // namespace lensd::sim
