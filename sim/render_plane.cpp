// One textured tilted plane. Its blur diameter d changes by g a pixel, so that the rays through the pixel at x and the
// aperture's points h (|h| <= 1/2) meet the plane at x + t with t = -h (d + g t): as h fills its disk, t fills the
// ellipse |t| <= |d + g t|/2, and evenly spread h leave light from t with the weight 1/(d + g t)^3. Both are summed as
// they are: line by line across the ellipse, on each line the light times the weight, a parabola there, from running
// sums of light, x light and x² light. What is left out is how the ellipse's edge runs between two lines, and the
// weight's third order.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "view.h"

namespace lensd::sim {
namespace {

constexpr double kEdgeError = 0.25 / 255.0;  // what the lines may miss of the edge
constexpr int kMostLines = 32;               // in a row of cells
constexpr double kSteepest = 0.5;            // px a pixel; above, the weight is no parabola

/// Twice the error of n lines a cell row on a disk of 1 px under light that changes by 1 a cell, over pi: where the
/// edge crosses the border of two cells it may be off by h dx/4 over the height h = 1/n of a line, dx being how far it
/// moves over h; summed along a circle that is r h² ln(2/h), out of an area of pi r².
double EdgeError(int lines) {
  const double h = 1.0 / lines;
  return 2.0 / std::numbers::pi * h * h * std::log(2.0 / h);
}

/// Lines a cell row for disks of that diameter.
int LinesFor(double diameter, double variation) {
  int lines = 2;
  while (lines < kMostLines && EdgeError(lines) * variation > kEdgeError * diameter) lines *= 2;
  return lines;
}

/// Running sums along each row of light times 1, x and x², x from the raster's left side.
class Moments {
 public:
  using Three = std::array<double, 3>;

  explicit Moments(const Raster& cells) : cells_(cells) {
    const auto width = static_cast<std::size_t>(cells.rect.width);
    sums_.resize((width + 1) * static_cast<std::size_t>(cells.rect.height));
    for (int y = 0; y < cells.rect.height; ++y) {
      Three* to = sums_.data() + static_cast<std::size_t>(y) * (width + 1);
      const float* from = cells.Row(cells.rect.y + y);
      Three sum{};
      for (std::size_t x = 0; x < width; ++x) {
        to[x] = sum;
        Add(sum, static_cast<double>(from[x]), static_cast<double>(x), static_cast<double>(x + 1));
      }
      to[width] = sum;
    }
  }

  /// The integrals from the left side to `x` along row y of the picture.
  Three Until(int y, double x) const {
    const double cell = std::clamp(std::floor(x), 0.0, static_cast<double>(cells_.rect.width - 1));
    const auto i = static_cast<std::size_t>(cell);
    const auto row = static_cast<std::size_t>(y - cells_.rect.y) * (static_cast<std::size_t>(cells_.rect.width) + 1);
    Three sum = sums_[row + i];
    Add(sum, static_cast<double>(cells_.Row(y)[i]), cell, x);
    return sum;
  }

 private:
  static void Add(Three& sum, double light, double from, double to) {
    sum[0] += light * (to - from);
    sum[1] += light * (to * to - from * from) / 2.0;
    sum[2] += light * (to * to * to - from * from * from) / 3.0;
  }

