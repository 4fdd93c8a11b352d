// Two ways to form the sums: tap by tap for small disks, and by running sums along rows for large ones. Compiled once
// for every instruction set.
#include "sim/render/disk_filter.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>

#ifndef LENSD_SIM_DISK_FILTER_PART
#define LENSD_SIM_DISK_FILTER_PART
namespace lensd::sim {
inline constexpr int kPart = 512;  // px of a row at a time, whose sums stay in the cache
}  // namespace lensd::sim
#endif

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/render/disk_filter.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// A lane is a pixel: every pixel's sum is formed in the order of the taps, whatever the number of lanes, and products
// are rounded before they are added. So all targets give the same bits.
HWY_BEFORE_NAMESPACE();
namespace lensd::sim::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE bool IsAligned(const float* at) {
  return reinterpret_cast<std::uintptr_t>(at) % (hn::Lanes(hn::ScalableTag<float>()) * sizeof(float)) == 0;
}

/// Where `kVectors` vectors lie that share the reading of the taps: side by side, or one below the other.
struct Steps {
  std::ptrdiff_t from;
  std::ptrdiff_t to;
};

template <class D, int kVectors, bool kRuns, bool kStream = false>
HWY_INLINE void FilterAt(D d, const float* here, std::ptrdiff_t stride,
                         const std::vector<std::vector<DiskFilter::Tap>>& rows, float mean, Steps steps,
                         float* HWY_RESTRICT out) {
  using V = hn::Vec<D>;
  V sums[kVectors];
  for (int k = 0; k < kVectors; ++k) sums[k] = hn::Set(d, mean);
  for (std::size_t dy = 0; dy < rows.size(); ++dy) {
    const float* above = here - static_cast<std::ptrdiff_t>(dy) * stride;
    const float* below = here + static_cast<std::ptrdiff_t>(dy) * stride;
    for (const DiskFilter::Tap& tap : rows[dy]) {
      const V weight = hn::Set(d, tap.weight);
      for (int k = 0; k < kVectors; ++k) {
        const std::ptrdiff_t right = k * steps.from + tap.dx + (kRuns ? 1 : 0);
        const std::ptrdiff_t left = k * steps.from - tap.dx;
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
      hn::Stream(sums[k], d, out + k * steps.to);
    } else {
      hn::StoreU(sums[k], d, out + k * steps.to);
    }
  }
}

using Rows = std::vector<std::vector<DiskFilter::Tap>>;

/// Cell by cell along a row. `stream`: past the cache, which then need not read what is about to be overwritten.
void FilterRowDirect(const float* first, std::ptrdiff_t stride, const Rows& rows, int width, bool stream, float* out) {
  const hn::ScalableTag<float> wide;
  const hn::CappedTag<float, 1> single;
  const int lanes = static_cast<int>(hn::Lanes(wide));
  const Steps side_by_side{lanes, lanes};
  int x = 0;
  if (stream) {
    for (; x < width && !IsAligned(out + x); ++x)
      FilterAt<decltype(single), 1, false>(single, first + x, stride, rows, 0.0f, {}, out + x);
    for (; x + 4 * lanes <= width; x += 4 * lanes)
      FilterAt<decltype(wide), 4, false, true>(wide, first + x, stride, rows, 0.0f, side_by_side, out + x);
  }
  for (; x + 4 * lanes <= width; x += 4 * lanes)
    FilterAt<decltype(wide), 4, false>(wide, first + x, stride, rows, 0.0f, side_by_side, out + x);
  for (; x + lanes <= width; x += lanes)
    FilterAt<decltype(wide), 1, false>(wide, first + x, stride, rows, 0.0f, {}, out + x);
  for (; x < width; ++x) FilterAt<decltype(single), 1, false>(single, first + x, stride, rows, 0.0f, {}, out + x);
}

/// A block of few columns, four rows at a time.
template <class D, bool kRuns>
HWY_INLINE void FilterColumn(D d, const float* first, std::ptrdiff_t stride, const Rows& rows, float mean, int height,
                             float* out, std::ptrdiff_t out_stride) {
  int y = 0;
  for (; y + 4 <= height; y += 4)
    FilterAt<D, 4, kRuns>(d, first + y * stride, stride, rows, mean, {stride, out_stride}, out + y * out_stride);
  for (; y < height; ++y) FilterAt<D, 1, kRuns>(d, first + y * stride, stride, rows, mean, {}, out + y * out_stride);
}

template <bool kRuns>
HWY_INLINE void FilterNarrow(const float* first, std::ptrdiff_t stride, const Rows& rows, float mean, PixelRect block,
                             float* out, std::ptrdiff_t out_stride) {
  const hn::ScalableTag<float> wide;
  const hn::CappedTag<float, 1> single;
  const int lanes = static_cast<int>(hn::Lanes(wide));
  int x = 0;
  for (; x + lanes <= block.width; x += lanes)
    FilterColumn<decltype(wide), kRuns>(wide, first + x, stride, rows, mean, block.height, out + x, out_stride);
  for (; x < block.width; ++x)
    FilterColumn<decltype(single), kRuns>(single, first + x, stride, rows, mean, block.height, out + x, out_stride);
}

void FilterNarrowDirect(const float* first, std::ptrdiff_t stride, const Rows& rows, float mean, PixelRect block,
                        float* out, std::ptrdiff_t out_stride) {
  FilterNarrow<false>(first, stride, rows, mean, block, out, out_stride);
}

void FilterNarrowRuns(const float* first, std::ptrdiff_t stride, const Rows& rows, float mean, PixelRect block,
                      float* out, std::ptrdiff_t out_stride) {
  FilterNarrow<true>(first, stride, rows, mean, block, out, out_stride);
}

/// Runs along a part of a row whose sums above and below have been added: `folded[dy]` at the part's first pixel.
template <class D, int kVectors, bool kStream = false>
HWY_INLINE void FilterFoldedAt(D d, const float* const* folded, int x, const Rows& rows, float mean,
                               float* HWY_RESTRICT out) {
  using V = hn::Vec<D>;
  const std::ptrdiff_t lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  V sums[kVectors];
  for (int k = 0; k < kVectors; ++k) sums[k] = hn::Set(d, mean);
  for (std::size_t dy = 0; dy < rows.size(); ++dy) {
    const float* here = folded[dy] + x;
    for (const DiskFilter::Tap& tap : rows[dy]) {
      const V weight = hn::Set(d, tap.weight);
      for (int k = 0; k < kVectors; ++k) {
        const V run = hn::Sub(hn::LoadU(d, here + k * lanes + tap.dx + 1), hn::LoadU(d, here + k * lanes - tap.dx));
        sums[k] = hn::Add(sums[k], hn::Mul(weight, run));
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

/// Adds `count` floats of two rows.
HWY_INLINE void AddRows(const float* a, const float* b, int count, float* HWY_RESTRICT sum) {
  const hn::ScalableTag<float> wide;
  const int lanes = static_cast<int>(hn::Lanes(wide));
  int x = 0;
  for (; x + lanes <= count; x += lanes)
    hn::StoreU(hn::Add(hn::LoadU(wide, a + x), hn::LoadU(wide, b + x)), wide, sum + x);
  for (; x < count; ++x) sum[x] = a[x] + b[x];
}

/// Runs along a whole row, part by part. Rows as far above as below have the same weights: their sums are added first,
/// which halves what the taps read. `scratch` holds kPart + 2 reach + 1 floats a row below the middle one.
void FilterRowRuns(const float* first, std::ptrdiff_t stride, const Rows& rows, float mean, int width, bool stream,
                   float* scratch, const float** folded, float* out) {
  const hn::ScalableTag<float> wide;
  const hn::CappedTag<float, 1> single;
  const int lanes = static_cast<int>(hn::Lanes(wide));
  const int reach = static_cast<int>(rows.size()) - 1;
  for (int from = 0; from < width; from += kPart) {
    const int count = HWY_MIN(kPart, width - from);
    const int needed = count + 2 * reach + 1;
    folded[0] = first + from;
    for (int dy = 1; dy <= reach; ++dy) {
      const float* left = first + from - reach;
      float* sums = scratch + (dy - 1) * (kPart + 2 * reach + 1);
      AddRows(left - dy * stride, left + dy * stride, needed, sums);
      folded[dy] = sums + reach;
    }
    float* to = out + from;
    int x = 0;
    if (stream) {
      for (; x < count && !IsAligned(to + x); ++x)
        FilterFoldedAt<decltype(single), 1>(single, folded, x, rows, mean, to + x);
      for (; x + 4 * lanes <= count; x += 4 * lanes)
        FilterFoldedAt<decltype(wide), 4, true>(wide, folded, x, rows, mean, to + x);
    }
    for (; x + 4 * lanes <= count; x += 4 * lanes)
      FilterFoldedAt<decltype(wide), 4>(wide, folded, x, rows, mean, to + x);
    for (; x + lanes <= count; x += lanes) FilterFoldedAt<decltype(wide), 1>(wide, folded, x, rows, mean, to + x);
    for (; x < count; ++x) FilterFoldedAt<decltype(single), 1>(single, folded, x, rows, mean, to + x);
  }
}

}  // namespace lensd::sim::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lensd::sim {
namespace {

HWY_EXPORT(FilterRowDirect);
HWY_EXPORT(FilterRowRuns);
HWY_EXPORT(FilterNarrowDirect);
HWY_EXPORT(FilterNarrowRuns);

constexpr int kNarrow = 64;  // px; the same on every instruction set, for the same sums

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

DiskFilter::Method DiskFilter::MethodFor(double diameter_px) {
  return diameter_px <= kLargestDirect ? Method::Direct : Method::Runs;
}

DiskFilter::DiskFilter(double diameter_px, Method method, const ApertureShape& shape)
    : DiskFilter(DiskKernel(diameter_px, shape), method == Method::Auto ? MethodFor(diameter_px) : method) {}

DiskFilter::DiskFilter(const DiskKernel& kernel, Method method) : reach_(kernel.reach), method_(method) {
  for (int dy = 0; dy <= reach_; ++dy) {
    std::vector<Tap> taps;
    for (int dx = 0; dx <= reach_; ++dx) {
      const double beyond = dx < reach_ ? kernel.At(dx + 1, dy) : 0.0;
      const double weight = method_ == Method::Direct ? kernel.At(dx, dy) : kernel.At(dx, dy) - beyond;
      if (weight != 0.0) taps.push_back({dx, static_cast<float>(weight)});
    }
    rows_.push_back(std::move(taps));
  }
  sum_ = static_cast<float>(std::accumulate(kernel.weights.begin(), kernel.weights.end(), 0.0));
}

void DiskFilter::BlurRows(const SummedRaster& source, int first, int count, Raster& out) const {
  const PixelRect from = source.cells().rect;
  const std::ptrdiff_t left = out.rect.x - from.x;
  const bool runs = method_ == Method::Runs;
  const float mean = source.mean() * sum_;
  const std::ptrdiff_t stride = from.width + (runs ? 1 : 0);
  const auto row = [&](int y) { return (runs ? source.Sums(y) : source.cells().Row(y)) + left; };
  if (out.rect.width < kNarrow) {
    const PixelRect block{out.rect.x, first, out.rect.width, count};
    if (runs) {
      HWY_DYNAMIC_DISPATCH(FilterNarrowRuns)
      (row(first), stride, rows_, mean, block, out.Row(first), out.rect.width);
    } else {
      HWY_DYNAMIC_DISPATCH(FilterNarrowDirect)(row(first), stride, rows_, 0.0f, block, out.Row(first), out.rect.width);
    }
    return;
  }
  constexpr std::size_t kBeyondCache = std::size_t{4} << 20;
  const bool stream = out.values.size() * sizeof(float) >= kBeyondCache;
  const auto reach = static_cast<std::size_t>(reach_);
  std::vector<float> scratch(runs ? reach * (kPart + 2 * reach + 1) : 0);
  std::vector<const float*> folded(reach + 1);
  for (int y = first; y < first + count; ++y) {
    if (runs) {
      HWY_DYNAMIC_DISPATCH(FilterRowRuns)
      (row(y), stride, rows_, mean, out.rect.width, stream, scratch.data(), folded.data(), out.Row(y));
    } else {
      HWY_DYNAMIC_DISPATCH(FilterRowDirect)(row(y), stride, rows_, out.rect.width, stream, out.Row(y));
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
