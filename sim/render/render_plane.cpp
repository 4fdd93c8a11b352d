// One textured tilted plane. Its blur diameter d changes by g a pixel, so that the rays through the pixel at x and the
// aperture's points h (|h| <= 1/2) meet the plane at x + t with t = -h (d + g t): as h fills its disk, t fills the
// ellipse |t| <= |d + g t|/2, and evenly spread h leave light from t with the weight 1/(d + g t)^3. Both are summed as
// they are: line by line across the ellipse, on each line the light times the weight, a parabola there, from running
// sums of light, x light and x² light. The light is the picture of pixel means as it runs on between the pixels: a
// parabola in each cell along a line. Above and below the ellipse ends like a root, where evenly spaced lines go wrong
// first: what they miss there is worked out (Navot, An extension of the Euler-Maclaurin summation formula to functions
// with a branch singularity, J. Math. Phys. 40, 1961), so that few lines do. What is left out is the next order of
// that, and the weight's third order.
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "sim/render/band_filter.h"
#include "sim/render/view.h"

namespace lensd::sim {
namespace {

constexpr double kEdgeError = 0.25 / 255.0;  // what the lines may miss of the edge
constexpr int kMostLines = 8;                // in a row of cells
constexpr double kWide = 64.0;               // px of blur
constexpr double kFewLines = 0.75;           // px of blur; below, no line may be missed
constexpr double kSteepest = 0.5;            // px a pixel; above, the weight is no parabola

/// Lines a cell row for disks of that diameter, a power of two. Without the ends' share n lines miss up to
/// 0.53 (n d)^-1.5 of the light's range; of that share the light beside the ends leaves a tenth open. A line a row
/// shows the finest structures as others, which only wide disks do not care about.
int LinesFor(double diameter, double range) {
  const double enough = std::pow(0.053 * range / kEdgeError, 2.0 / 3.0);
  int lines = diameter < kWide ? 2 : 1;
  while (lines < kMostLines && diameter * lines < enough) lines *= 2;
  return lines;
}

constexpr int kLevels = 2 * kMostLines;  // heights of lines in a cell row
constexpr double kSharpPlane = 0.1;      // px of blur that nothing shows

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

/// Running sums along evenly spaced lines of light times 1, x and x², x from the raster's left side.
class Moments {
 public:
  /// For `lines` lines in each of `rows` rows from `first` on; `cells` reach kBandReach rows beyond, and as many
  /// columns beyond `left` and `left` + `width`.
  Moments(const Raster& cells, int left, int width, int first, int rows, int lines)
      : first_(first), lines_(lines), width_(static_cast<std::size_t>(width)) {
    const auto all = static_cast<std::size_t>(rows) * static_cast<std::size_t>(lines);
    sums_.resize((width_ + 1) * all);
    parabolas_.resize(width_ * all);
    std::vector<double> line(width_ + 2 * kBandReach);
    for (int i = 0; i < rows * lines; ++i) {
      const int place = i % lines * (kLevels / lines) + kLevels / (2 * lines);
      const std::vector<double>& level = FiltersOfLines().level[static_cast<std::size_t>(place)];
      std::fill(line.begin(), line.end(), 0.0);
      for (int k = -kBandReach; k <= kBandReach; ++k) {
        const float* row = cells.Row(first + i / lines + k) + (left - kBandReach - cells.rect.x);
        const double weight = level[static_cast<std::size_t>(k + kBandReach)];
        for (std::size_t x = 0; x < line.size(); ++x) line[x] += weight * static_cast<double>(row[x]);
      }
      Sum(line, static_cast<std::size_t>(i));
    }
  }

  int lines() const { return lines_; }
  /// The line at height y of the picture, 0 at the first; between lines a part of their distance.
  double LineAt(double y) const { return (y - first_) * lines_ - 0.5; }
  double HeightOf(int line) const { return first_ + (line + 0.5) / lines_; }

