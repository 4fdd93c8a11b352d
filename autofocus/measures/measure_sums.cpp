// The sums behind the focus measures, a vector of pixels at a time. Integers throughout, so that every instruction set
// finds the same sums.
//
// Rows are taken in blocks of eight, which a vector of columns walks down keeping the rows' slopes in registers: each
// row is widened once, and ten streams of memory run in step. How wide a lane has to be, and how long squares may be
// added before they are moved to 64 bits, depends on the samples:
//   Eight    8-bit samples in lanes of 16 bits; squares are added in 32 bits over 32 steps down a block
//   Twelve   16-bit samples that are all below 4096, lanes alike; squares are moved to 64 bits every fourth row
//   Sixteen  any 16-bit samples in lanes of 32 bits; squares are 64 bits wide from the start
#include <cstddef>
#include <cstdint>

#include "autofocus/measures/measure_scalar.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autofocus/measures/measure_sums.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "autofocus/measures/measure_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lensd::autofocus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// A row's slope along x, and its smoothed values and second difference for the slopes along y.
template <class V>
struct RowSlopes {
  V slope;
  V smooth;
  V bend;
};

template <class Kind, scalar::Noise kNoise>
HWY_INLINE auto SlopesAt(const typename Kind::Sample* samples) {
  const auto left = Kind::Load(samples - 1);
  const auto right = Kind::Load(samples + 1);
  const auto twice = hn::ShiftLeft<1>(Kind::Load(samples));
  const auto sides = hn::Add(left, right);
  return RowSlopes<hn::Vec<typename Kind::D>>{hn::Sub(right, left), hn::Add(sides, twice),
                                              kNoise == scalar::Noise::Summed ? hn::Sub(sides, twice) : sides};
}

/// Whether inner columns fill a vector; narrower views are left to scalar sums.
template <class Kind>
HWY_INLINE bool FillsVectors(GreyView<typename Kind::Sample> view) {
  return view.width - 2 >= static_cast<int>(hn::Lanes(typename Kind::D()));
}

/// Calls `step(x, keep)` for vectors that together cover `count` columns from `first` on, at least a vector of them.
/// The last one may overlap the one before: `keep` clears the lanes that were counted.
template <class D, class Step>
HWY_INLINE void ForColumns(D d, int first, int count, const Step& step) {
  using V = hn::Vec<D>;
  const int lanes = static_cast<int>(hn::Lanes(d));
  int x = first;
  for (; x + lanes <= first + count; x += lanes) step(x, [](V v) HWY_ATTR { return v; });
  const int left = first + count - x;
  if (left == 0) return;
  const auto mask = hn::Gt(hn::Iota(d, 0), hn::Set(d, static_cast<hn::TFromD<D>>(lanes - left - 1)));
  step(first + count - lanes, [mask](V v) HWY_ATTR { return hn::IfThenElseZero(mask, v); });
}

template <class Kind, scalar::Noise kNoise>
HWY_INLINE FocusSums SumSlopes(GreyView<typename Kind::Sample> view) {
  if (!FillsVectors<Kind>(view)) return scalar::SlopesOf(view, kNoise);
  const typename Kind::D d;
  FocusSums sums;
  typename Kind::Squares along_x;
  typename Kind::Squares along_y;
  typename Kind::Values bends;
  const auto fold = [&]() HWY_ATTR {
    along_x.Fold();
    along_y.Fold();
    sums.noise += static_cast<std::uint64_t>(bends.Take());
  };
  for (int top = 1; top + 1 < view.height; top += kBlock) {
    const int rows = HWY_MIN(kBlock, view.height - 1 - top);
    int step = 0;
    ForColumns(d, 1, view.width - 2, [&](int x, const auto& keep) HWY_ATTR {
      const auto* at = view.samples + (top - 1) * view.stride + x;
      auto above = SlopesAt<Kind, kNoise>(at);
      auto here = SlopesAt<Kind, kNoise>(at += view.stride);
      auto noise = hn::Zero(d);
      for (int row = 0; row < rows; ++row) {
        const auto below = SlopesAt<Kind, kNoise>(at += view.stride);
        along_x.Add(keep(hn::Add(hn::Add(above.slope, below.slope), hn::ShiftLeft<1>(here.slope))));
        along_y.Add(keep(hn::Sub(below.smooth, above.smooth)));
        if constexpr (kNoise == scalar::Noise::Summed) {
          const auto bend = hn::Abs(hn::Sub(hn::Add(above.bend, below.bend), hn::ShiftLeft<1>(here.bend)));
          if constexpr (Kind::kRowsInLane == 1) bends.Add(keep(bend));
          noise = hn::Add(noise, bend);
        }
        if (row % Kind::kFoldRows == Kind::kFoldRows - 1) {
          along_x.FoldRows();
          along_y.FoldRows();
        }
        above = here;
        here = below;
      }
      along_x.FoldRows();
      along_y.FoldRows();
      if constexpr (kNoise == scalar::Noise::Summed && Kind::kRowsInLane != 1) bends.Add(keep(noise));
      if (++step % kSteps == 0) fold();
    });
    fold();
  }
  sums.gradient = along_x.total + along_y.total;
  return sums;
}

