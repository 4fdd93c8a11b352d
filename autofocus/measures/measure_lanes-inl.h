// How samples lie in lanes and how long their sums may wait to be widened (measure_sums.cpp, once for each instruction
// set).
#if defined(LENSD_AUTOFOCUS_MEASURE_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LENSD_AUTOFOCUS_MEASURE_LANES_INL_H
#undef LENSD_AUTOFOCUS_MEASURE_LANES_INL_H
#else
#define LENSD_AUTOFOCUS_MEASURE_LANES_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace lensd::autofocus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Words = hn::ScalableTag<std::int16_t>;
using Ints = hn::ScalableTag<std::int32_t>;
using Longs = hn::ScalableTag<std::uint64_t>;

constexpr int kBlock = 8;   // rows
constexpr int kSteps = 32;  // down a block between foldings of what need not be folded sooner

template <class D>
HWY_INLINE std::int64_t TotalOf(D d, hn::Vec<D> sums) {
  HWY_ALIGN hn::TFromD<D> lanes[HWY_MAX_BYTES / sizeof(hn::TFromD<D>)];
  hn::Store(sums, d, lanes);
  std::int64_t total = 0;
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) total += static_cast<std::int64_t>(lanes[i]);
  return total;
}

/// Sums of 16-bit lanes, or of their squares, in 32 bits: two to a lane.
struct PairSums {
  hn::Vec<Ints> even;
  hn::Vec<Ints> odd;

  // Written out, as below: a constructor of the compiler's own making would be for no instruction set.
  HWY_INLINE PairSums() : even(hn::Zero(Ints())), odd(hn::Zero(Ints())) {}
  HWY_INLINE void Add(hn::Vec<Words> a, hn::Vec<Words> b) {
    even = hn::ReorderWidenMulAccumulate(Ints(), a, b, even, odd);
  }
  HWY_INLINE std::int64_t Take() {
    const std::int64_t total = TotalOf(Ints(), even) + TotalOf(Ints(), odd);
    even = odd = hn::Zero(Ints());
    return total;
  }
};

/// Sums of lanes that 32 steps leave within 32 bits.
struct WordValues {
  PairSums sums;
  HWY_INLINE WordValues() : sums() {}
  HWY_INLINE void Add(hn::Vec<Words> v) { sums.Add(v, hn::Set(Words(), 1)); }
  HWY_INLINE std::int64_t Take() { return sums.Take(); }
};

struct Eight {
  using Sample = std::uint8_t;
  using D = Words;
  using Values = WordValues;
  static constexpr int kRowsInLane = kBlock;  // values of so many rows may be added in a lane
  static constexpr int kFoldRows = kBlock;
  static constexpr int kPairSteps = 8192;  // a step adds at most 2 x 255^2: 2^31 holds 16,512

  static HWY_INLINE hn::Vec<D> Load(const Sample* samples) {
    return hn::PromoteTo(D(), hn::LoadU(hn::Rebind<Sample, D>(), samples));
  }
  /// A Sobel slope is at most 1020: a lane holds 32 x 8 x 2 x 1020^2 < 2^31.
  struct Squares {
    PairSums sums;
    std::uint64_t total;
    HWY_INLINE Squares() : sums(), total(0) {}
    HWY_INLINE void Add(hn::Vec<D> v) { sums.Add(v, v); }
    HWY_INLINE void FoldRows() {}
    HWY_INLINE void Fold() { total += static_cast<std::uint64_t>(sums.Take()); }
  };
};

#if HWY_TARGET != HWY_SCALAR
struct Twelve {
  using Sample = std::uint16_t;
  using D = Words;
  using Values = WordValues;
  static constexpr int kRowsInLane = 1;
  static constexpr int kFoldRows = 4;

  static HWY_INLINE hn::Vec<D> Load(const Sample* samples) {
    return hn::BitCast(D(), hn::LoadU(hn::RebindToUnsigned<D>(), samples));
  }
  /// A Sobel slope is at most 16,380: a lane holds 4 x 2 x 16,380^2 < 2^31.
  struct Squares {
    PairSums sums;
    hn::Vec<Longs> wide;
    std::uint64_t total;
    HWY_INLINE Squares() : sums(), wide(hn::Zero(Longs())), total(0) {}
    HWY_INLINE void Add(hn::Vec<D> v) { sums.Add(v, v); }
    HWY_INLINE void FoldRows() {
      const auto low = hn::Set(Longs(), 0xffffffffu);
      for (const hn::Vec<Ints>& part : {sums.even, sums.odd}) {
        const auto both = hn::BitCast(Longs(), part);
        wide = hn::Add(wide, hn::Add(hn::And(both, low), hn::ShiftRight<32>(both)));
      }
      sums = PairSums();
    }
    HWY_INLINE void Fold() {
      FoldRows();
      total += static_cast<std::uint64_t>(TotalOf(Longs(), wide));
      wide = hn::Zero(Longs());
    }
  };
};

struct Sixteen {
  using Sample = std::uint16_t;
  using D = Ints;
  static constexpr int kRowsInLane = kBlock;
  static constexpr int kFoldRows = kBlock;

  static HWY_INLINE hn::Vec<D> Load(const Sample* samples) {
    return hn::PromoteTo(D(), hn::LoadU(hn::Rebind<Sample, D>(), samples));
  }
  struct Values {
    hn::Vec<D> sums;
    HWY_INLINE Values() : sums(hn::Zero(D())) {}
    HWY_INLINE void Add(hn::Vec<D> v) { sums = hn::Add(sums, v); }
    HWY_INLINE std::int64_t Take() {
      const std::int64_t total = TotalOf(D(), sums);
      sums = hn::Zero(D());
      return total;
    }
  };
  struct Squares {
    hn::Vec<Longs> wide;
    std::uint64_t total;
    HWY_INLINE Squares() : wide(hn::Zero(Longs())), total(0) {}
    HWY_INLINE void Add(hn::Vec<D> v) {
      const hn::RebindToUnsigned<D> magnitudes;
      const auto even = hn::BitCast(magnitudes, hn::Abs(v));
      const auto odd = hn::BitCast(magnitudes, hn::ShiftRight<32>(hn::BitCast(Longs(), even)));
      wide = hn::Add(wide, hn::Add(hn::MulEven(even, even), hn::MulEven(odd, odd)));
    }
    HWY_INLINE void FoldRows() {}
    HWY_INLINE void Fold() {
      total += static_cast<std::uint64_t>(TotalOf(Longs(), wide));
      wide = hn::Zero(Longs());
    }
  };
};
#endif

}  // namespace lensd::autofocus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
