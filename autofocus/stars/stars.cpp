// What stands out of the background at a few scales, from fine to coarse, each blob measured by its curve of growth. A
// blob that goes on outside of the circle that should hold it, or is not round, is no star at this scale; a coarser
// one may find it whole.
#include "autofocus/stars.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autofocus/stars/star_patch.h"

namespace lensd::autofocus {
namespace {

constexpr int kScales[] = {3, 9, 21};       ///< px, sides of the squares whose means are looked at
constexpr double kDetected = 6.0;           ///< standard deviations of such a mean
constexpr double kClearFlux = 8.0;          ///< standard deviations of the flux of a star
constexpr double kLeastRound = 0.4;         ///< smaller over larger second moment
constexpr double kMostOutside = 0.12;       ///< of the flux: what the ring around a star's circle may hold
constexpr double kLonePixel = 0.85;         ///< of the flux in the brightest pixel
constexpr double kRadiiInCircle = 2.2;      ///< half-flux radii
constexpr double kGaussianFwhm = 2.354820;  ///< standard deviations: 2 sqrt(2 ln 2)

/// Means over squares of `side`, less at the edges.
std::vector<double> Smoothed(const Patch& patch, int side) {
  const auto wide = static_cast<std::size_t>(patch.width) + 1;
  std::vector<double> sums(wide * (static_cast<std::size_t>(patch.height) + 1));
  for (int row = 0; row < patch.height; ++row) {
    double line = 0.0;
    for (int column = 0; column < patch.width; ++column) {
      line += patch.At(column, row);
      const std::size_t here = static_cast<std::size_t>(row + 1) * wide + static_cast<std::size_t>(column + 1);
      sums[here] = sums[here - wide] + line;
    }
  }
  std::vector<double> means(patch.light.size());
  const int reach = side / 2;
  for (int row = 0; row < patch.height; ++row) {
    const auto top = static_cast<std::size_t>(std::max(0, row - reach)) * wide;
    const auto bottom = static_cast<std::size_t>(std::min(patch.height, row + reach + 1)) * wide;
    for (int column = 0; column < patch.width; ++column) {
      const auto left = static_cast<std::size_t>(std::max(0, column - reach));
      const auto right = static_cast<std::size_t>(std::min(patch.width, column + reach + 1));
      const double sum = sums[bottom + right] - sums[bottom + left] - sums[top + right] + sums[top + left];
      means[patch.Index(column, row)] = sum / (side * side);
    }
  }
  return means;
}

struct Blob {
  double x = 0.0, y = 0.0;  ///< its middle, px of the patch
  double radius = 0.0;      ///< of a circle of its area
};

/// Connected pixels above the threshold that are not taken yet.
std::vector<Blob> BlobsIn(const Patch& patch, const std::vector<double>& means, double threshold,
                          std::vector<char> taken) {
  std::vector<Blob> blobs;
  std::vector<std::pair<int, int>> open;
  for (int row = 0; row < patch.height; ++row) {
    for (int column = 0; column < patch.width; ++column) {
      const auto wanted = [&](int at_column, int at_row) {
        if (at_column < 0 || at_row < 0 || at_column >= patch.width || at_row >= patch.height) return false;
        const std::size_t index = patch.Index(at_column, at_row);
        return taken[index] == 0 && means[index] > threshold;
      };
      if (!wanted(column, row)) continue;
      double count = 0.0, x = 0.0, y = 0.0;
      open.assign(1, {column, row});
      taken[patch.Index(column, row)] = 1;
      while (!open.empty()) {
        const auto [at_column, at_row] = open.back();
        open.pop_back();
        count += 1.0;
        x += at_column + 0.5;
        y += at_row + 0.5;
        for (const auto& [right, down] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
          if (!wanted(at_column + right, at_row + down)) continue;
          taken[patch.Index(at_column + right, at_row + down)] = 1;
          open.emplace_back(at_column + right, at_row + down);
        }
      }
      blobs.push_back({x / count, y / count, std::sqrt(count / std::numbers::pi)});
    }
  }
  return blobs;
}

/// Light by its distance from a centre.
struct Growth {
  static constexpr double kBinsPerPx = 32.0;
  std::vector<double> bins{};
  double flux = 0.0;