LaplacianSums ByteLaplacians(GreyView<std::uint8_t> view) {
  if (!FillsVectors<Eight>(view)) return scalar::LaplacianOf(view);
  const Eight::D d;
  LaplacianSums sums;
  Eight::Squares squares;
  Eight::Values values;
  const auto fold = [&]() HWY_ATTR {
    squares.Fold();
    sums.value += values.Take();
  };
  for (int top = 1; top + 1 < view.height; top += kBlock) {
    const int rows = HWY_MIN(kBlock, view.height - 1 - top);
    int step = 0;
    ForColumns(d, 1, view.width - 2, [&](int x, const auto& keep) HWY_ATTR {
      const auto* at = view.samples + top * view.stride + x;
      auto above = Eight::Load(at - view.stride);
      auto here = Eight::Load(at);
      auto value = hn::Zero(d);
      for (int row = 0; row < rows; ++row, at += view.stride) {
        const auto below = Eight::Load(at + view.stride);
        const auto sides = hn::Add(Eight::Load(at - 1), Eight::Load(at + 1));
        const auto laplacian = hn::Sub(hn::Add(hn::Add(above, below), sides), hn::ShiftLeft<2>(here));
        squares.Add(keep(laplacian));
        value = hn::Add(value, laplacian);
        above = here;
        here = below;
      }
      values.Add(keep(value));
      if (++step % kSteps == 0) fold();
    });
    fold();
  }
  sums.square = squares.total;
  return sums;
}

/// Pairs two apart in every row.
std::uint64_t BytePairs(GreyView<std::uint8_t> view) {
  if (!FillsVectors<Eight>(view)) return scalar::BrennerOf(view);
  const Eight::D d;
  Eight::Squares squares;
  int step = 0;
  for (int y = 0; y < view.height; ++y) {
    const auto* row = view.samples + y * view.stride;
    ForColumns(d, 0, view.width - 2, [&](int x, const auto& keep) HWY_ATTR {
      squares.Add(keep(hn::Sub(Eight::Load(row + x + 2), Eight::Load(row + x))));
      if (++step % Eight::kPairSteps == 0) squares.Fold();
    });
  }
  squares.Fold();
  return squares.total;
}

void AddByteLevels(const std::uint8_t* row, int width, std::uint8_t full_scale, FocusSums& sums) {
  const hn::ScalableTag<std::uint8_t> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto below_full = hn::Set(d, static_cast<std::uint8_t>(full_scale - 1));
  auto light = hn::Zero(Longs());
  int x = 0;
  for (; x + lanes <= width; x += lanes) {
    const auto v = hn::LoadU(d, row + x);
    light = hn::Add(light, hn::SumsOf8(v));
    sums.saturated += hn::CountTrue(d, hn::Ne(hn::SaturatedSub(v, below_full), hn::Zero(d)));
  }
  sums.light += static_cast<std::uint64_t>(TotalOf(Longs(), light));
  scalar::AddLevels(row + x, width - x, full_scale, sums);
}

template <class Kind, class Sample>
FocusSums SumSlopes(GreyView<Sample> view, scalar::Noise noise) {
  return noise == scalar::Noise::Summed ? SumSlopes<Kind, scalar::Noise::Summed>(view)
                                        : SumSlopes<Kind, scalar::Noise::LeftOut>(view);
}

FocusSums ByteSlopes(GreyView<std::uint8_t> view, scalar::Noise noise) {
  return SumSlopes<Eight>(view, noise);
}

