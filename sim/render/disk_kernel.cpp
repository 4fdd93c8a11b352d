// Four kinds of weights: shares of area, from a closed form; for large disks areas of half pixels, brought to whole
// ones by a filter that is fitted to the band; for small disks weights fitted to the disk's transform, in a table that
// is made once a shape and interpolated in; and areas averaged over a pixel.
#include "sim/render/disk_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <mutex>
#include <numbers>

#include "sim/render/least_squares.h"

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

/// Whole cells must be equal to the last bit: the running sums pass over what does not change.
double Settled(double share, double least) {
  return share > 1.0 - least && share < 1.0 + least ? 1.0 : std::abs(share) < least ? 0.0 : share;
}

/// Share of the square [x, x + size] x [y, y + size] that is covered, none of its middle left of or above the origin:
/// exactly 1 or 0 where the outline does not cross it.
double SquareCover(double diameter, const ApertureShape& shape, double x, double y, double size) {
  constexpr double kRounding = 1e-12;
  if (std::hypot(x + size, y + size) <= shape.inner_reach() * diameter) return 1.0;
  if (std::hypot(std::max(0.0, x), std::max(0.0, y)) >= shape.reach() * diameter) return 0.0;
  return Settled(shape.AreaIn(diameter, x, y, x + size, y + size) / (size * size), kRounding);
}

/// How far from its middle a fitted kernel has weights: beyond the disk by as much as the fit needs.
double SupportOf(double diameter, const ApertureShape& shape) {
  return std::max(3.2, shape.reach() * diameter + (diameter < 5.0 ? 1.25 : 0.75));
}

constexpr int kHalves = 5;  // half pixels to each side of a pixel's middle that count in it

