// The sums behind the focus measures of 8-bit pictures, a vector of pixels at a time. Integers throughout, so that
// every instruction set finds the same sums.
//
// Rows are taken in blocks of eight, which a vector of columns walks down keeping the rows' slopes in registers: each
// row is widened once, and ten streams of memory run in step. Squares are summed in 32 bits, two to a lane, and emptied
// into 64 bits before they can overflow: a Sobel slope is at most 1020, so a step down a block adds at most 16 x 2 x
// 1020^2.
#include <cstddef>
#include <cstdint>

#include "measure_scalar.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "measure_sums.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lensd::autofocus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Words = hn::ScalableTag<std::int16_t>;
using Sums = hn::ScalableTag<std::int32_t>;
using Bytes = hn::Rebind<std::uint8_t, Words>;
using WordVec = hn::Vec<Words>;
using SumVec = hn::Vec<Sums>;
using View = GreyView<std::uint8_t>;

constexpr int kBlock = 8;   // rows
constexpr int kSteps = 32;  // down a block between emptyings: 32 x 8 x 2 x 1020^2 < 2^31

HWY_INLINE WordVec Load(const std::uint8_t* samples) {
  return hn::PromoteTo(Words(), hn::LoadU(Bytes(), samples));
}

HWY_INLINE void AddSquares(WordVec v, SumVec& even, SumVec& odd) {
  even = hn::ReorderWidenMulAccumulate(Sums(), v, v, even, odd);
}

HWY_INLINE void AddValues(WordVec v, SumVec& even, SumVec& odd) {
  even = hn::ReorderWidenMulAccumulate(Sums(), v, hn::Set(Words(), 1), even, odd);
}

HWY_INLINE std::int64_t Empty(SumVec& sum) {
  HWY_ALIGN std::int32_t lanes[HWY_MAX_BYTES / sizeof(std::int32_t)];
  hn::Store(sum, Sums(), lanes);
  sum = hn::Zero(Sums());
  std::int64_t total = 0;
  for (std::size_t i = 0; i < hn::Lanes(Sums()); ++i) total += lanes[i];
  return total;
}

/// A row's slope along x, and its smoothed values and second difference for the slopes along y.
struct RowSlopes {
  WordVec slope;
  WordVec smooth;
  WordVec bend;
};

template <bool kNoise>
HWY_INLINE RowSlopes SlopesAt(const std::uint8_t* samples) {
  const WordVec left = Load(samples - 1);
  const WordVec right = Load(samples + 1);
  const WordVec twice = hn::ShiftLeft<1>(Load(samples));
  const WordVec sides = hn::Add(left, right);
  return {hn::Sub(right, left), hn::Add(sides, twice), kNoise ? hn::Sub(sides, twice) : sides};
}

/// Inner columns that vectors cover: all of them, or none where a vector is wider.
int WholeColumns(View view) {
  const int inner = view.width - 2;
  return inner >= static_cast<int>(hn::Lanes(Words())) ? inner : 0;
}

/// Calls `step(x, keep)` for vectors that together cover `count` columns from `first` on, at least a vector of them.
/// The last one may overlap the one before: `keep` clears the lanes that were counted.
template <class Step>
HWY_INLINE void ForColumns(int first, int count, const Step& step) {
  const int lanes = static_cast<int>(hn::Lanes(Words()));
  if (count < lanes) return;
  int x = first;
  for (; x + lanes <= first + count; x += lanes) step(x, [](WordVec v) HWY_ATTR { return v; });
  const int left = first + count - x;
  if (left == 0) return;
  const auto mask = hn::Gt(hn::Iota(Words(), 0), hn::Set(Words(), static_cast<std::int16_t>(lanes - left - 1)));
  step(first + count - lanes, [mask](WordVec v) HWY_ATTR { return hn::IfThenElseZero(mask, v); });
}