#if HWY_TARGET == HWY_SCALAR
void AddWordLevels(const std::uint16_t* row, int width, std::uint16_t full_scale, FocusSums& sums) {
  scalar::AddLevels(row, width, full_scale, sums);
}
FocusSums WordSlopes(GreyView<std::uint16_t> view, scalar::Noise noise) {
  return scalar::SlopesOf(view, noise);
}
#else
void AddWordLevels(const std::uint16_t* row, int width, std::uint16_t full_scale, FocusSums& sums) {
  const hn::ScalableTag<std::uint16_t> d;
  const hn::ScalableTag<std::uint32_t> pairs;
  constexpr int kMost = 1 << 14;  // vectors whose 2 x 65,535 a lane fit 32 bits
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto full = hn::Set(d, full_scale);
  const auto low = hn::Set(pairs, 0xffffu);
  int x = 0;
  while (x + lanes <= width) {
    auto light = hn::Zero(pairs);
    for (int i = 0; i < kMost && x + lanes <= width; ++i, x += lanes) {
      const auto v = hn::LoadU(d, row + x);
      const auto both = hn::BitCast(pairs, v);
      light = hn::Add(light, hn::Add(hn::And(both, low), hn::ShiftRight<16>(both)));
      sums.saturated += hn::CountTrue(d, hn::Eq(hn::Max(v, full), v));
    }
    sums.light += static_cast<std::uint64_t>(TotalOf(pairs, light));
  }
  scalar::AddLevels(row + x, width - x, full_scale, sums);
}

/// Whether every sample is below 4096.
bool AllTwelve(GreyView<std::uint16_t> view) {
  const hn::ScalableTag<std::uint16_t> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  auto bits = hn::Zero(d);
  std::uint16_t rest = 0;
  for (int y = 0; y < view.height; ++y) {
    const std::uint16_t* row = view.samples + y * view.stride;
    int x = 0;
    for (; x + lanes <= view.width; x += lanes) bits = hn::Or(bits, hn::LoadU(d, row + x));
    for (; x < view.width; ++x) rest = static_cast<std::uint16_t>(rest | row[x]);
  }
  return rest < 4096 && hn::AllFalse(d, hn::Gt(bits, hn::Set(d, 4095)));
}

FocusSums WordSlopes(GreyView<std::uint16_t> view, scalar::Noise noise) {
  return AllTwelve(view) ? SumSlopes<Twelve>(view, noise) : SumSlopes<Sixteen>(view, noise);
}
#endif

}  // namespace lensd::autofocus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lensd::autofocus {
namespace {

HWY_EXPORT(ByteSlopes);
HWY_EXPORT(ByteLaplacians);
HWY_EXPORT(BytePairs);
HWY_EXPORT(AddByteLevels);
HWY_EXPORT(WordSlopes);
HWY_EXPORT(AddWordLevels);

}  // namespace

std::uint64_t SumGradient(GreyView<std::uint8_t> view) {
  return HWY_DYNAMIC_DISPATCH(ByteSlopes)(view, scalar::Noise::LeftOut).gradient;
}

std::uint64_t SumBrenner(GreyView<std::uint8_t> view) {
  return HWY_DYNAMIC_DISPATCH(BytePairs)(view);
}

LaplacianSums SumLaplacian(GreyView<std::uint8_t> view) {
  return HWY_DYNAMIC_DISPATCH(ByteLaplacians)(view);
}

FocusSums SumFocus(GreyView<std::uint8_t> view, std::uint8_t full_scale) {
  return scalar::ByBands(view, HWY_DYNAMIC_DISPATCH(ByteSlopes), [&](const std::uint8_t* row, FocusSums& sums) {
    HWY_DYNAMIC_DISPATCH(AddByteLevels)(row, view.width, full_scale, sums);
  });
}

FocusSums SumFocus(GreyView<std::uint16_t> view, std::uint16_t full_scale) {
  return scalar::ByBands(view, HWY_DYNAMIC_DISPATCH(WordSlopes), [&](const std::uint16_t* row, FocusSums& sums) {
    HWY_DYNAMIC_DISPATCH(AddWordLevels)(row, view.width, full_scale, sums);
  });
}

}  // namespace lensd::autofocus
#endif