/// What the half pixels at 1/4, 3/4, ... px from a pixel's middle count in it, along one side. Fitted so that light
/// below half a cycle a pixel passes and light above, which would come back into the band, does not. A disk's transform
/// falls as frequency^-1.5, and so does the need.
const std::vector<double>& HalfPixelFilter() {
  static const std::vector<double> filter = [] {
    constexpr int kFrequencies = 400;  // to two cycles a pixel, where everything repeats
    constexpr double kBand = 1.0 / kShortestPeriod + 0.01, kBeyond = 0.3;
    constexpr double kEven = 1e8;  // light that is the same everywhere stays so
    LeastSquares fit(kHalves);
    for (int i = 0; i <= kFrequencies; ++i) {
      const double f = 2.0 * i / kFrequencies, x = 0.5 * std::numbers::pi * f;
      std::vector<double> waves;
      for (int k = 0; k < kHalves; ++k) waves.push_back(2.0 * std::cos((2 * k + 1) * x) * std::sph_bessel(0, x));
      const double shown_as = std::abs(f - std::round(f));
      const bool even = i == 0 || 2 * i == kFrequencies;
      const double importance = even ? kEven : (shown_as <= kBand ? 1.0 : kBeyond) / (f * f * f);
      fit.Add(waves, f < 0.5 ? 1.0 : 0.0, importance);
    }
    return std::move(fit).Solve();
  }();
  return filter;
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
    kernels_.push_back(OfHalfPixels(Largest(), shape));  // one more: no step where they take over
  }

  /// Of the diameters `At` takes.
  static double Largest() { return kLargestFitted + 1.0 / kFitsPerPixel; }
  DiskKernel At(double diameter) const {
    const double at = diameter * kFitsPerPixel;
    const std::size_t below = std::min(static_cast<std::size_t>(at), kernels_.size() - 2);
    const double part = at - static_cast<double>(below);
    return part == 0.0 ? kernels_[below] : Mixed(1.0 - part, kernels_[below], part, kernels_[below + 1]);
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

  /// So much of the one and so much of the other.
  static DiskKernel Mixed(double of_a, const DiskKernel& a, double of_b, const DiskKernel& b) {
    DiskKernel kernel;
    kernel.reach = std::max(a.reach, b.reach);
    const auto at = [](const DiskKernel& from, int x, int y) {
      return std::max(std::abs(x), std::abs(y)) <= from.reach ? from.At(x, y) : 0.0;
    };
    for (int y = -kernel.reach; y <= kernel.reach; ++y) {
      for (int x = -kernel.reach; x <= kernel.reach; ++x) {
        kernel.weights.push_back(of_a * at(a, x, y) + of_b * at(b, x, y));
      }
    }
    return kernel;
  }

  /// The share of the disk's area in each pixel.
  static DiskKernel OfAreas(double diameter, const ApertureShape& shape) {
    const int reach = std::max(0, static_cast<int>(std::ceil(shape.reach() * diameter - 0.5)));
    if (reach == 0) return Mirrored(0, shape, [](int, int) { return 1.0; });
    return Mirrored(reach, shape, [&](int x, int y) { return SquareCover(diameter, shape, x - 0.5, y - 0.5, 1.0); });
  }

  /// The disk's area in each half pixel, filtered along both sides to pixels.
  static DiskKernel OfHalfPixels(double diameter, const ApertureShape& shape) {
    constexpr double kLeast = 0.02;  // of a pixel; less costs a step of the sums and changes nothing that counts
    const std::vector<double>& filter = HalfPixelFilter();
    const int reach = static_cast<int>(shape.reach() * diameter + 0.5 * kHalves);
    const auto side = static_cast<std::size_t>(reach) + 1, halves = 2 * side + kHalves;
    std::vector<double> cover(halves * halves);
    for (std::size_t y = 0; y < halves; ++y) {
      for (std::size_t x = shape.is_circle() ? y : 0; x < halves; ++x) {
        const double share =
            SquareCover(diameter, shape, 0.5 * static_cast<double>(x), 0.5 * static_cast<double>(y), 0.5);
        cover[y * halves + x] = share;
        if (shape.is_circle()) cover[x * halves + y] = share;
      }
    }
    // Half pixels are counted from the middle, at both sides alike.
    const auto filtered = [&](const double* first, std::size_t step, int pixel) {
      double sum = 0.0;
      for (int k = 0; k < kHalves; ++k) {
        const int after = 2 * pixel + k, before = 2 * pixel - 1 - k;
        const auto at = [&](int half) { return first[static_cast<std::size_t>(half < 0 ? -1 - half : half) * step]; };
        sum += filter[static_cast<std::size_t>(k)] * (at(after) + at(before));
      }
      return sum;
    };
    std::vector<double> rows(side * halves);
    for (std::size_t y = 0; y < side; ++y) {
      for (std::size_t x = 0; x < halves; ++x) rows[y * halves + x] = filtered(&cover[x], halves, static_cast<int>(y));
    }
    std::vector<double> weights(side * side);
    int needed = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const int x = static_cast<int>(i % side), y = static_cast<int>(i / side);
      weights[i] = Settled(filtered(&rows[i / side * halves], 1, x), kLeast);
      if (weights[i] != 0.0) needed = std::max({needed, x, y});
    }
    return Mirrored(needed, shape, [&](int x, int y) {
      return weights[static_cast<std::size_t>(y) * side + static_cast<std::size_t>(x)];
    });
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

  std::vector<DiskKernel> kernels_;
};

double DiskInRectangle(double diameter, double x0, double y0, double x1, double y1) {
  const double r = 0.5 * diameter;
  return DiskInQuadrant(r, x1, y1) - DiskInQuadrant(r, x0, y1) - DiskInQuadrant(r, x1, y0) + DiskInQuadrant(r, x0, y0);
}

DiskKernel::DiskKernel(double diameter_px, const ApertureShape& shape)
    : DiskKernel(diameter_px < KernelTable::Largest() ? KernelTable::Of(shape).At(diameter_px)
                                                      : KernelTable::OfHalfPixels(diameter_px, shape)) {}

DiskKernel DiskKernel::Sparse(double diameter_px, const ApertureShape& shape) {
  if (diameter_px <= kLargestFitted) return DiskKernel(diameter_px, shape);
  DiskKernel areas = KernelTable::OfAreas(std::max(diameter_px, KernelTable::Largest()), shape);
  if (diameter_px >= KernelTable::Largest()) return areas;
  const double part = (diameter_px - kLargestFitted) / (KernelTable::Largest() - kLargestFitted);
  return KernelTable::Mixed(1.0 - part, DiskKernel(kLargestFitted, shape), part, areas);  // no step between the two
}

int DiskKernel::LargestReach(double diameter_px, const ApertureShape& shape) {
  return static_cast<int>(std::max(SupportOf(0.0, shape), shape.reach() * diameter_px + 0.5 * kHalves));
}

DiskKernel DiskKernel::operator-(const DiskKernel& other) const {
  return KernelTable::Mixed(1.0, *this, -1.0, other);
}

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
