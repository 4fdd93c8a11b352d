// Three kinds of weights: shares of area, from a closed form; for small disks weights fitted to the disk's transform,
// in a table that is made once a shape and interpolated in; and areas averaged over a pixel.
#include "render/disk_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <mutex>
#include <numbers>

#include "render/least_squares.h"

namespace lensd::sim {
namespace {

/// Area of the disk of radius r inside the quadrant { x' <= x, y' <= y }.
///
/// Cut at x, the disk's part left of it is a segment; within it the height above -r at abscissa t is
/// min(y, h(t)) + h(t) with h(t) = sqrt(r^2 - t^2) where -h(t) < y, and 0 elsewhere. The integral of h is elementary,
/// and the curve h crosses |y| at t = +- sqrt(r^2 - y^2), which splits the interval into at most three parts.
double HalfChordIntegral(double r, double t) {
  const double clamped = std::clamp(t, -r, r);
  return 0.5 * (clamped * std::sqrt(std::max(0.0, r * r - clamped * clamped)) + r * r * std::asin(clamped / r));
}

double DiskInQuadrant(double r, double x, double y) {
  if (x <= -r || y <= -r) return 0.0;
  const double end = std::min(x, r);
  const auto chord = [r](double from, double to) { return HalfChordIntegral(r, to) - HalfChordIntegral(r, from); };
  if (y >= r) return 2.0 * chord(-r, end);
  const double crossing = std::sqrt(r * r - y * y);
  // Where |t| < crossing the line at height y cuts the disk: what is below is y + h(t). Beyond, all (y > 0) or nothing.
  const double inside_end = std::clamp(end, -crossing, crossing);
  double area = y * (inside_end + crossing) + chord(-crossing, inside_end);
  if (y > 0.0) {
    area += 2.0 * chord(-r, std::min(end, -crossing));
    if (end > crossing) area += 2.0 * chord(crossing, end);
  }
  return area;
}

constexpr int kFitsPerPixel = 8;  // of diameter

/// Cover of the cell in column x, row y (both >= 0): exactly 1 or 0 where the circle does not cross it.
double CellCover(double diameter, const ApertureShape& shape, int x, int y) {
  const double r = 0.5 * diameter;
  if (shape.is_circle() && std::hypot(x + 0.5, y + 0.5) <= r) return 1.0;
  if (std::hypot(std::max(0.0, x - 0.5), std::max(0.0, y - 0.5)) >= shape.reach() * diameter) return 0.0;
  // Whole cells must be equal to the last bit: the running sums pass over what does not change.
  constexpr double kRounding = 1e-12;
  const double area = shape.AreaIn(diameter, x - 0.5, y - 0.5, x + 0.5, y + 0.5);
  return area > 1.0 - kRounding ? 1.0 : area < kRounding ? 0.0 : area;
}

/// How far from its middle a fitted kernel has weights: beyond the disk by as much as the fit needs.
double SupportOf(double diameter, const ApertureShape& shape) {
  return std::max(3.2, shape.reach() * diameter + (diameter < 5.0 ? 1.25 : 0.75));
}

/// A weight and the pixels that share it: (+-x, +-y), under a circle also (+-y, +-x).
struct Place {
  int x;
  int y;
  bool turned;

  /// Sum of the plane waves of u and v cycles a pixel over the pixels.
  double WaveOf(double u, double v) const {
    const auto wave = [](int at, double cycles) {
      return at == 0 ? 1.0 : 2.0 * std::cos(2.0 * std::numbers::pi * at * cycles);
    };
    return wave(x, u) * wave(y, v) + (turned ? wave(y, u) * wave(x, v) : 0.0);
  }
};

}  // namespace

/// Fitted kernels at every eighth of a pixel.
class KernelTable {
 public:
  /// Made at the first use; from any thread.
  static const KernelTable& Of(const ApertureShape& shape) {
    static std::mutex mutex;
    static std::map<int, KernelTable> tables;
    const std::lock_guard lock(mutex);
    return tables.try_emplace(shape.blades(), shape).first->second;
  }

  explicit KernelTable(const ApertureShape& shape) {
    const int last = static_cast<int>(kLargestFitted) * kFitsPerPixel;
    for (int i = 0; i <= last; ++i) kernels_.push_back(Fitted(static_cast<double>(i) / kFitsPerPixel, shape));
    kernels_.push_back(OfAreas(Largest(), shape));  // one more: no step where areas take over
  }

  /// Of the diameters `At` takes.
  static double Largest() { return kLargestFitted + 1.0 / kFitsPerPixel; }
  DiskKernel At(double diameter) const {
    const double at = diameter * kFitsPerPixel;
    const std::size_t below = std::min(static_cast<std::size_t>(at), kernels_.size() - 2);
    const double part = at - static_cast<double>(below);
    return part == 0.0 ? kernels_[below] : Between(kernels_[below], kernels_[below + 1], part);
  }