  /// Where it comes to a half.
  double HalfFluxRadius() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < bins.size(); ++i) {
      if (sum + bins[i] >= 0.5 * flux) return (static_cast<double>(i) + (0.5 * flux - sum) / bins[i]) / kBinsPerPx;
      sum += bins[i];
    }
    return 0.0;
  }
  double Between(double from, double to) const {
    double sum = 0.0;
    const auto first = static_cast<std::size_t>(std::max(from, 0.0) * kBinsPerPx);
    for (std::size_t i = first; i < std::min(bins.size(), static_cast<std::size_t>(to * kBinsPerPx)); ++i)
      sum += bins[i];
    return sum;
  }
};

/// Of all within the circle; a pixel counts by its parts.
Growth GrowthIn(const Patch& patch, const Blob& circle, double background) {
  Growth growth;
  growth.bins.resize(static_cast<std::size_t>(circle.radius * Growth::kBinsPerPx) + 1);
  const auto from = [](double centre, double radius) { return static_cast<int>(std::floor(centre - radius)); };
  const auto to = [](double centre, double radius) { return static_cast<int>(std::ceil(centre + radius)); };
  const int parts = circle.radius < 8.0 ? 8 : circle.radius < 20.0 ? 4 : 2;
  for (int row = from(circle.y, circle.radius); row < to(circle.y, circle.radius); ++row) {
    for (int column = from(circle.x, circle.radius); column < to(circle.x, circle.radius); ++column) {
      const double each = (patch.At(column, row) - background) / (parts * parts);
      for (int part = 0; part < parts * parts; ++part) {
        const int across = part % parts, down = part / parts;
        const double x = column + (across + 0.5) / parts - circle.x;
        const double y = row + (down + 0.5) / parts - circle.y;
        const double radius = std::sqrt(x * x + y * y);
        if (radius > circle.radius) continue;
        growth.bins[static_cast<std::size_t>(radius * Growth::kBinsPerPx)] += each;
        growth.flux += each;
      }
    }
  }
  return growth;
}

/// The circle with a margin lies in the patch.
bool Fits(const Patch& patch, const Blob& circle, double margin) {
  const double reach = circle.radius + margin;
  return circle.x - reach >= 0 && circle.y - reach >= 0 && circle.x + reach <= patch.width &&
         circle.y + reach <= patch.height;
}

struct Ring {
  double background = 0.0;  ///< median
  double mean = 0.0;
};

Ring RingAround(const Patch& patch, const Blob& circle, double wide) {
  std::vector<double> values;
  double sum = 0.0;
  const double reach = circle.radius + wide;
  for (int row = static_cast<int>(circle.y - reach); row < circle.y + reach && row < patch.height; ++row) {
    for (int column = static_cast<int>(circle.x - reach); column < circle.x + reach && column < patch.width; ++column) {
      const double radius = std::hypot(column + 0.5 - circle.x, row + 0.5 - circle.y);
      if (radius <= circle.radius || radius > reach) continue;
      values.push_back(patch.At(column, row));
      sum += values.back();
    }
  }
  const auto count = static_cast<double>(values.size());
  return {MedianOf(std::move(values)), sum / count};
}

