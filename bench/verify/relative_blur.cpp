// The picture is the small-aperture frame blurred by a disk, brighter by some gain. For a row of diameters the
// reference is blurred and fitted to the picture; the best diameter has the least misfit. A blurred reference also has
// less noise of its own, which would favour large disks: that share (known from the difference of two references) is
// subtracted. Between the steps of the row the misfit is a parabola in the *square* of the diameter, since the first
// effect of a small disk goes with its variance.
#include "bench/verify/relative_blur.h"

#include <kissfft/kiss_fftnd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>

namespace lensd::bench {
namespace {

constexpr double kStepPx = 0.25;
constexpr double kLargestDepthChange = 0.03;  // of the depth, within the surroundings

// One two-dimensional complex transform, not scaled. (The library's real one, kiss_fftndr_alloc, returns NULL in Debian
// 12's 131.1.0.)
std::vector<std::complex<float>> Transformed(const std::vector<std::complex<float>>& in, int width, int height,
                                             bool inverse) {
  const int dims[] = {height, width};
  const std::unique_ptr<kiss_fftnd_state, decltype(&std::free)> plan(
      kiss_fftnd_alloc(dims, 2, inverse ? 1 : 0, nullptr, nullptr), &std::free);
  std::vector<std::complex<float>> out(in.size());
  kiss_fftnd(plan.get(), reinterpret_cast<const kiss_fft_cpx*>(in.data()), reinterpret_cast<kiss_fft_cpx*>(out.data()));
  return out;
}

int Mirrored(int index, int size) {
  while (index < 0 || index >= size) index = index < 0 ? -index - 1 : 2 * size - 1 - index;
  return index;
}

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

// Sums for the straight-line fit picture = gain * reference + offset over one slice.
struct FitSums {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  void Add(double reference, double picture) {
    n += 1;
    x += reference;
    y += picture;
    xx += reference * reference;
    xy += reference * picture;
    yy += picture * picture;
  }
  double Gain() const { return (xy - x * y / n) / (xx - x * x / n); }
  double Misfit() const {
    const double vxy = xy - x * y / n;
    return yy - y * y / n - vxy * vxy / (xx - x * x / n);
  }
};

struct SliceFits {
  std::vector<double> misfit;  // a diameter each, the reference's noise taken out
  std::vector<double> gain;
  std::vector<double> raw;
};

// The least misfit's diameter, by a parabola in d^2 through the best step and its neighbours.
void Locate(const SliceFits& fits, SliceBlur& found) {
  const auto best =
      static_cast<std::size_t>(std::min_element(fits.misfit.begin(), fits.misfit.end()) - fits.misfit.begin());
  const std::size_t middle = std::clamp<std::size_t>(best, 1, fits.misfit.size() - 2);
  const auto square = [](std::size_t step) { return std::pow(static_cast<double>(step) * kStepPx, 2); };
  const double q0 = square(middle - 1), q1 = square(middle), q2 = square(middle + 1);
  const double s01 = (fits.misfit[middle] - fits.misfit[middle - 1]) / (q1 - q0);
  const double s12 = (fits.misfit[middle + 1] - fits.misfit[middle]) / (q2 - q1);
  const double curvature = (s12 - s01) / (q2 - q0);  // half the second derivative
  double q = q1;
  if (curvature > 0) q = std::clamp(0.5 * (q0 + q1) - s01 / (2 * curvature), 0.0, square(fits.misfit.size() - 1));
  found.diameter_px = std::sqrt(q);
  found.gain = fits.gain[best];
  const double variance = fits.raw[best] / static_cast<double>(found.pixels - 3);
  const double sigma_q = curvature > 0 ? std::sqrt(variance / curvature) : q2 - q0;
  found.sigma_px = std::sqrt(q + sigma_q) - found.diameter_px;
}

}  // namespace

DiskBlur::DiskBlur(const Plane& plane, int margin_px)
    : width_(plane.width),
      height_(plane.height),
      margin_(margin_px),
      padded_width_(kiss_fft_next_fast_size(plane.width + 2 * margin_px)),
      padded_height_(kiss_fft_next_fast_size(plane.height + 2 * margin_px)) {
  std::vector<std::complex<float>> padded(static_cast<std::size_t>(padded_width_) * padded_height_);
  for (int y = 0; y < padded_height_; ++y) {
    const std::size_t from = static_cast<std::size_t>(Mirrored(y - margin_, height_)) * width_;
    for (int x = 0; x < padded_width_; ++x) {
      padded[static_cast<std::size_t>(y) * padded_width_ + x] = plane.values[from + Mirrored(x - margin_, width_)];
    }
  }
  spectrum_ = Transformed(padded, padded_width_, padded_height_, false);
}

std::vector<float> DiskBlur::Transfer(double diameter_px) const {
  std::vector<float> transfer(spectrum_.size());
  const auto frequency = [](int index, int size) {
    return (index <= size / 2 ? index : index - size) / static_cast<double>(size);
  };
  for (int y = 0; y < padded_height_; ++y) {
    for (int x = 0; x < padded_width_; ++x) {
      const double argument =
          std::numbers::pi * diameter_px * std::hypot(frequency(x, padded_width_), frequency(y, padded_height_));
      transfer[static_cast<std::size_t>(y) * padded_width_ + x] =
          static_cast<float>(argument < 1e-6 ? 1.0 : 2 * ::j1(argument) / argument);
    }
  }
  return transfer;
}

Plane DiskBlur::Blurred(double diameter_px) const {
  const std::vector<float> transfer = Transfer(diameter_px);
  std::vector<std::complex<float>> product(spectrum_.size());
  const float scale = 1.0f / static_cast<float>(product.size());
  for (std::size_t i = 0; i < product.size(); ++i) product[i] = spectrum_[i] * (transfer[i] * scale);
  const auto padded = Transformed(product, padded_width_, padded_height_, true);
  Plane out{width_, height_, std::vector<float>(static_cast<std::size_t>(width_) * height_)};
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      out.values[static_cast<std::size_t>(y) * width_ + x] =
          padded[static_cast<std::size_t>(y + margin_) * padded_width_ + x + margin_].real();
    }
  }
  return out;
}

