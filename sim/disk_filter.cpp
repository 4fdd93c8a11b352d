#include "disk_filter.h"

#include <algorithm>
#include <array>
#include <numeric>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "disk_filter.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// A lane is a pixel: every pixel's sum is formed in the order of the taps, whatever the number of lanes, and products
// are rounded before they are added. So all targets give the same bits.
HWY_BEFORE_NAMESPACE();
namespace lensd::sim::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Four vectors side by side share the reading of the taps.
template <class D, int kVectors, bool kRuns>
HWY_INLINE void FilterAt(D d, const float* here, std::ptrdiff_t stride,
                         const std::vector<std::vector<DiskFilter::Tap>>& rows, float mean, float* HWY_RESTRICT out) {
  using V = hn::Vec<D>;
  const std::ptrdiff_t lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  V sums[kVectors];
  for (int k = 0; k < kVectors; ++k) sums[k] = hn::Set(d, mean);
  for (std::size_t dy = 0; dy < rows.size(); ++dy) {
    const float* above = here - static_cast<std::ptrdiff_t>(dy) * stride;
    const float* below = here + static_cast<std::ptrdiff_t>(dy) * stride;
    for (const DiskFilter::Tap& tap : rows[dy]) {
      const V weight = hn::Set(d, tap.weight);
      for (int k = 0; k < kVectors; ++k) {
        const std::ptrdiff_t right = k * lanes + tap.dx + (kRuns ? 1 : 0);
        const std::ptrdiff_t left = k * lanes - tap.dx;
        V pair;
        if constexpr (kRuns) {
          pair = hn::Sub(hn::LoadU(d, above + right), hn::LoadU(d, above + left));
          if (dy > 0) pair = hn::Add(pair, hn::Sub(hn::LoadU(d, below + right), hn::LoadU(d, below + left)));
        } else {
          pair = hn::LoadU(d, above + right);
          if (tap.dx > 0) pair = hn::Add(pair, hn::LoadU(d, above + left));
          if (dy > 0) {
            V lower = hn::LoadU(d, below + right);
            if (tap.dx > 0) lower = hn::Add(lower, hn::LoadU(d, below + left));
            pair = hn::Add(pair, lower);
          }
        }
        sums[k] = hn::Add(sums[k], hn::Mul(weight, pair));
      }
    }
  }
  for (int k = 0; k < kVectors; ++k) hn::StoreU(sums[k], d, out + k * lanes);
}

template <bool kRuns>
void FilterRow(const float* first, std::ptrdiff_t stride, const std::vector<std::vector<DiskFilter::Tap>>& rows,
               float mean, int width, float* out) {
  const hn::ScalableTag<float> wide;
  const hn::CappedTag<float, 1> single;
  const int lanes = static_cast<int>(hn::Lanes(wide));
  int x = 0;
  for (; x + 4 * lanes <= width; x += 4 * lanes)
    FilterAt<decltype(wide), 4, kRuns>(wide, first + x, stride, rows, mean, out + x);
  for (; x + lanes <= width; x += lanes)
    FilterAt<decltype(wide), 1, kRuns>(wide, first + x, stride, rows, mean, out + x);
  for (; x < width; ++x) FilterAt<decltype(single), 1, kRuns>(single, first + x, stride, rows, mean, out + x);
}

void FilterRowDirect(const float* first, std::ptrdiff_t stride, const std::vector<std::vector<DiskFilter::Tap>>& rows,
                     float mean, int width, float* out) {
  FilterRow<false>(first, stride, rows, mean, width, out);
}