template <bool kNoise>
HWY_INLINE FocusSums SumSlopes(View view) {
  FocusSums sums;
  SumVec along_x[2] = {hn::Zero(Sums()), hn::Zero(Sums())};
  SumVec along_y[2] = {hn::Zero(Sums()), hn::Zero(Sums())};
  SumVec bends[2] = {hn::Zero(Sums()), hn::Zero(Sums())};
  const auto empty = [&] {
    for (SumVec& sum : along_x) sums.gradient += static_cast<std::uint64_t>(Empty(sum));
    for (SumVec& sum : along_y) sums.gradient += static_cast<std::uint64_t>(Empty(sum));
    for (SumVec& sum : bends) sums.noise += static_cast<std::uint64_t>(Empty(sum));
  };
  for (int top = 1; top + 1 < view.height; top += kBlock) {
    const int rows = HWY_MIN(kBlock, view.height - 1 - top);
    int step = 0;
    ForColumns(1, view.width - 2, [&](int x, const auto& keep) HWY_ATTR {
      const std::uint8_t* at = view.samples + (top - 1) * view.stride + x;
      RowSlopes above = SlopesAt<kNoise>(at);
      RowSlopes here = SlopesAt<kNoise>(at += view.stride);
      WordVec noise = hn::Zero(Words());
      for (int row = 0; row < rows; ++row) {
        const RowSlopes below = SlopesAt<kNoise>(at += view.stride);
        const WordVec gx = hn::Add(hn::Add(above.slope, below.slope), hn::ShiftLeft<1>(here.slope));
        AddSquares(keep(gx), along_x[0], along_x[1]);
        AddSquares(keep(hn::Sub(below.smooth, above.smooth)), along_y[0], along_y[1]);
        if constexpr (kNoise) {
          const WordVec bend = hn::Sub(hn::Add(above.bend, below.bend), hn::ShiftLeft<1>(here.bend));
          noise = hn::Add(noise, hn::Abs(bend));
        }
        above = here;
        here = below;
      }
      if constexpr (kNoise) AddValues(keep(noise), bends[0], bends[1]);
      if (++step % kSteps == 0) empty();
    });
    empty();
  }
  return sums;
}

FocusSums SumSlopesAndNoise(View view) {
  return SumSlopes<true>(view);
}

std::uint64_t SumSlopesAlone(View view) {
  return SumSlopes<false>(view).gradient;
}

LaplacianSums SumLaplacians(View view) {
  LaplacianSums sums;
  SumVec squares[2] = {hn::Zero(Sums()), hn::Zero(Sums())};
  SumVec values[2] = {hn::Zero(Sums()), hn::Zero(Sums())};
  const auto empty = [&] {
    for (SumVec& sum : squares) sums.square += static_cast<std::uint64_t>(Empty(sum));
    for (SumVec& sum : values) sums.value += Empty(sum);
  };
  for (int top = 1; top + 1 < view.height; top += kBlock) {
    const int rows = HWY_MIN(kBlock, view.height - 1 - top);
    int step = 0;
    ForColumns(1, view.width - 2, [&](int x, const auto& keep) HWY_ATTR {
      const std::uint8_t* at = view.samples + top * view.stride + x;
      WordVec above = Load(at - view.stride);
      WordVec here = Load(at);
      WordVec value = hn::Zero(Words());
      for (int row = 0; row < rows; ++row, at += view.stride) {
        const WordVec below = Load(at + view.stride);
        const WordVec sides = hn::Add(Load(at - 1), Load(at + 1));
        const WordVec laplacian = hn::Sub(hn::Add(hn::Add(above, below), sides), hn::ShiftLeft<2>(here));
        AddSquares(keep(laplacian), squares[0], squares[1]);
        value = hn::Add(value, laplacian);
        above = here;
        here = below;
      }
      AddValues(keep(value), values[0], values[1]);
      if (++step % kSteps == 0) empty();
    });
    empty();
  }
  return sums;
}

/// Pairs two apart in every row, as many columns as whole vectors hold.
std::uint64_t SumPairs(View view) {
  std::uint64_t total = 0;
  SumVec squares[2] = {hn::Zero(Sums()), hn::Zero(Sums())};
  const auto empty = [&] {
    for (SumVec& sum : squares) total += static_cast<std::uint64_t>(Empty(sum));
  };
  int step = 0;
  for (int y = 0; y < view.height; ++y) {
    const std::uint8_t* row = view.samples + y * view.stride;
    ForColumns(0, view.width - 2, [&](int x, const auto& keep) HWY_ATTR {
      AddSquares(keep(hn::Sub(Load(row + x + 2), Load(row + x))), squares[0], squares[1]);
      if (++step % 8192 == 0) empty();  // a step adds at most 2 x 255^2 to a lane: 2^31 holds 16,512
    });
  }
  empty();
  return total;
}

