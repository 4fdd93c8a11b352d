// Kernels keep to the disk's transform over the band and less in its corners; shares of area, where blur varies, lose
// to the pixel's own transform and to what lies beyond the band. Both are stated as a root mean square over all
// frequencies, which light with a flat spectrum, the hardest there is, is off by.
#include "sim/render/short_periods.h"

#include <algorithm>
#include <cmath>

#include "sim/render/disk_kernel.h"

namespace lensd::sim {
namespace {

/// Root mean square, over the square of all frequencies, of a kernel's transform less 2 J1(x)/x. Worked out apart from
/// the kernels' code: up to 8 px and a step of the table at most 0.0245 (at 2 px), from there to 60 px at most 0.17
/// times diameter^-1.5, of shares of area 0.26 to 0.29 times that.
double TransformError(double diameter, bool varies) {
  constexpr double kTableEnds = kLargestFitted + 0.125;
  if (diameter < kTableEnds) return 0.025 * std::min(diameter, 1.0);
  return (varies ? 0.3 : 0.18) * std::pow(diameter, -1.5);
}

/// The worst of the diameters between two.
double WorstTransformError(double smallest, double largest) {
  const bool varies = smallest < largest;
  return TransformError(smallest > kLargestFitted ? smallest : std::min(largest, kLargestFitted), varies);
}

/// Root mean square of what changes within a few pixels, of the part of the picture where it is largest.
double FineContrast(const Raster& light) {
  constexpr int kPart = 32, kReach = 2;
  constexpr double kCells = (2 * kReach + 1) * (2 * kReach + 1);
  const PixelRect all = light.rect;
  double most = 0.0;
  for (int top = all.y + kReach; top + kReach < all.y + all.height; top += kPart) {
    for (int left = all.x + kReach; left + kReach < all.x + all.width; left += kPart) {
      const int bottom = std::min(top + kPart, all.y + all.height - kReach);
      const int right = std::min(left + kPart, all.x + all.width - kReach);
      double squares = 0.0;
      for (int y = top; y < bottom; ++y) {
        for (int x = left; x < right; ++x) {
          double around = 0.0;
          for (int dy = -kReach; dy <= kReach; ++dy) {
            for (int dx = -kReach; dx <= kReach; ++dx) around += static_cast<double>(light.At(x + dx, y + dy));
          }
          const double fine = static_cast<double>(light.At(x, y)) - around / kCells;
          squares += fine * fine;
        }
      }
      most = std::max(most, squares / ((bottom - top) * (right - left)));
    }
  }
  return std::sqrt(most);
}

}  // namespace

double ShortPeriodError(const View& view) {
  constexpr double kOneInAThousand = 3.3;  // standard deviations, both sides
  double worst = 0.0;
  for (const Canvas& canvas : view.canvases) {
    const double a = view.line.At(canvas.min_vergence()), b = view.line.At(canvas.max_vergence());
    const double largest = std::max(std::abs(a), std::abs(b));
    const double smallest = a * b <= 0.0 ? 0.0 : std::min(std::abs(a), std::abs(b));
    const PixelRect seen = Grown(view.region, static_cast<int>(std::ceil(view.shape.reach() * largest)));
    worst = std::max(worst, WorstTransformError(smallest, largest) * FineContrast(canvas.LightOver(seen)));
  }
  return kOneInAThousand * worst;
}

}  // namespace lensd::sim