double DiskBlur::NoiseGain(double diameter_px) const {
  double sum = 0;
  for (const float value : Transfer(diameter_px)) sum += static_cast<double>(value) * value;
  return sum / static_cast<double>(spectrum_.size());
}

Result<std::vector<SliceBlur>> BlurBetween(const FramesToCompare& frames, const std::vector<float>& depth_m,
                                           std::span<const double> edges_m, double largest_px) {
  const Plane& a = frames.reference_a;
  const std::size_t size = static_cast<std::size_t>(a.width) * a.height;
  for (const Plane* plane : {&a, &frames.reference_b, &frames.picture}) {
    if (plane->width != a.width || plane->height != a.height || plane->values.size() != size || size == 0) {
      return Fail(Code::InvalidArgument, "the frames to compare must be of one size");
    }
  }
  if (depth_m.size() != size) return Fail(Code::InvalidArgument, "the depth map must have the frames' size");
  if (edges_m.size() < 2 || !std::is_sorted(edges_m.begin(), edges_m.end()) || largest_px < 2 * kStepPx) {
    return Fail(Code::InvalidArgument,
                "slices need two or more rising depths and a largest diameter of 0.5 px or more");
  }

  // Half the largest disk bleeds in from the surroundings.
  const int surroundings = static_cast<int>(std::ceil(largest_px / 2));
  const std::vector<int> slice = SliceOfPixel(depth_m, a.width, a.height, edges_m, surroundings);
  const std::size_t slices = edges_m.size() - 1;
  std::vector<SliceBlur> found(slices);
  std::vector<double> noise(slices, 0.0);  // variance of the averaged reference
  Plane reference{a.width, a.height, std::vector<float>(size)};
  for (std::size_t i = 0; i < size; ++i) {
    reference.values[i] = 0.5f * (a.values[i] + frames.reference_b.values[i]);
    if (slice[i] < 0) continue;
    const double difference = a.values[i] - frames.reference_b.values[i];
    noise[slice[i]] += difference * difference / 4;
    ++found[slice[i]].pixels;
  }

  const DiskBlur blur(reference, 2 * surroundings);
  const int steps = static_cast<int>(std::ceil(largest_px / kStepPx)) + 1;
  std::vector<SliceFits> fits(slices);
  for (int step = 0; step < steps; ++step) {
    const double diameter = step * kStepPx;
    const Plane blurred = blur.Blurred(diameter);
    const double noise_gain = blur.NoiseGain(diameter);
    std::vector<FitSums> sums(slices);
    for (std::size_t i = 0; i < size; ++i) {
      if (slice[i] >= 0) sums[slice[i]].Add(blurred.values[i], frames.picture.values[i]);
    }
    for (std::size_t s = 0; s < slices; ++s) {
      const double gain = sums[s].Gain();
      fits[s].gain.push_back(gain);
      fits[s].raw.push_back(sums[s].Misfit());
      fits[s].misfit.push_back(sums[s].Misfit() - gain * gain * noise_gain * noise[s]);
    }
  }
  for (std::size_t s = 0; s < slices; ++s) {
    found[s].near_m = edges_m[s];
    found[s].far_m = edges_m[s + 1];
    if (found[s].pixels >= kFewestPixels) Locate(fits[s], found[s]);
  }
  return found;
}

}  // namespace lensd::bench
