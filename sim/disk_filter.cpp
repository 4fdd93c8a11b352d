#include "disk_filter.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "disk_filter.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// A lane is a pixel: every pixel's sum is formed in the order of the taps, whatever the number of lanes, and products
// are rounded before they are added. So all targets give the same bits.
HWY_BEFORE_NAMESPACE();
namespace lensd::sim::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Four vectors side by side share the reading of the taps.
template <class D, int kVectors, bool kRuns, bool kStream = false>
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
  for (int k = 0; k < kVectors; ++k) {
    if constexpr (kStream) {
      hn::Stream(sums[k], d, out + k * lanes);
    } else {
      hn::StoreU(sums[k], d, out + k * lanes);
    }
  }
}

/// `stream`: past the cache, which then need not read what is about to be overwritten.
template <bool kRuns>
void FilterRow(const float* first, std::ptrdiff_t stride, const std::vector<std::vector<DiskFilter::Tap>>& rows,
               float mean, int width, bool stream, float* out) {
  const hn::ScalableTag<float> wide;
  const hn::CappedTag<float, 1> single;
  const int lanes = static_cast<int>(hn::Lanes(wide));
  int x = 0;
  if (stream) {
    const auto aligned = [&](const float* at) {
      return reinterpret_cast<std::uintptr_t>(at) % (lanes * sizeof(float)) == 0;
    };
    for (; x < width && !aligned(out + x); ++x)
      FilterAt<decltype(single), 1, kRuns>(single, first + x, stride, rows, mean, out + x);
    for (; x + 4 * lanes <= width; x += 4 * lanes)
      FilterAt<decltype(wide), 4, kRuns, true>(wide, first + x, stride, rows, mean, out + x);
  }
  for (; x + 4 * lanes <= width; x += 4 * lanes)
    FilterAt<decltype(wide), 4, kRuns>(wide, first + x, stride, rows, mean, out + x);
  for (; x + lanes <= width; x += lanes)
    FilterAt<decltype(wide), 1, kRuns>(wide, first + x, stride, rows, mean, out + x);
  for (; x < width; ++x) FilterAt<decltype(single), 1, kRuns>(single, first + x, stride, rows, mean, out + x);
}

void FilterRowDirect(const float* first, std::ptrdiff_t stride, const std::vector<std::vector<DiskFilter::Tap>>& rows,
                     float mean, int width, bool stream, float* out) {
  FilterRow<false>(first, stride, rows, mean, width, stream, out);
}

void FilterRowRuns(const float* first, std::ptrdiff_t stride, const std::vector<std::vector<DiskFilter::Tap>>& rows,
                   float mean, int width, bool stream, float* out) {
  FilterRow<true>(first, stride, rows, mean, width, stream, out);
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

SummedRaster::SummedRaster(const Raster& cells, int first, int count) : cells_(cells) {
  // A rough mean serves: every sixteenth row.
  double total = 0.0;
  int rows = 0;
  for (int y = 0; y < cells.rect.height; y += 16, ++rows) {
    const float* row = cells.Row(cells.rect.y + y);
    total += static_cast<double>(std::accumulate(row, row + cells.rect.width, 0.0f));
  }
  mean_ = static_cast<float>(total / (static_cast<double>(rows) * cells.rect.width));
  SumRows(first, count);
}

void SummedRaster::SumRows(int first, int count) {
  first_ = first;
  const auto stride = static_cast<std::size_t>(cells_.rect.width) + 1;
  if (sums_.size() < stride * static_cast<std::size_t>(count)) sums_.resize(stride * static_cast<std::size_t>(count));
  for (int y = 0; y < count; y += 4) {
    const auto row = [&](int k) { return std::min(y + k, count - 1); };
    const auto from = [&](int k) { return cells_.Row(first + row(k)); };
    const auto to = [&](int k) { return sums_.data() + static_cast<std::size_t>(row(k)) * stride; };
    SumFourRows({from(0), from(1), from(2), from(3)}, mean_, cells_.rect.width, {to(0), to(1), to(2), to(3)});
  }
}

DiskFilter::DiskFilter(double diameter_px, Method method, const ApertureShape& shape) : method_(method) {
  if (method_ == Method::Auto) method_ = diameter_px <= kLargestDirect ? Method::Direct : Method::Runs;
  const DiskKernel kernel(diameter_px, shape);
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

void DiskFilter::BlurRows(const SummedRaster& source, int first, int count, Raster& out) const {
  const PixelRect from = source.cells().rect;
  constexpr std::size_t kBeyondCache = std::size_t{4} << 20;
  const bool stream = out.values.size() * sizeof(float) >= kBeyondCache;
  for (int y = first; y < first + count; ++y) {
    const std::ptrdiff_t left = out.rect.x - from.x;
    if (method_ == Method::Runs) {
      HWY_DYNAMIC_DISPATCH(FilterRowRuns)
      (source.Sums(y) + left, from.width + 1, rows_, source.mean(), out.rect.width, stream, out.Row(y));
    } else {
      HWY_DYNAMIC_DISPATCH(FilterRowDirect)
      (source.cells().Row(y) + left, from.width, rows_, 0.0f, out.rect.width, stream, out.Row(y));
    }
  }
  if (stream) hwy::FlushStream();
}

void DiskFilter::Blur(const SummedRaster& source, Raster& out) const {
  BlurRows(source, out.rect.y, out.rect.height, out);
}

void DiskFilter::Blur(const Raster& source, Raster& out) const {
  const int band = std::max(64, 2 * reach_);
  SummedRaster sums(source, source.rect.y, 0);
  const int bottom = out.rect.y + out.rect.height;
  for (int y = out.rect.y; y < bottom; y += band) {
    const int rows = std::min(band, bottom - y);
    if (method_ == Method::Runs) sums.SumRows(y - reach_, rows + 2 * reach_);
    BlurRows(sums, y, rows, out);
  }
}

}  // namespace lensd::sim
#endif
