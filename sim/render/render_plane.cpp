// One textured tilted plane. Its blur diameter d changes by g a pixel, so that the rays through the pixel at x and the
// aperture's points h (|h| <= 1/2) meet the plane at x + t with t = -h (d + g t): as h fills its disk, t fills the
// ellipse |t| <= |d + g t|/2, and evenly spread h leave light from t with the weight 1/(d + g t)^3. Both are summed as
// they are: line by line across the ellipse, on each line the light times the weight, a parabola there, from running
// sums of light, x light and x² light. The light is the picture of pixel means as it runs on between the pixels: a
// parabola in each cell along a line, and lines an eighth of a pixel apart. What is left out is how the ellipse's edge
// runs between two lines, and the weight's third order.
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "render/band_filter.h"
#include "render/view.h"

namespace lensd::sim {
namespace {

constexpr double kEdgeError = 0.25 / 255.0;  // what the lines may miss of the edge
constexpr int kMostLines = 32;               // in a row of cells
constexpr double kSteepest = 0.5;            // px a pixel; above, the weight is no parabola

/// Lines a cell row for disks of that diameter: n lines fold the disk's transform near n cycles a pixel back into the
/// picture, where it has fallen to 2 sqrt(2/pi) x^-1.5, x = pi d n. Lines of unequal height and between two levels ask
/// for four times as many (measured on gratings).
int LinesFor(double diameter, double range) {
  const double x = 4.0 * std::pow(1.6 * 0.5 * range / kEdgeError, 2.0 / 3.0);
  int lines = 2;
  while (lines < kMostLines && std::numbers::pi * diameter * lines < x) lines *= 2;
  return lines;
}

constexpr int kLevels = 8;           // lines of light a cell row
constexpr double kSharpPlane = 0.1;  // px of blur that nothing shows

using Three = std::array<double, 3>;

/// The filters that give the light along a line at each level of a cell row from the rows around it, and from the
/// line's samples the parabola in each cell.
struct LineFilters {
  std::array<std::vector<double>, kLevels> level;
  std::array<std::vector<double>, 3> part;  ///< mean, slope, bend
};
const LineFilters& FiltersOfLines() {
  static const LineFilters filters = [] {
    LineFilters made;
    for (int i = 0; i < kLevels; ++i) {
      const double above_middle = static_cast<double>(i) / kLevels - 0.5;
      made.level[static_cast<std::size_t>(i)] =
          FilterWith([above_middle](double w) { return std::polar(1.0, w * above_middle); });
    }
    made.part = {FilterWith([](double w) { return ParabolaOf(w).mean; }),
                 FilterWith([](double w) { return ParabolaOf(w).slope; }),
                 FilterWith([](double w) { return ParabolaOf(w).bend; })};
    return made;
  }();
  return filters;
}

/// Integrals along a line from the middle of a cell to `to` of light times 1, t and t², t from the middle.
Three WithinCell(const Three& parabola, double to) {
  const double flat = parabola[0] - parabola[2] / 12.0, t2 = to * to;
  return {to * (flat + to * (parabola[1] / 2.0 + to * parabola[2] / 3.0)),
          t2 * (flat / 2.0 + to * (parabola[1] / 3.0 + to * parabola[2] / 4.0)),
          t2 * to * (flat / 3.0 + to * (parabola[1] / 4.0 + to * parabola[2] / 5.0))};
}

/// Running sums along lines, kLevels a row, of light times 1, x and x², x from the raster's left side.
class Moments {
 public:
  /// For lines in `rows` rows from `first` on; `cells` reach kBandReach rows beyond, and as many columns beyond `left`
  /// and `left` + `width`.
  Moments(const Raster& cells, int left, int width, int first, int rows)
      : first_(first), width_(static_cast<std::size_t>(width)) {
    const std::size_t lines = static_cast<std::size_t>(rows) * kLevels;
    sums_.resize((width_ + 1) * lines);
    parabolas_.resize(width_ * lines);
    std::vector<double> line(width_ + 2 * kBandReach);
    for (std::size_t i = 0; i < lines; ++i) {
      const std::vector<double>& level = FiltersOfLines().level[i % kLevels];
      std::fill(line.begin(), line.end(), 0.0);
      for (int k = -kBandReach; k <= kBandReach; ++k) {
        const float* row = cells.Row(first + static_cast<int>(i / kLevels) + k) + (left - kBandReach - cells.rect.x);
        const double weight = level[static_cast<std::size_t>(k + kBandReach)];
        for (std::size_t x = 0; x < line.size(); ++x) line[x] += weight * static_cast<double>(row[x]);
      }
      Sum(line, i);
    }
  }

