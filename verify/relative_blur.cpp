// The frame is cut into slices of depth. First the picture's displacement is found, by coarse structures and then
// together with the blur, since a reference laid beside the picture looks like one more blurred; then each slice's
// diameter.
#include "verify/relative_blur.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "likelihood.h"
#include "spectra.h"

namespace lensd::verify {
namespace {

constexpr double kLargestDepthChange = 0.03;  // of the depth, within the surroundings
constexpr int kFewestSteps = 8;
constexpr double kRegisteredPx = 0.002;
constexpr int kMostPasses = 5;
constexpr std::size_t kLevels = 32;  // bins of brightness

// Slice number of each usable pixel, -1 elsewhere.
std::vector<int> SliceOfPixel(const std::vector<float>& depth, int width, int height, std::span<const double> edges,
                              int surroundings) {
  std::vector<int> slice(depth.size(), -1);
  for (int y = surroundings; y < height - surroundings; ++y) {
    for (int x = surroundings; x < width - surroundings; ++x) {
      const std::size_t at = static_cast<std::size_t>(y) * width + x;
      const float here = depth[at];
      const auto above = std::upper_bound(edges.begin(), edges.end(), static_cast<double>(here));
      if (above == edges.begin() || above == edges.end()) continue;
      bool alike = true;
      for (int dy = -surroundings; dy <= surroundings && alike; ++dy) {
        const float* row = depth.data() + at + static_cast<std::ptrdiff_t>(dy) * width;
        for (int dx = -surroundings; dx <= surroundings; ++dx) {
          if (std::abs(row[dx] - here) > kLargestDepthChange * here) alike = false;
        }
      }
      if (alike) slice[at] = static_cast<int>(above - edges.begin()) - 1;
    }
  }
  return slice;
}

/// Noise of the mean of both references.
struct ReferenceNoise {
  std::vector<float> variance;  // at every pixel, levels^2
  double error = 0.0;           // relative standard error of the variances
};

/// A straight line over the level (photon noise rises with it, the rest does not) through what the differences say in
/// bins of equal size, each weighed by the line itself. Rounding that is the same in both frames does not show in their
/// difference: hence the floor, and where it is reached, an error of a half, since rounding is not white then.
ReferenceNoise NoiseOfMean(const FramesToCompare& frames, const Plane& mean) {
  std::vector<std::size_t> order(mean.values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return mean.values[i]; });
  std::vector<std::array<double, 3>> bins;  // pixels, level, variance
  double whole = 0;
  for (std::size_t bin = 0; bin < kLevels; ++bin) {
    const std::size_t begin = order.size() * bin / kLevels, end = order.size() * (bin + 1) / kLevels;
    double level = 0, variance = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const double difference = frames.reference_a.values[order[i]] - frames.reference_b.values[order[i]];
      level += mean.values[order[i]];
      variance += difference * difference / 4;
    }
    const auto count = static_cast<double>(end - begin);
    if (count > 0) bins.push_back({count, level / count, variance / count});
    whole += variance / static_cast<double>(order.size());
  }
  double slope = 0, at_zero = whole;
  for (int pass = 0; pass < 4; ++pass) {
    double n = 0, x = 0, xx = 0, y = 0, xy = 0;
    for (const auto& [count, level, variance] : bins) {
      const double weight = count / std::pow(std::max(at_zero + slope * level, kQuantisation), 2);
      n += weight;
      x += weight * level;
      xx += weight * level * level;
      y += weight * variance;
      xy += weight * level * variance;
    }
    const double spread = n * xx - x * x;
    slope = spread > 1e-9 * n * xx ? std::max((n * xy - x * y) / spread, 0.0) : 0.0;
    at_zero = (y - slope * x) / n;
  }
  ReferenceNoise noise;
  for (const float level : mean.values) {
    noise.variance.push_back(static_cast<float>(std::max(at_zero + slope * level, kQuantisation)));
  }
  const double rounding = std::min(kQuantisation / std::max(whole, 1e-12), 1.0);
  noise.error = std::hypot(std::sqrt(2 / static_cast<double>(order.size())), 0.5 * rounding * rounding * rounding);
  return noise;
}