void AddRowLevels(const std::uint8_t* row, int width, std::uint8_t full_scale, FocusSums& sums) {
  const hn::ScalableTag<std::uint8_t> d;
  const hn::ScalableTag<std::uint64_t> d64;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto below_full = hn::Set(d, static_cast<std::uint8_t>(full_scale - 1));
  auto light = hn::Zero(d64);
  int x = 0;
  for (; x + lanes <= width; x += lanes) {
    const auto v = hn::LoadU(d, row + x);
    light = hn::Add(light, hn::SumsOf8(v));
    sums.saturated += hn::CountTrue(d, hn::Ne(hn::SaturatedSub(v, below_full), hn::Zero(d)));
  }
  HWY_ALIGN std::uint64_t parts[HWY_MAX_BYTES / sizeof(std::uint64_t)];
  hn::Store(light, d64, parts);
  for (std::size_t i = 0; i < hn::Lanes(d64); ++i) sums.light += parts[i];
  scalar::AddLevels(row + x, width - x, full_scale, sums);
}

}  // namespace lensd::autofocus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lensd::autofocus {
namespace {

HWY_EXPORT(WholeColumns);
HWY_EXPORT(SumSlopesAndNoise);
HWY_EXPORT(SumSlopesAlone);
HWY_EXPORT(SumLaplacians);
HWY_EXPORT(SumPairs);
HWY_EXPORT(AddRowLevels);

/// The part of a view right of its first `columns` columns.
GreyView<std::uint8_t> RestOf(GreyView<std::uint8_t> view, int columns) {
  return {view.samples + columns, view.width - columns, view.height, view.stride};
}

}  // namespace

std::uint64_t SumGradient(GreyView<std::uint8_t> view) {
  const int whole = HWY_DYNAMIC_DISPATCH(WholeColumns)(view);
  return HWY_DYNAMIC_DISPATCH(SumSlopesAlone)(view) + scalar::GradientOf(RestOf(view, whole));
}

std::uint64_t SumBrenner(GreyView<std::uint8_t> view) {
  const int whole = HWY_DYNAMIC_DISPATCH(WholeColumns)(view);
  return HWY_DYNAMIC_DISPATCH(SumPairs)(view) + scalar::BrennerOf(RestOf(view, whole));
}

LaplacianSums SumLaplacian(GreyView<std::uint8_t> view) {
  LaplacianSums sums = HWY_DYNAMIC_DISPATCH(SumLaplacians)(view);
  const LaplacianSums rest = scalar::LaplacianOf(RestOf(view, HWY_DYNAMIC_DISPATCH(WholeColumns)(view)));
  sums.value += rest.value;
  sums.square += rest.square;
  return sums;
}

FocusSums SumFocus(GreyView<std::uint8_t> view, std::uint8_t full_scale) {
  const int whole = HWY_DYNAMIC_DISPATCH(WholeColumns)(view);
  const auto slopes = [whole](GreyView<std::uint8_t> band, bool noise) {
    FocusSums sums = scalar::SlopesOf(RestOf(band, whole), noise);
    if (noise) {
      const FocusSums both = HWY_DYNAMIC_DISPATCH(SumSlopesAndNoise)(band);
      sums.gradient += both.gradient;
      sums.noise += both.noise;
    } else {
      sums.gradient += HWY_DYNAMIC_DISPATCH(SumSlopesAlone)(band);
    }
    return sums;
  };
  return scalar::ByBands(view, slopes, [&](const std::uint8_t* row, FocusSums& sums) {
    HWY_DYNAMIC_DISPATCH(AddRowLevels)(row, view.width, full_scale, sums);
  });
}

std::uint64_t SumGradient(GreyView<std::uint16_t> view) {
  return scalar::GradientOf(view);
}

std::uint64_t SumBrenner(GreyView<std::uint16_t> view) {
  return scalar::BrennerOf(view);
}

LaplacianSums SumLaplacian(GreyView<std::uint16_t> view) {
  return scalar::LaplacianOf(view);
}

FocusSums SumFocus(GreyView<std::uint16_t> view, std::uint16_t full_scale) {
  return scalar::ByBands(view, scalar::SlopesOf<std::uint16_t>, [&](const std::uint16_t* row, FocusSums& sums) {
    scalar::AddLevels(row, view.width, full_scale, sums);
  });
}

}  // namespace lensd::autofocus
#endif