/// Second moments of what is within `reach` of the centre: the smaller over the larger; the centre is moved to the
/// centroid.
double Centre(const Patch& patch, Blob& circle, double reach, double background) {
  double light = 0.0, x = 0.0, y = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;
  for (int row = static_cast<int>(circle.y - reach); row < circle.y + reach; ++row) {
    for (int column = static_cast<int>(circle.x - reach); column < circle.x + reach; ++column) {
      const double dx = column + 0.5 - circle.x, dy = row + 0.5 - circle.y;
      if (std::hypot(dx, dy) > reach) continue;
      const double here = patch.At(column, row) - background;
      light += here;
      x += here * dx;
      y += here * dy;
      xx += here * dx * dx;
      yy += here * dy * dy;
      xy += here * dx * dy;
    }
  }
  if (!(light > 0.0)) return 0.0;
  x /= light;
  y /= light;
  if (std::hypot(x, y) < reach) {
    circle.x += x;
    circle.y += y;
  }
  constexpr double kPixel = 0.5;  // px²: what is small beside a pixel is round
  xx = xx / light - x * x + kPixel;
  yy = yy / light - y * y + kPixel;
  xy = xy / light - x * y;
  const double middle = 0.5 * (xx + yy), apart = std::hypot(0.5 * (xx - yy), xy);
  return middle > 0.0 ? (middle - apart) / (middle + apart) : 0.0;
}

/// The Gaussian whose logarithm, a line over the squared radius, fits what is bright and not clipped, weighted by its
/// light (Guo, IEEE Signal Processing Magazine 28(5), 2011).
std::optional<double> FwhmOf(const Patch& patch, const Blob& circle, double background) {
  constexpr double kBright = 0.2;  // of the brightest
  struct Point {
    double square = 0.0, light = 0.0;
  };
  std::vector<Point> points;
  double brightest = 0.0;
  for (int row = static_cast<int>(circle.y - circle.radius); row < circle.y + circle.radius; ++row) {
    for (int column = static_cast<int>(circle.x - circle.radius); column < circle.x + circle.radius; ++column) {
      if (patch.full[patch.Index(column, row)] != 0) continue;
      const double dx = column + 0.5 - circle.x, dy = row + 0.5 - circle.y;
      points.push_back({dx * dx + dy * dy, patch.At(column, row) - background});
      brightest = std::max(brightest, points.back().light);
    }
  }
  double w = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  int used = 0;
  for (const Point& point : points) {
    if (point.light < kBright * brightest || point.light < 3.0 * patch.noise) continue;
    const double weight = point.light * point.light, log = std::log(point.light);
    ++used;
    w += weight;
    x += weight * point.square;
    y += weight * log;
    xx += weight * point.square * point.square;
    xy += weight * point.square * log;
  }
  const double spread = w * xx - x * x;
  if (used < 5 || !(spread > 0.0)) return std::nullopt;
  const double slope = (w * xy - x * y) / spread;
  if (!(slope < 0.0)) return std::nullopt;
  return kGaussianFwhm * std::sqrt(-0.5 / slope);
}