/// Of each part, metres; 0 where it has no pixel. A pixel counts by the square of the slope beside it: so much of the
/// fit rests on it, and within a slice the blur changes with depth.
std::vector<double> MeanDepths(const DividedFrames& frames, const std::vector<float>& depth) {
  const auto width = static_cast<std::size_t>(frames.reference.width);
  const auto& level = frames.reference.values;
  std::vector<double> weight(frames.parts), sum(frames.parts);
  for (std::size_t i = width + 1; i < depth.size(); ++i) {
    const int part = frames.part[i];
    if (part < 0) continue;
    const double across = level[i] - level[i - 1], down = level[i] - level[i - width];
    const double here =
        across * across + down * down + 2 * frames.reference_variance[i];  // above 0 where nothing is seen
    weight[part] += here;
    sum[part] += here * depth[i];
  }
  for (std::size_t part = 0; part < sum.size(); ++part) {
    if (weight[part] > 0) sum[part] /= weight[part];
  }
  return sum;
}

/// Displacement by structures coarser than any disk smooths away.
Shift CoarseShift(const SpectraTaker& taker) {
  constexpr int kFirst = 2, kLast = 5;  // rings: periods of 13 px and more
  Shift shift;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    std::vector<PartModel> models;
    for (const Spectra& part : taker.Take(1, shift)) {
      PartModel& model = models.emplace_back();
      double cross = 0, power = 0;
      for (int ring = kFirst; ring <= kLast; ++ring) {
        cross += part.steps.front().cross[ring];
        power += part.steps.front().power[ring];
        model.weight[ring] = 1.0;
      }
      model.gain = power > 0 ? std::max(cross / power, 0.0) : 0.0;
    }
    const Displacement away = taker.DisplacementOf(models, shift);
    shift.x += std::clamp(away.shift.x, -1.0, 1.0);
    shift.y += std::clamp(away.shift.y, -1.0, 1.0);
    if (std::hypot(away.shift.x, away.shift.y) < 0.02) break;
  }
  return shift;
}

std::vector<DiameterFit> FitSlices(const SpectraTaker& taker) {
  Shift shift = CoarseShift(taker);
  for (int pass = 0;; ++pass) {
    std::vector<DiameterFit> fits;
    std::vector<PartModel> models;
    for (const Spectra& part : taker.Take(shift)) {
      fits.push_back(part.pixels < kFewestPixels ? DiameterFit{} : FitDiameter(part));
      models.push_back(fits.back().model);
    }
    bool registered = true;
    for (int step = 0; step < kMostPasses; ++step) {
      const Displacement away = taker.DisplacementOf(models, shift);
      const double enough = std::max(kRegisteredPx, 0.1 / std::sqrt(std::max(away.weight, 1e-9)));
      if (std::hypot(away.shift.x, away.shift.y) < enough) break;
      registered = false;
      shift.x += std::clamp(away.shift.x, -0.5, 0.5);
      shift.y += std::clamp(away.shift.y, -0.5, 0.5);
    }
    if (registered || pass == 2) return fits;
  }
}

Result<void> Check(const FramesToCompare& frames, const std::vector<float>& depth_m, std::span<const double> edges_m,
                   double largest_px) {
  const Plane& a = frames.reference_a;
  const std::size_t size = static_cast<std::size_t>(a.width) * a.height;
  for (const Plane* plane : {&a, &frames.reference_b, &frames.picture}) {
    if (plane->width != a.width || plane->height != a.height || plane->values.size() != size || size == 0) {
      return Fail(Code::InvalidArgument, "the frames to compare must be of one size");
    }
  }
  if (depth_m.size() != size) return Fail(Code::InvalidArgument, "the depth map must have the frames' size");
  if (edges_m.size() < 2 || !std::is_sorted(edges_m.begin(), edges_m.end()) || !(largest_px > 0)) {
    return Fail(Code::InvalidArgument, "slices need two or more rising depths and a largest diameter above 0");
  }
  if (!(frames.reference_opening >= 0 && frames.reference_opening < 1)) {
    return Fail(Code::InvalidArgument, "the references' aperture must be smaller than the picture's");
  }
  return {};
}