void FilterRowRuns(const float* first, std::ptrdiff_t stride, const std::vector<std::vector<DiskFilter::Tap>>& rows,
                   float mean, int width, float* out) {
  FilterRow<true>(first, stride, rows, mean, width, out);
}

}  // namespace lensd::sim::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lensd::sim {
namespace {

HWY_EXPORT(FilterRowDirect);
HWY_EXPORT(FilterRowRuns);

constexpr double kLargestDirect = 8.0;  // px; above, runs are as fast and the running sums exact enough

/// Each sum waits for the one before it; four rows do not wait for each other.
void SumFourRows(std::array<const float*, 4> from, float mean, int width, std::array<float*, 4> to) {
  const auto [a, b, c, d] = from;
  const auto [p, q, r, s] = to;
  double sum_a = 0.0;
  double sum_b = 0.0;
  double sum_c = 0.0;
  double sum_d = 0.0;
  *p = *q = *r = *s = 0.0f;
  for (int x = 0; x < width; ++x) {
    p[x + 1] = static_cast<float>(sum_a += static_cast<double>(a[x] - mean));
    q[x + 1] = static_cast<float>(sum_b += static_cast<double>(b[x] - mean));
    r[x + 1] = static_cast<float>(sum_c += static_cast<double>(c[x] - mean));
    s[x + 1] = static_cast<float>(sum_d += static_cast<double>(d[x] - mean));
  }
}

}  // namespace

SummedRaster::SummedRaster(Raster cells) : cells_(std::move(cells)) {
  const int width = cells_.rect.width;
  const int height = cells_.rect.height;
  // A rough mean serves: every fourth row.
  double total = 0.0;
  int rows = 0;
  for (int y = 0; y < height; y += 4, ++rows) {
    const float* row = cells_.Row(cells_.rect.y + y);
    total += static_cast<double>(std::accumulate(row, row + width, 0.0f));
  }
  mean_ = static_cast<float>(total / (static_cast<double>(rows) * width));
  const auto stride = static_cast<std::size_t>(width) + 1;
  sums_ = std::make_unique_for_overwrite<float[]>(stride * static_cast<std::size_t>(height));
  for (int y = 0; y < height; y += 4) {
    const int last = height - 1 - y;
    const auto from = [&](int k) { return cells_.Row(cells_.rect.y + y + std::min(k, last)); };
    const auto to = [&](int k) { return sums_.get() + static_cast<std::size_t>(y + std::min(k, last)) * stride; };
    SumFourRows({from(0), from(1), from(2), from(3)}, mean_, width, {to(0), to(1), to(2), to(3)});
  }
}

DiskFilter::DiskFilter(double diameter_px, Method method) : method_(method) {
  if (method_ == Method::Auto) method_ = diameter_px <= kLargestDirect ? Method::Direct : Method::Runs;
  const DiskKernel kernel(diameter_px);
  reach_ = kernel.reach;
  for (int dy = 0; dy <= reach_; ++dy) {
    std::vector<Tap> taps;
    for (int dx = 0; dx <= reach_; ++dx) {
      const double beyond = dx < reach_ ? kernel.At(dx + 1, dy) : 0.0;
      const double weight = method_ == Method::Direct ? kernel.At(dx, dy) : kernel.At(dx, dy) - beyond;
      if (weight != 0.0) taps.push_back({dx, static_cast<float>(weight)});
    }
    rows_.push_back(std::move(taps));
  }
}

void DiskFilter::Blur(const SummedRaster& source, Raster& out) const {
  const PixelRect from = source.cells().rect;
  const bool runs = method_ == Method::Runs;
  const std::ptrdiff_t stride = runs ? from.width + 1 : from.width;
  for (int y = out.rect.y; y < out.rect.y + out.rect.height; ++y) {
    const float* row = runs ? source.Sums(y) : source.cells().Row(y);
    const float* first = row + (out.rect.x - from.x);
    if (runs) {
      HWY_DYNAMIC_DISPATCH(FilterRowRuns)(first, stride, rows_, source.mean(), out.rect.width, out.Row(y));
    } else {
      HWY_DYNAMIC_DISPATCH(FilterRowDirect)(first, stride, rows_, 0.0f, out.rect.width, out.Row(y));
    }
  }
}

}  // namespace lensd::sim
#endif