  /// Weights for every pixel of the square that `weight(x, y)` has for 0 <= y and 0 <= x, under a circle y <= x.
  template <class Weight>
  static DiskKernel Mirrored(int reach, const ApertureShape& shape, Weight weight) {
    DiskKernel kernel;
    kernel.reach = reach;
    const int side = 2 * reach + 1;
    kernel.weights.resize(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    const auto set = [&](int x, int y, double value) {
      kernel.weights[static_cast<std::size_t>((y + reach) * side + (x + reach))] = value;
    };
    for (int y = 0; y <= reach; ++y) {
      for (int x = shape.is_circle() ? y : 0; x <= reach; ++x) {
        const double value = weight(x, y);
        for (const int a : {x, -x}) {
          for (const int b : {y, -y}) {
            set(a, b, value);
            if (shape.is_circle()) set(b, a, value);
          }
        }
      }
    }
    double sum = 0.0;
    for (const double value : kernel.weights) sum += value;
    for (double& value : kernel.weights) value /= sum;
    return kernel;
  }

  /// The share of the disk's area in each pixel.
  static DiskKernel OfAreas(double diameter, const ApertureShape& shape) {
    const int reach = std::max(0, static_cast<int>(std::ceil(shape.reach() * diameter - 0.5)));
    if (reach == 0) return Mirrored(0, shape, [](int, int) { return 1.0; });
    return Mirrored(reach, shape, [&](int x, int y) { return CellCover(diameter, shape, x, y); });
  }

 private:
  static DiskKernel Fitted(double diameter, const ApertureShape& shape) {
    constexpr int kFrequencies = 24;  // from 0 to half a cycle a pixel
    constexpr double kBand = 1.0 / kShortestPeriod + 0.01;
    constexpr double kBeyond = 0.003;  // what the band's corners count
    if (diameter == 0.0) return OfAreas(0.0, shape);
    const double support = SupportOf(diameter, shape);
    std::vector<Place> places;
    for (int y = 0; y <= support; ++y) {
      for (int x = shape.is_circle() ? y : 0; std::hypot(x, y) <= support; ++x) {
        places.push_back({x, y, shape.is_circle() && x != y});
      }
    }
    LeastSquares fit(places.size());
    std::vector<double> waves(places.size());
    for (int i = 0; i <= kFrequencies; ++i) {
      for (int j = 0; j <= (shape.is_circle() ? i : kFrequencies); ++j) {
        const double u = 0.5 * i / kFrequencies, v = 0.5 * j / kFrequencies;
        std::ranges::transform(places, waves.begin(), [&](const Place& place) { return place.WaveOf(u, v); });
        const double turn = 2.0 * std::numbers::pi * diameter;
        fit.Add(waves, shape.Transfer(turn * u, turn * v).real(), std::hypot(u, v) <= kBand ? 1.0 : kBeyond);
      }
    }
    const std::vector<double> weights = std::move(fit).Solve();
    return Mirrored(static_cast<int>(support), shape, [&](int x, int y) {
      const auto place = std::ranges::find_if(places, [&](const Place& p) { return p.x == x && p.y == y; });
      return place == places.end() ? 0.0 : weights[static_cast<std::size_t>(place - places.begin())];
    });
  }

  static DiskKernel Between(const DiskKernel& a, const DiskKernel& b, double part) {
    DiskKernel kernel;
    kernel.reach = std::max(a.reach, b.reach);
    const auto of = [](const DiskKernel& from, int x, int y) {
      return std::max(std::abs(x), std::abs(y)) <= from.reach ? from.At(x, y) : 0.0;
    };
    for (int y = -kernel.reach; y <= kernel.reach; ++y) {
      for (int x = -kernel.reach; x <= kernel.reach; ++x) {
        kernel.weights.push_back((1.0 - part) * of(a, x, y) + part * of(b, x, y));
      }
    }
    return kernel;
  }

  std::vector<DiskKernel> kernels_;
};

double DiskInRectangle(double diameter, double x0, double y0, double x1, double y1) {
  const double r = 0.5 * diameter;
  return DiskInQuadrant(r, x1, y1) - DiskInQuadrant(r, x0, y1) - DiskInQuadrant(r, x1, y0) + DiskInQuadrant(r, x0, y0);
}

DiskKernel::DiskKernel(double diameter_px, const ApertureShape& shape)
    : DiskKernel(diameter_px < KernelTable::Largest() ? KernelTable::Of(shape).At(diameter_px)
                                                      : KernelTable::OfAreas(diameter_px, shape)) {}

DiskKernel DiskKernel::OfCells(double diameter_px, const ApertureShape& shape) {
  if (diameter_px > kLargestFitted) return KernelTable::OfAreas(diameter_px, shape);
  if (diameter_px == 0.0) return KernelTable::OfAreas(0.0, shape);
  constexpr int kPoints = 12;  // of a pixel, along each side
  const int reach = static_cast<int>(std::ceil(shape.reach() * diameter_px));
  return KernelTable::Mirrored(reach, shape, [&](int x, int y) {
    double sum = 0.0;
    for (int i = 0; i < kPoints; ++i) {
      for (int j = 0; j < kPoints; ++j) {
        const double left = x - (i + 0.5) / kPoints, top = y - (j + 0.5) / kPoints;
        sum += shape.AreaIn(diameter_px, left, top, left + 1.0, top + 1.0);
      }
    }
    return sum;
  });
}

}  // namespace lensd::sim
