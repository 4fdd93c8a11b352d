// Each search works its whole way through from the frames so far every time it is asked, which is what makes it a pure
// function. They see sharpness only, and no noise.
#include "autofocus/search/searches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "autofocus/peak_fit.h"
#include "autofocus/search/sharpness_curve.h"

namespace lensd::autofocus {
namespace {

using Points = std::span<const SearchPoint>;

// px of blur between the frames of the first pass
constexpr double kCoarseStepPx = 8.0, kClimbPx = 16.0, kFittedStepPx = 5.0, kScanPx = 9.0;
constexpr double kBlindSteps = 170.0;  ///< a "pixel of blur" is this part of the range where the optics are not known

double BlurPixel(const Setup& setup) {
  const double pixel = setup.blur_px.value_or((setup.highest - setup.lowest) / kBlindSteps);
  return std::max(pixel, setup.resolution);
}

double Inside(const Setup& setup, double position) {
  return std::clamp(position, setup.lowest, setup.highest);
}

Verdict Claim(const Setup& setup, double position, double step) {
  Verdict verdict;
  verdict.focused = true;
  verdict.position = Inside(setup, position);
  verdict.sigma = step / std::sqrt(12.0);
  verdict.reason = "the sharpest place the search came to";
  return verdict;
}

/// Positions low, low + step, ... up to high, in the direction that takes up the backlash.
std::vector<double> Grid(const Setup& setup, double low, double high, double step) {
  const int intervals = std::max(1, static_cast<int>(std::ceil((high - low) / step)));
  std::vector<double> grid;
  for (int i = 0; i <= intervals; ++i) grid.push_back(std::lerp(low, high, static_cast<double>(i) / intervals));
  if (!setup.ascending) std::ranges::reverse(grid);
  return grid;
}

const SearchPoint& Sharpest(Points points) {
  return *std::ranges::max_element(points, {}, &SearchPoint::value);
}

/// Of a parabola through the sharpest of `scan` and its two neighbours in it; the sharpest itself at an end.
double VertexOf(Points scan) {
  const auto top = static_cast<std::size_t>(&Sharpest(scan) - scan.data());
  if (top == 0 || top + 1 == scan.size()) return scan[top].position;
  const double before = scan[top].position - scan[top - 1].position,
               after = scan[top + 1].position - scan[top].position;
  const double fall_before = (scan[top].value - scan[top - 1].value) / before;
  const double fall_after = (scan[top].value - scan[top + 1].value) / after;
  const double sum = fall_before + fall_after;
  return sum != 0.0 ? scan[top].position + 0.5 * (fall_before * after - fall_after * before) / sum : scan[top].position;
}

Advice Exhaustive(const Setup& setup, Points points) {
  const double step = BlurPixel(setup);
  const auto grid = Grid(setup, setup.lowest, setup.highest, step);
  const Points taken = points.subspan(1);
  if (taken.size() < grid.size()) return GoAndLook{grid[taken.size()]};
  return Claim(setup, Sharpest(taken).position, step);
}

Advice CoarseFine(const Setup& setup, Points points) {
  const double fine = BlurPixel(setup);
  const double coarse = kCoarseStepPx * fine;
  const auto first = Grid(setup, setup.lowest, setup.highest, coarse);
  const Points taken = points.subspan(1);
  if (taken.size() < first.size()) return GoAndLook{first[taken.size()]};
  const double top = Sharpest(taken.first(first.size())).position;
  const auto second = Grid(setup, Inside(setup, top - coarse), Inside(setup, top + coarse), fine);
  const Points around = taken.subspan(first.size());
  if (around.size() < second.size()) return GoAndLook{second[around.size()]};
  return Claim(setup, Sharpest(around).position, fine);
}

/// An interval search: `part(k)` is where, as a part of the interval, the k-th step puts its upper inner point; the
/// lower one mirrors it. One of the two is always a point that was looked at before.
template <class Part>
Advice Interval(const Setup& setup, Points points, int steps, const Part& part) {
  double low = setup.lowest, high = setup.highest;
  const Points taken = points.subspan(1);
  double lower = high - part(0) * (high - low), upper = low + part(0) * (high - low);
  if (taken.size() < 2) return GoAndLook{taken.empty() ? lower : upper};
  double at_lower = taken[0].value, at_upper = taken[1].value;
  for (int k = 1; k < steps; ++k) {
    const bool keep_upper = at_upper > at_lower;
    (keep_upper ? low : high) = keep_upper ? lower : upper;
    const double inner = keep_upper ? low + part(k) * (high - low) : high - part(k) * (high - low);
    const auto index = static_cast<std::size_t>(k) + 1;
    if (index >= taken.size()) return GoAndLook{Inside(setup, inner)};
    if (keep_upper) {
      lower = upper;
      at_lower = at_upper;
      upper = inner;
      at_upper = taken[index].value;
    } else {
      upper = lower;
      at_upper = at_lower;
      lower = inner;
      at_lower = taken[index].value;
    }
  }
  return Claim(setup, at_upper > at_lower ? upper : lower, high - low);
}

Advice GoldenSection(const Setup& setup, Points points) {
  const double ratio = 1.0 / std::numbers::phi;
  const double intervals = (setup.highest - setup.lowest) / BlurPixel(setup);
  const int steps = std::max(2, static_cast<int>(std::ceil(std::log(intervals) / std::log(std::numbers::phi))));
  return Interval(setup, points, steps, [ratio](int) { return ratio; });
}

Advice Fibonacci(const Setup& setup, Points points) {
  std::vector<double> numbers = {1.0, 1.0};
  while (numbers.back() * BlurPixel(setup) < setup.highest - setup.lowest || numbers.size() < 5) {
    numbers.push_back(numbers.back() + numbers[numbers.size() - 2]);
  }
  // The last step would put both points at one place.
  const int steps = static_cast<int>(numbers.size()) - 2;
  return Interval(setup, points, steps, [&numbers](int k) {
    const std::size_t n = numbers.size() - 1 - static_cast<std::size_t>(k);
    return numbers[n - 1] / numbers[n];
  });
}

/// Up the hill from where the lens stands; past the top the step is divided by four and turned round.
Advice HillClimb(const Setup& setup, Points points) {
  const double finest = BlurPixel(setup);
  double step = (setup.ascending ? kClimbPx : -kClimbPx) * finest;
  SearchPoint best = points.front();
  bool climbed = false, turned = false;
  double next = Inside(setup, best.position + step);
  for (const SearchPoint& point : points.subspan(1)) {
    if (point.value > best.value) {
      best = point;
      climbed = true;
    } else if (!climbed && !turned) {
      step = -step;  // the first step went downhill
      turned = true;
    } else {
      step = -step / 4.0;
      climbed = turned = false;
    }
    if (std::abs(step) < finest) return Claim(setup, best.position, finest);
    next = Inside(setup, best.position + step);
    if (next == best.position) {  // at the end of the range: only the other way is left
      step = -step / 4.0;
      if (std::abs(step) < finest) return Claim(setup, best.position, finest);
      next = Inside(setup, best.position + step);
    }
  }
  return GoAndLook{next};
}

/// After the contrast scan of libcamera's Raspberry Pi algorithm (without its phase detection): up from the lowest
/// position in coarse steps until contrast falls to 0.75 of the most seen or the range ends; from two fine steps beyond
/// the top down in fine steps until it falls so again or five points are there; then the vertex of a parabola through
/// the top and its neighbours. It wants the contrast there, and the least seen, on the proper sides of 0.75 of the
/// most. Its steps of 1 and 0.25 dioptres are 9 and 2.2 px of blur of the camera it was made for (f = 4.74 mm,
/// f/1.8, 1.4 um pixels). The original waits four frames at each point for lens and statistics to settle, where ours
/// knows.
Advice ContrastScan(const Setup& setup, Points points) {
  constexpr double kFinePx = 2.25, kRatio = 0.75;
  constexpr std::size_t kMostFine = 5;
  const double coarse = kScanPx * BlurPixel(setup), fine = kFinePx * BlurPixel(setup);
  std::vector<SearchPoint> scan;  // of the pass under way
  bool up = true;
  double next = setup.lowest, most = 0.0, least = std::numeric_limits<double>::infinity();
  for (const SearchPoint& point : points.subspan(1)) {
    scan.push_back(point);
    most = std::max(most, point.value);
    least = std::min(least, point.value);
    const bool fallen = point.value < kRatio * most;
    if (up && !fallen && point.position < setup.highest) {
      next = Inside(setup, point.position + coarse);
    } else if (!up && !fallen && point.position > setup.lowest && scan.size() < kMostFine) {
      next = Inside(setup, point.position - fine);
    } else {
      const double at_most = VertexOf(scan);
      if (!up) {
        if (least > kRatio * most) return Refuse({Cause::NoTexture, "contrast changes too little over the scan"});
        return Claim(setup, at_most, fine);
      }
      up = false;
      next = std::min(point.position, Inside(setup, at_most + 2.0 * fine));
      scan.clear();
    }
  }
  return GoAndLook{next};
}

/// One pass, then the vertex of a parabola through `shape` of the five points around the sharpest.
template <class Shape>
Advice FittedSweep(const Setup& setup, Points points, const Shape& shape) {
  const double step = kFittedStepPx * BlurPixel(setup);
  const auto grid = Grid(setup, setup.lowest, setup.highest, step);
  const Points taken = points.subspan(1);
  if (taken.size() < grid.size()) return GoAndLook{grid[taken.size()]};
  const SearchPoint& top = Sharpest(taken);
  std::vector<CurvePoint> around;
  for (const SearchPoint& point : taken) {
    if (std::abs(point.position - top.position) > 2.5 * step) continue;
    // FitPeak() fits the logarithm; equal weights.
    const double height = std::exp(shape(std::max(point.value / top.value, 1e-3)));
    around.push_back({point.position, height, height});
  }
  const auto fit = FitPeak(around);
  if (fit && std::abs(fit->position - top.position) <= step) return Claim(setup, fit->position, 0.2 * step);
  return Claim(setup, top.position, step);
}

Advice SweepParabola(const Setup& setup, Points points) {
  return FittedSweep(setup, points, [](double value) { return value; });
}

Advice SweepGaussian(const Setup& setup, Points points) {
  return FittedSweep(setup, points, [](double value) { return std::log(value); });
}

/// The size of a blurred detail is a hyperbola over position, so one over the energy is a parabola.
Advice SweepHyperbola(const Setup& setup, Points points) {
  return FittedSweep(setup, points, [](double value) { return -1.0 / value; });
}

constexpr std::array kSearches = {
    Search{"exhaustive", Exhaustive, 1.0},
    Search{"coarse-fine", CoarseFine, kCoarseStepPx},
    Search{"golden-section", GoldenSection, 0.0},
    Search{"fibonacci", Fibonacci, 0.0},
    Search{"hill-climb", HillClimb, kClimbPx},
    Search{"sweep-parabola", SweepParabola, kFittedStepPx},
    Search{"sweep-gaussian", SweepGaussian, kFittedStepPx},
    Search{"sweep-hyperbola", SweepHyperbola, kFittedStepPx},
    Search{"contrast-scan", ContrastScan, kScanPx},
};

class SearchMethod final : public Method {
 public:
  SearchMethod(const Search& search, const Setup& setup) : strategy_(search.strategy), setup_(setup) {
    if (setup.step && search.first_step > 0) setup_.blur_px = *setup.step / search.first_step;
  }

  Advice Next(const Look& look) override {
    const double light = std::max(look.score.mean * look.score.mean, 1e-12);
    points_.push_back({look.position, look.score.gradient_energy / light});
    return strategy_(setup_, points_);
  }
  int FramesExpected() const override { return static_cast<int>(points_.size()) + 1; }

 private:
  Strategy strategy_;
  Setup setup_;
  std::vector<SearchPoint> points_;
};

}  // namespace

std::span<const Search> Searches() {
  return kSearches;
}

std::unique_ptr<Method> MakeSearch(const Search& search, const Setup& setup) {
  return std::make_unique<SearchMethod>(search, setup);
}

}  // namespace lensd::autofocus