/// The blob as a star, its circle left in `circle`.
std::optional<Star> Measure(const Patch& patch, Blob& circle) {
  constexpr int kRounds = 5;
  constexpr double kRingPx = 4.0;
  circle.radius += 2.0;
  Star star;
  double round = 0.0;
  Growth growth;
  Ring ring;
  double reach = circle.radius;
  for (int i = 0; i < kRounds; ++i) {
    if (!Fits(patch, circle, kRingPx)) return std::nullopt;
    ring = RingAround(patch, circle, kRingPx);
    round = Centre(patch, circle, reach, ring.background);
    if (!Fits(patch, circle, kRingPx)) return std::nullopt;
    growth = GrowthIn(patch, circle, ring.background);
    star.flux = growth.flux;
    star.hfr_px = growth.HalfFluxRadius();
    if (!(star.flux > 0.0) || !(star.hfr_px > 0.0)) return std::nullopt;
    if (i + 1 < kRounds) circle.radius = kRadiiInCircle * star.hfr_px + 2.0;
    reach = std::min(circle.radius, 1.6 * star.hfr_px + 1.0);  // over the rim of an even disk
  }
  const double area = std::numbers::pi * circle.radius * circle.radius;
  if (star.flux < kClearFlux * patch.noise * std::sqrt(area) || round < kLeastRound) return std::nullopt;
  const double ring_area = std::numbers::pi * std::pow(circle.radius + kRingPx, 2) - area;
  const double outside = std::abs(ring.mean - ring.background) * ring_area;
  const double by_noise = 4.0 * patch.noise * std::sqrt(ring_area);
  if (outside > std::max(kMostOutside * star.flux, by_noise)) return std::nullopt;
  if (std::abs(ring.background) * area > std::max(0.5 * star.flux, by_noise)) return std::nullopt;

  // F(r) is off by half of what the whole circle's noise adds; its slope makes a radius of that.
  constexpr double kBeside = 0.3;  // half-flux radii
  const double beside = growth.Between((1.0 - kBeside) * star.hfr_px, (1.0 + kBeside) * star.hfr_px);
  double brightest = 0.0;
  const double slope = std::max(beside / (2.0 * kBeside * star.hfr_px), 0.05 * star.flux / star.hfr_px);
  star.hfr_sigma = 0.5 * patch.noise * std::sqrt(area) / slope;
  for (int row = static_cast<int>(circle.y - circle.radius); row < circle.y + circle.radius; ++row) {
    for (int column = static_cast<int>(circle.x - circle.radius); column < circle.x + circle.radius; ++column) {
      star.clipped = star.clipped || patch.full[patch.Index(column, row)] != 0;
      brightest = std::max(brightest, patch.At(column, row));
    }
  }
  star.lone_pixel = brightest > kLonePixel * star.flux;
  star.fwhm_px = FwhmOf(patch, circle, ring.background);
  star.x = patch.x + circle.x;
  star.y = patch.y + circle.y;
  return star;
}

void Take(const Patch& patch, const Blob& circle, std::vector<char>& taken) {
  for (int row = 0; row < patch.height; ++row) {
    for (int column = 0; column < patch.width; ++column) {
      if (std::hypot(column + 0.5 - circle.x, row + 0.5 - circle.y) <= circle.radius) {
        taken[patch.Index(column, row)] = 1;
      }
    }
  }
}

std::optional<double> MedianOver(const std::vector<Star>& stars, auto&& value) {
  std::vector<double> values;
  for (const Star& star : stars) {
    if (const std::optional<double> one = value(star); one && !star.clipped) values.push_back(*one);
  }
  if (values.empty()) return std::nullopt;
  return MedianOf(std::move(values));
}

}  // namespace

std::vector<Star> FindStars(const drivers::Frame& frame, const Window& window) {
  const Patch patch = PatchOf(frame, window);
  std::vector<Star> stars;
  std::vector<char> taken(patch.light.size());
  for (const int side : kScales) {
    const double threshold = kDetected * patch.noise / side;
    for (Blob& blob : BlobsIn(patch, Smoothed(patch, side), threshold, taken)) {
      const auto star = Measure(patch, blob);
      if (!star) continue;
      const bool again = std::ranges::any_of(stars, [&](const Star& other) {
        return std::hypot(other.x - star->x, other.y - star->y) < kRadiiInCircle * std::max(other.hfr_px, star->hfr_px);
      });
      if (again) continue;
      Take(patch, blob, taken);
      stars.push_back(*star);
    }
  }
  std::erase_if(stars, [&](const Star& star) {
    return star.x < window.x || star.y < window.y || star.x >= window.x + window.width ||
           star.y >= window.y + window.height;
  });
  std::ranges::stable_sort(stars, std::ranges::greater(), &Star::flux);
  if (stars.size() > kMostStars) stars.resize(kMostStars);
  return stars;
}

StarFigures FiguresOf(const std::vector<Star>& stars) {
  StarFigures figures;
  figures.count = static_cast<int>(stars.size());
  figures.clipped = static_cast<int>(std::ranges::count(stars, true, &Star::clipped));
  figures.hfr_px = MedianOver(stars, [](const Star& star) { return std::optional(star.hfr_px); });
  figures.fwhm_px = MedianOver(stars, [](const Star& star) { return star.fwhm_px; });
  return figures;
}

}  // namespace lensd::autofocus