/// Frames, their depths and what is searched, made ready once.
struct Comparison {
  const FramesToCompare& frames;
  const std::vector<float>& depth_m;
  std::span<const double> edges_m;
  Plane reference;
  ReferenceNoise noise;
};

/// Diameters of up to `largest_px` in pixels whose surroundings as far as half of `reach_px` lie at about their depth.
std::vector<SliceBlur> FindBlur(const Comparison& given, double largest_px, double reach_px) {
  const auto& [frames, depth_m, edges_m, reference, noise] = given;
  const int width = reference.width, height = reference.height;
  std::vector<SliceBlur> found(edges_m.size() - 1);
  const int surroundings = static_cast<int>(std::ceil(reach_px / 2));
  DividedFrames divided{.picture = frames.picture,
                        .reference = reference,
                        .reference_variance = noise.variance,
                        .reference_variance_error = noise.error,
                        .reference_opening = frames.reference_opening,
                        .part = SliceOfPixel(depth_m, width, height, edges_m, surroundings),
                        .parts = static_cast<int>(found.size())};
  const std::vector<double> means = MeanDepths(divided, depth_m);
  const int steps = std::max(static_cast<int>(std::ceil(largest_px / kStepPx)) + 1, kFewestSteps);
  const SpectraTaker taker(std::move(divided), steps);
  const std::vector<DiameterFit> fits = FitSlices(taker);
  for (std::size_t i = 0; i < found.size(); ++i) {
    found[i].near_m = edges_m[i];
    found[i].far_m = edges_m[i + 1];
    found[i].mean_m = means[i];
    found[i].pixels = fits[i].pixels;
    if (found[i].pixels < kFewestPixels) continue;
    found[i].diameter_px = fits[i].model.diameter_px;
    found[i].low_px = fits[i].low_px;
    found[i].high_px = fits[i].high_px;
    found[i].open = fits[i].open;
    found[i].gain = fits[i].model.gain;
  }
  return found;
}

/// The greatest diameter that any slice may have; nothing where that of one is not known.
std::optional<double> GreatestOf(const std::vector<SliceBlur>& slices) {
  double greatest = 0;
  for (const SliceBlur& slice : slices) {
    if (slice.pixels < kFewestPixels || slice.open) return std::nullopt;
    greatest = std::max(greatest, slice.high_px);
  }
  return greatest;
}

}  // namespace

// What bleeds in from beside a pixel comes from as far as half a disk: of the largest disk that is searched at first,
// and of the largest found then, where that of every slice is known. So small disks do not cost a wide rim.
Result<std::vector<SliceBlur>> BlurBetween(const FramesToCompare& frames, const std::vector<float>& depth_m,
                                           std::span<const double> edges_m, double largest_px) {
  if (auto checked = Check(frames, depth_m, edges_m, largest_px); !checked) return PassOn(checked);
  const Plane& a = frames.reference_a;
  Plane reference{a.width, a.height, a.values};
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    reference.values[i] = 0.5f * (a.values[i] + frames.reference_b.values[i]);
  }
  ReferenceNoise noise = NoiseOfMean(frames, reference);
  const Comparison comparison{frames, depth_m, edges_m, std::move(reference), std::move(noise)};
  std::vector<SliceBlur> found = FindBlur(comparison, largest_px, largest_px);
  const std::optional<double> greatest = GreatestOf(found);
  constexpr double kRim = 2.0;  // px on both sides together: what a displacement by parts of a pixel mixes in
  if (greatest && std::ceil((*greatest + kRim) / 2) < std::ceil(largest_px / 2)) {
    return FindBlur(comparison, largest_px, *greatest + kRim);
  }
  return found;
}

}  // namespace lensd::verify