  /// The integrals from the left side to `x` along a line.
  Three Until(int line, double x) const {
    const double cell = CellOf(x);
    const auto i = static_cast<std::size_t>(cell), at = static_cast<std::size_t>(line);
    const Three past = WithinCell(parabolas_[at * width_ + i], x - cell - 0.5);
    Three sum = sums_[at * (width_ + 1) + i];
    Shift(sum, past, cell + 0.5);
    return sum;
  }

  /// The light at `x` from the left side and height y, on a straight line between the two lines beside it.
  double LightAt(double x, double y) const {
    const double line = LineAt(y), below = std::floor(line);
    const double cell = CellOf(x), t = x - cell - 0.5;
    const auto on = [&](std::size_t at) {
      const Three& parabola = parabolas_[at * width_ + static_cast<std::size_t>(cell)];
      return parabola[0] + t * parabola[1] + (t * t - 1.0 / 12.0) * parabola[2];
    };
    const auto at = static_cast<std::size_t>(below);
    return on(at) + (line - below) * (on(at + 1) - on(at));
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

  double CellOf(double x) const { return std::clamp(std::floor(x), 0.0, static_cast<double>(width_ - 1)); }

  int first_;
  int lines_;
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

/// A pixel and its blur.
struct Spot {
  Ellipse e;
  double x, y;  ///< the pixel's centre, x from the moments' left side
};

/// Adds the light along one line at height y, of thickness h.
void AddLine(const Moments& moments, const Spot& spot, int line, double y, double h, Share& share) {
  const Ellipse& e = spot.e;
  const double t_y = y - spot.y, reach = e.d + e.gy * t_y, a = 1.0 - e.gx * e.gx / 4.0;
  const double root = std::sqrt(std::max(0.0, reach * reach - 4.0 * a * t_y * t_y));
  const double left = (e.gx * reach / 2.0 - root) / (2.0 * a), right = (e.gx * reach / 2.0 + root) / (2.0 * a);
  // (d + g t)^-3 about the line's middle, to second order; scaled to 1 at the pixel's centre.
  const double middle = (left + right) / 2.0, there = reach + e.gx * middle, slope = e.gx / there;
  const double scale = e.d / there, weight = h * scale * scale * scale;
  const std::array c{1.0 + 3.0 * slope * middle + 6.0 * slope * slope * middle * middle,
                     -3.0 * slope - 12.0 * slope * slope * middle, 6.0 * slope * slope};
  const Three from = moments.Until(line, spot.x + left), to = moments.Until(line, spot.x + right);
  const double s0 = to[0] - from[0], s1 = to[1] - from[1] - spot.x * s0;
  const double s2 = to[2] - from[2] - spot.x * (2.0 * (to[1] - from[1]) - spot.x * s0);
  share.light += weight * (c[0] * s0 + c[1] * s1 + c[2] * s2);
  const double half = (right - left) / 2.0;
  share.weight += weight * 2.0 * half * (1.0 + 2.0 * slope * slope * half * half);
}

/// Hurwitz' zeta(-1/2, part), 0 <= part <= 1: what h times the sum of sqrt(t) at t = h (part + 0, 1, 2 ...) has too
/// much of the integral from 0, over h^1.5. From the Euler-Maclaurin sum at 1 + part.
double RootExcess(double part) {
  const double a = 1.0 + part, root = std::sqrt(a);
  return std::sqrt(part) + root * (0.5 - 2.0 / 3.0 * a) - (1.0 / 24.0 - 1.0 / (1920.0 * a * a)) / root;
}

/// Takes back what lines h apart have too much at one end of the ellipse, t_y above the pixel's centre; the nearest
/// line lies `part` h inside.
void CorrectEnd(const Moments& moments, const Spot& spot, double t_y, double h, double part, Share& share) {
  const Ellipse& e = spot.e;
  const double reach = e.d + e.gy * t_y, a = 1.0 - e.gx * e.gx / 4.0;
  const double x = e.gx * reach / (2.0 * a), scale = e.d / (reach + e.gx * x);
  // The chord is this times the root of the distance from the end.
  const double chord = std::sqrt(2.0 * e.d) * std::pow(a, -0.75) * std::sqrt(2.0);
  const double excess = scale * scale * scale * chord * h * std::sqrt(h) * RootExcess(part);
  share.light -= excess * moments.LightAt(spot.x + x, spot.y + t_y);
  share.weight -= excess;
}

/// Of small disks, whose ends are all there is: as many lines as there are levels, in the middles of equal parts.
Share SmallDisk(const Moments& moments, const Spot& spot, double top, double bottom) {
  const int count = std::max(4, static_cast<int>(std::ceil((bottom - top) * 4 * kMostLines)));
  const double h = (bottom - top) / count;
  Share share;
  for (int i = 0; i < count; ++i) {
    // A line halfway between two levels takes the upper and the lower one in turn.
    const double at = top + (i + 0.5) * h + (i % 2 == 0 ? 1e-9 : -1e-9);
    AddLine(moments, spot, static_cast<int>(std::lround(moments.LineAt(at))), at, h, share);
  }
  return share;
}

double LightOf(const Moments& moments, const Spot& spot, int lines) {
  const Ellipse& e = spot.e;
  const double a = 2.0 * std::sqrt(1.0 - e.gx * e.gx / 4.0);
  const double top = -e.d / (a + e.gy), bottom = e.d / (a - e.gy);
  Share share;
  if (e.d < kFewLines) {
    share = SmallDisk(moments, spot, spot.y + top, spot.y + bottom);
    return share.light / share.weight;
  }
  const int step = moments.lines() / lines;
  const double h = 1.0 / lines;
  const double begin = moments.LineAt(spot.y + top) / step, end = moments.LineAt(spot.y + bottom) / step;
  const int first = static_cast<int>(std::ceil(begin)), last = static_cast<int>(std::floor(end));
  for (int i = first; i <= last; ++i) AddLine(moments, spot, i * step, moments.HeightOf(i * step), h, share);
  CorrectEnd(moments, spot, top, h, first - begin, share);
  CorrectEnd(moments, spot, bottom, h, end - last, share);
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
  const Raster light = canvas.LightOver(Grown(view.region, reach + kBandReach + 2));
  const double range = LivelinessOf(light).range;
  const Tilt tilt = TiltOf(view);
  const PixelRect all = view.region;
  const int left = all.x - reach;
  const auto blur_at = [&](int x, int y) { return view.line.At(canvas.PlaneVergence(x + 0.5, y + 0.5)); };
  Raster image(all);
  for (int top = all.y; top < all.y + all.height && !view.stop.stop_requested(); top += kBand) {
    const int rows = std::min(kBand, all.y + all.height - top);
    int lines = 1;
    for (int y = top; y < top + rows; ++y) {
      for (int x = all.x; x < all.x + all.width; ++x) {
        const double d = std::abs(blur_at(x, y));
        if (d >= kSharpPlane) lines = std::max(lines, LinesFor(d, range));
      }
    }
    const Moments moments(light, left, all.width + 2 * reach, top - reach - 1, rows + 2 * reach + 2, lines);
    for (int y = top; y < top + rows; ++y) {
      for (int x = all.x; x < all.x + all.width; ++x) {
        const double d = blur_at(x, y), sign = d < 0.0 ? -1.0 : 1.0;
        const Spot spot{{std::abs(d), sign * tilt.gx, sign * tilt.gy}, x - left + 0.5, y + 0.5};
        image.Row(y)[x - all.x] = spot.e.d < kSharpPlane
                                      ? light.At(x, y)
                                      : static_cast<float>(LightOf(moments, spot, LinesFor(spot.e.d, range)));
      }
    }
  }
  return image;
}

}  // namespace lensd::sim