  const Raster& cells_;
  std::vector<Three> sums_;
};

/// The blur of one pixel: |d|, and g turned to fit.
struct Ellipse {
  double d, gx, gy;
};

struct Share {
  double light = 0.0, weight = 0.0;
};

/// Adds the light along one line at height t_y above the pixel's centre, of thickness h.
void AddLine(const Moments& moments, const Ellipse& e, double centre_x, int row, double t_y, double h, Share& share) {
  const double reach = e.d + e.gy * t_y, a = 1.0 - e.gx * e.gx / 4.0;
  const double root = std::sqrt(std::max(0.0, reach * reach - 4.0 * a * t_y * t_y));
  const double left = (e.gx * reach / 2.0 - root) / (2.0 * a), right = (e.gx * reach / 2.0 + root) / (2.0 * a);
  // (d + g t)^-3 about the line's middle, to second order; scaled to 1 at the pixel's centre.
  const double middle = (left + right) / 2.0, there = reach + e.gx * middle, slope = e.gx / there;
  const double scale = e.d / there, weight = h * scale * scale * scale;
  const std::array c{1.0 + 3.0 * slope * middle + 6.0 * slope * slope * middle * middle,
                     -3.0 * slope - 12.0 * slope * slope * middle, 6.0 * slope * slope};
  const Moments::Three from = moments.Until(row, centre_x + left), to = moments.Until(row, centre_x + right);
  const double s0 = to[0] - from[0], s1 = to[1] - from[1] - centre_x * s0;
  const double s2 = to[2] - from[2] - centre_x * (2.0 * (to[1] - from[1]) - centre_x * s0);
  share.light += weight * (c[0] * s0 + c[1] * s1 + c[2] * s2);
  const double half = (right - left) / 2.0;
  share.weight += weight * 2.0 * half * (1.0 + 2.0 * slope * slope * half * half);
}

double LightOf(const Moments& moments, const Ellipse& e, int x, int y, int left, int lines) {
  const double a = 2.0 * std::sqrt(1.0 - e.gx * e.gx / 4.0), middle = y + 0.5;
  const double top = middle - e.d / (a + e.gy), bottom = middle + e.d / (a - e.gy);
  Share share;
  for (int row = static_cast<int>(std::floor(top)); row < bottom; ++row) {
    const double from = std::max(top, static_cast<double>(row)), to = std::min(bottom, row + 1.0);
    const int count = std::max(1, static_cast<int>(std::ceil((to - from) * lines)));
    const double h = (to - from) / count;
    for (int i = 0; i < count; ++i) {
      AddLine(moments, e, x - left + 0.5, row, from + (i + 0.5) * h - middle, h, share);
    }
  }
  return share.light / share.weight;
}

struct Tilt {
  double gx, gy;
  double steepness() const { return std::hypot(gx, gy); }
};

Tilt TiltOf(const View& view) {
  const Canvas& canvas = view.canvases.front();
  return {view.line.per_dioptre_px * canvas.slope_x(), view.line.per_dioptre_px * canvas.slope_y()};
}

/// How far light from beyond a pixel may come: the longer half of the largest ellipse.
int ReachOf(const View& view) {
  return static_cast<int>(std::ceil(LargestBlur(view) / (2.0 - TiltOf(view).steepness()))) + 1;
}

}  // namespace

bool CanPlane(const View& view) {
  if (!view.shape.is_circle() || view.canvases.size() != 1 || !view.canvases.front().CoversAll()) return false;
  const Canvas& canvas = view.canvases.front();
  return canvas.is_plane() && !canvas.is_wall() && std::holds_alternative<TexturePaint>(canvas.paint()) &&
         TiltOf(view).steepness() <= kSteepest;
}

double PlaneBound(const View& view) {
  const Liveliness lively = LivelinessOf(view.canvases.front().LightOver(Grown(view.region, ReachOf(view))));
  const double edge = std::max(kEdgeError, EdgeError(kMostLines) * lively.variation);
  const double half = TiltOf(view).steepness() / 2.0;
  const double third_order = 10.0 * half * half * half / 4.0;  // a quarter: the mean of |t|³ over the disk, at most
  return edge + third_order * lively.range / 2.0;
}

Raster RenderPlane(const View& view) {
  const Canvas& canvas = view.canvases.front();
  const Raster light = canvas.LightOver(Grown(view.region, ReachOf(view)));
  const Moments moments(light);
  const double variation = LivelinessOf(light).variation;
  const Tilt tilt = TiltOf(view);
  Raster image(view.region);
  for (int y = view.region.y; y < view.region.y + view.region.height && !view.stop.stop_requested(); ++y) {
    for (int x = view.region.x; x < view.region.x + view.region.width; ++x) {
      const double d = view.line.At(canvas.PlaneVergence(x + 0.5, y + 0.5)), sign = d < 0.0 ? -1.0 : 1.0;
      const Ellipse ellipse{std::abs(d), sign * tilt.gx, sign * tilt.gy};
      float& out = image.Row(y)[x - view.region.x];
      if (ellipse.d <= 1.0 - tilt.steepness() / 2.0) {  // all of it in the pixel's own cell
        out = light.At(x, y);
        continue;
      }
      out = static_cast<float>(LightOf(moments, ellipse, x, y, light.rect.x, LinesFor(ellipse.d, variation)));
    }
  }
  return image;
}

}  // namespace lensd::sim