  /// The integrals from the left side to `x` along the line nearest to height y of the picture.
  Three Until(double y, double x) const {
    const auto line = static_cast<std::size_t>(std::lround((y - first_) * kLevels));
    const double cell = std::clamp(std::floor(x), 0.0, static_cast<double>(width_ - 1));
    const auto i = static_cast<std::size_t>(cell);
    const Three past = WithinCell(parabolas_[line * width_ + i], x - cell - 0.5);
    Three sum = sums_[line * (width_ + 1) + i];
    Shift(sum, past, cell + 0.5);
    return sum;
  }

 private:
  /// Adds integrals about `middle` to integrals about 0. Sums are kept up to the middle of each cell.
  static void Shift(Three& sum, const Three& about, double middle) {
    sum[0] += about[0];
    sum[1] += about[1] + middle * about[0];
    sum[2] += about[2] + middle * (2.0 * about[1] + middle * about[0]);
  }
  void Sum(const std::vector<double>& line, std::size_t number) {
    const LineFilters& filters = FiltersOfLines();
    Three sum{};
    for (std::size_t x = 0; x < width_; ++x) {
      Three& parabola = parabolas_[number * width_ + x];
      for (std::size_t part = 0; part < 3; ++part) {
        double value = 0.0;
        for (std::size_t k = 0; k <= 2 * kBandReach; ++k) value += filters.part[part][k] * line[x + k];
        parabola[part] = value;
      }
      const Three before = WithinCell(parabola, -0.5), after = WithinCell(parabola, 0.5);
      const double middle = static_cast<double>(x) + 0.5;
      Shift(sum, {-before[0], -before[1], -before[2]}, middle);
      sums_[number * (width_ + 1) + x] = sum;
      Shift(sum, after, middle);
    }
  }

  int first_;
  std::size_t width_;
  std::vector<Three> sums_;       ///< to the middle of each cell
  std::vector<Three> parabolas_;  ///< mean, slope and bend of each cell
};

/// The blur of one pixel: |d|, and g turned to fit.
struct Ellipse {
  double d, gx, gy;
};

struct Share {
  double light = 0.0, weight = 0.0;
};

/// Adds the light along one line at height t_y above the pixel's centre, of thickness h.
void AddLine(const Moments& moments, const Ellipse& e, double centre_x, double y, double t_y, double h, Share& share) {
  const double reach = e.d + e.gy * t_y, a = 1.0 - e.gx * e.gx / 4.0;
  const double root = std::sqrt(std::max(0.0, reach * reach - 4.0 * a * t_y * t_y));
  const double left = (e.gx * reach / 2.0 - root) / (2.0 * a), right = (e.gx * reach / 2.0 + root) / (2.0 * a);
  // (d + g t)^-3 about the line's middle, to second order; scaled to 1 at the pixel's centre.
  const double middle = (left + right) / 2.0, there = reach + e.gx * middle, slope = e.gx / there;
  const double scale = e.d / there, weight = h * scale * scale * scale;
  const std::array c{1.0 + 3.0 * slope * middle + 6.0 * slope * slope * middle * middle,
                     -3.0 * slope - 12.0 * slope * slope * middle, 6.0 * slope * slope};
  const Three from = moments.Until(y, centre_x + left), to = moments.Until(y, centre_x + right);
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
      // A line halfway between two levels takes the upper and the lower one in turn.
      const double at = from + (i + 0.5) * h + (i % 2 == 0 ? 1e-9 : -1e-9);
      AddLine(moments, e, x - left + 0.5, at, at - middle, h, share);
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
  const double half = TiltOf(view).steepness() / 2.0;
  const double third_order = 10.0 * half * half * half / 4.0;  // a quarter: the mean of |t|³ over the disk, at most
  return kEdgeError + third_order * lively.range / 2.0;
}

Raster RenderPlane(const View& view) {
  constexpr int kBand = 32;  // rows at a time, for the sums' memory
  const Canvas& canvas = view.canvases.front();
  const int reach = ReachOf(view);
  const Raster light = canvas.LightOver(Grown(view.region, reach + kBandReach + 1));
  const double range = LivelinessOf(light).range;
  const Tilt tilt = TiltOf(view);
  const PixelRect all = view.region;
  Raster image(all);
  for (int top = all.y; top < all.y + all.height && !view.stop.stop_requested(); top += kBand) {
    const int rows = std::min(kBand, all.y + all.height - top);
    const int left = all.x - reach;
    const Moments moments(light, left, all.width + 2 * reach, top - reach, rows + 2 * reach + 1);
    for (int y = top; y < top + rows; ++y) {
      for (int x = all.x; x < all.x + all.width; ++x) {
        const double d = view.line.At(canvas.PlaneVergence(x + 0.5, y + 0.5)), sign = d < 0.0 ? -1.0 : 1.0;
        const Ellipse ellipse{std::abs(d), sign * tilt.gx, sign * tilt.gy};
        image.Row(y)[x - all.x] =
            ellipse.d < kSharpPlane
                ? light.At(x, y)
                : static_cast<float>(LightOf(moments, ellipse, x, y, left, LinesFor(ellipse.d, range)));
      }
    }
  }
  return image;
}

}  // namespace lensd::sim
