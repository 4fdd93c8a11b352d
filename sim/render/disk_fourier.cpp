// The transform itself, a vector of columns at a time, and its memory. Compiled once for every instruction set; the
// picture is padded with zeros, so nothing wraps round as long as the disk fits the padding.
#include "sim/render/disk_fourier.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/render/disk_fourier.cpp"
#include <hwy/aligned_allocator.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// The transform is the textbook one, by decimation in frequency: a block of n samples is split into r parts of n / r;
// samples at the same place in each part are combined by a transform of length r, part k is multiplied by the k-th
// power of the place's root of unity, and each part is transformed on its own. The way back undoes the steps in
// reverse. A lane is a column (or, for rows, after transposing, a row), so that every lane works alike and no sum
// crosses lanes.
HWY_BEFORE_NAMESPACE();
namespace lensd::sim::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;

/// Its constructors are written out so that they are compiled for the target: GCC's own are not, and AArch64 minds.
struct Complex {
  HWY_INLINE Complex() {}
  HWY_INLINE Complex(V real, V imaginary) : re(real), im(imaginary) {}
  V re;
  V im;
};

HWY_INLINE Complex operator+(Complex a, Complex b) {
  return {hn::Add(a.re, b.re), hn::Add(a.im, b.im)};
}
HWY_INLINE Complex operator-(Complex a, Complex b) {
  return {hn::Sub(a.re, b.re), hn::Sub(a.im, b.im)};
}
HWY_INLINE Complex Scaled(Complex a, V factor) {
  return {hn::Mul(a.re, factor), hn::Mul(a.im, factor)};
}
/// a times -i on the way forward, i on the way back.
template <bool kForward>
HWY_INLINE Complex Turned(Complex a) {
  return kForward ? Complex{a.im, hn::Neg(a.re)} : Complex{hn::Neg(a.im), a.re};
}
/// a times (c, s) on the way forward, its conjugate on the way back.
template <bool kForward>
HWY_INLINE Complex Rotated(Complex a, V c, V s) {
  if constexpr (kForward) {
    return {hn::Sub(hn::Mul(a.re, c), hn::Mul(a.im, s)), hn::Add(hn::Mul(a.re, s), hn::Mul(a.im, c))};
  }
  return {hn::Add(hn::Mul(a.re, c), hn::Mul(a.im, s)), hn::Sub(hn::Mul(a.im, c), hn::Mul(a.re, s))};
}

/// Transforms of length 2, 3, 4 and 5 in place.
template <bool kForward>
HWY_INLINE void Combine2(Complex* x) {
  const Complex a = x[0];
  x[0] = a + x[1];
  x[1] = a - x[1];
}

template <bool kForward>
HWY_INLINE void Combine3(Complex* x) {
  const D d;
  const Complex sum = x[1] + x[2];
  const Complex across = Turned<kForward>(Scaled(x[1] - x[2], hn::Set(d, 0.866025403784438647f)));
  const Complex middle = x[0] - Scaled(sum, hn::Set(d, 0.5f));
  x[0] = x[0] + sum;
  x[1] = middle + across;
  x[2] = middle - across;
}

template <bool kForward>
HWY_INLINE void Combine4(Complex* x) {
  const Complex even_sum = x[0] + x[2];
  const Complex even_difference = x[0] - x[2];
  const Complex odd_sum = x[1] + x[3];
  const Complex odd_difference = Turned<kForward>(x[1] - x[3]);
  x[0] = even_sum + odd_sum;
  x[1] = even_difference + odd_difference;
  x[2] = even_sum - odd_sum;
  x[3] = even_difference - odd_difference;
}

template <bool kForward>
HWY_INLINE void Combine5(Complex* x) {
  const D d;
  const V c1 = hn::Set(d, 0.309016994374947424f);
  const V c2 = hn::Set(d, -0.809016994374947424f);
  const V s1 = hn::Set(d, 0.951056516295153572f);
  const V s2 = hn::Set(d, 0.587785252292473129f);
  const Complex outer = x[1] + x[4];
  const Complex inner = x[2] + x[3];
  const Complex outer_turn = Turned<kForward>(x[1] - x[4]);
  const Complex inner_turn = Turned<kForward>(x[2] - x[3]);
  const Complex a = x[0] + Scaled(outer, c1) + Scaled(inner, c2);
  const Complex b = x[0] + Scaled(outer, c2) + Scaled(inner, c1);
  const Complex a_turn = Scaled(outer_turn, s1) + Scaled(inner_turn, s2);
  const Complex b_turn = Scaled(outer_turn, s2) - Scaled(inner_turn, s1);
  x[0] = x[0] + outer + inner;
  x[1] = a + a_turn;
  x[2] = b + b_turn;
  x[3] = b - b_turn;
  x[4] = a - a_turn;
}

template <bool kForward, int kRadix>
HWY_INLINE void Combine(Complex* x) {
  if constexpr (kRadix == 2) Combine2<kForward>(x);
  if constexpr (kRadix == 3) Combine3<kForward>(x);
  if constexpr (kRadix == 4) Combine4<kForward>(x);
  if constexpr (kRadix == 5) Combine5<kForward>(x);
}

/// One stage over all blocks. A sample is two vectors, real parts before imaginary parts.
template <bool kForward, int kRadix>
void RunStage(const FourierPlan::Stage& stage, int size, float* HWY_RESTRICT samples) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  const int part = stage.length / kRadix;
  for (int place = 0; place < part; ++place) {
    V c[kRadix];
    V s[kRadix];
    for (int k = 1; k < kRadix; ++k) {
      const auto at = static_cast<std::size_t>(place * (kRadix - 1) + k - 1);
      c[k] = hn::Set(d, stage.cos_values[at]);
      s[k] = hn::Set(d, stage.sin_values[at]);
    }
    for (int block = place; block < size; block += stage.length) {
      Complex x[kRadix];
      for (int k = 0; k < kRadix; ++k) {
        const float* at = samples + static_cast<std::size_t>(block + k * part) * 2 * lanes;
        x[k] = {hn::Load(d, at), hn::Load(d, at + lanes)};
        if (!kForward && k > 0) x[k] = Rotated<false>(x[k], c[k], s[k]);
      }
      Combine<kForward, kRadix>(x);
      for (int k = 0; k < kRadix; ++k) {
        if (kForward && k > 0) x[k] = Rotated<true>(x[k], c[k], s[k]);
        float* at = samples + static_cast<std::size_t>(block + k * part) * 2 * lanes;
        hn::Store(x[k].re, d, at);
        hn::Store(x[k].im, d, at + lanes);
      }
    }
  }
}

template <bool kForward>
void RunAnyStage(const FourierPlan::Stage& stage, int size, float* samples) {
  switch (stage.radix) {
    case 2:
      return RunStage<kForward, 2>(stage, size, samples);
    case 3:
      return RunStage<kForward, 3>(stage, size, samples);
    case 4:
      return RunStage<kForward, 4>(stage, size, samples);
    default:
      return RunStage<kForward, 5>(stage, size, samples);
  }
}

void Forward(const FourierPlan& plan, float* samples) {
  for (const FourierPlan::Stage& stage : plan.stages) RunAnyStage<true>(stage, plan.size, samples);
}

void Backward(const FourierPlan& plan, float* samples) {
  for (auto stage = plan.stages.rbegin(); stage != plan.stages.rend(); ++stage) {
    RunAnyStage<false>(*stage, plan.size, samples);
  }
}

/// Turns `lanes` rows of `count` values, `from_stride` apart, into `count` rows of `lanes`, `to_stride` apart; `lanes`
/// is the vector's. And back.
void TurnRows(const float* HWY_RESTRICT from, std::size_t from_stride, std::size_t rows, std::size_t columns,
              float* HWY_RESTRICT to, std::size_t to_stride) {
#if HWY_TARGET == HWY_SCALAR
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) to[c * to_stride + r] = from[r * from_stride + c];
  }
#else
  const hn::CappedTag<float, 4> d;
  const hn::RepartitionToWide<decltype(d)> wide;
  const auto pair = [&](auto v) { return hn::BitCast(wide, v); };
  for (std::size_t r = 0; r + 4 <= rows; r += 4) {
    for (std::size_t c = 0; c + 4 <= columns; c += 4) {
      const float* at = from + r * from_stride + c;
      const auto r0 = hn::LoadU(d, at);
      const auto r1 = hn::LoadU(d, at + from_stride);
      const auto r2 = hn::LoadU(d, at + 2 * from_stride);
      const auto r3 = hn::LoadU(d, at + 3 * from_stride);
      const auto low01 = pair(hn::InterleaveLower(d, r0, r1));
      const auto low23 = pair(hn::InterleaveLower(d, r2, r3));
      const auto high01 = pair(hn::InterleaveUpper(d, r0, r1));
      const auto high23 = pair(hn::InterleaveUpper(d, r2, r3));
      float* out = to + c * to_stride + r;
      hn::StoreU(hn::BitCast(d, hn::InterleaveLower(wide, low01, low23)), d, out);
      hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(wide, low01, low23)), d, out + to_stride);
      hn::StoreU(hn::BitCast(d, hn::InterleaveLower(wide, high01, high23)), d, out + 2 * to_stride);
      hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(wide, high01, high23)), d, out + 3 * to_stride);
    }
  }
#endif
}

/// Columns of the two planes (stride floats a row, `rows` rows) through the transform, a vector of columns at a time.
template <bool kForward>
void AllColumns(const FourierPlan& plan, float* re, float* im, std::size_t columns, std::size_t stride,
                float* samples) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  const auto rows = static_cast<std::size_t>(plan.size);
  for (std::size_t x = 0; x < columns; x += lanes) {
    for (std::size_t y = 0; y < rows; ++y) {
      hn::Store(hn::LoadU(d, re + y * stride + x), d, samples + 2 * y * lanes);
      hn::Store(hn::LoadU(d, im + y * stride + x), d, samples + (2 * y + 1) * lanes);
    }
    if (kForward) {
      Forward(plan, samples);
    } else {
      Backward(plan, samples);
    }
    for (std::size_t y = 0; y < rows; ++y) {
      hn::StoreU(hn::Load(d, samples + 2 * y * lanes), d, re + y * stride + x);
      hn::StoreU(hn::Load(d, samples + (2 * y + 1) * lanes), d, im + y * stride + x);
    }
  }
}

/// Rows through the transform; with a transfer function also multiplied by it and brought back.
void AllRows(const FourierPlan& plan, float* re, float* im, std::size_t stride, std::size_t rows, const float* transfer,
             float* samples) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  const auto size = static_cast<std::size_t>(plan.size);
  hwy::AlignedFreeUniquePtr<float[]> factors = hwy::AllocateAligned<float>(size * lanes);
  for (std::size_t y = 0; y < rows; y += lanes) {
    TurnRows(re + y * stride, stride, lanes, size, samples, 2 * lanes);
    TurnRows(im + y * stride, stride, lanes, size, samples + lanes, 2 * lanes);
    Forward(plan, samples);
    if (transfer != nullptr) {
      TurnRows(transfer + y * stride, stride, lanes, size, factors.get(), lanes);
      for (std::size_t x = 0; x < size; ++x) {
        const V factor = hn::Load(d, factors.get() + x * lanes);
        float* at = samples + 2 * x * lanes;
        hn::Store(hn::Mul(hn::Load(d, at), factor), d, at);
        hn::Store(hn::Mul(hn::Load(d, at + lanes), factor), d, at + lanes);
      }
      Backward(plan, samples);
    }
    TurnRows(samples, 2 * lanes, size, lanes, re + y * stride, stride);
    TurnRows(samples + lanes, 2 * lanes, size, lanes, im + y * stride, stride);
  }
}

hwy::AlignedFreeUniquePtr<float[]> SamplesFor(const FourierPlan& down, const FourierPlan& along) {
  const auto longest = static_cast<std::size_t>(std::max(down.size, along.size));
  return hwy::AllocateAligned<float>(2 * longest * hn::Lanes(D()));
}

/// Forward, times `transfer`, and back. `rows` counts the planes' rows, a multiple of 16.
void Transform(const FourierPlan& down, const FourierPlan& along, float* re, float* im, std::size_t stride,
               std::size_t rows, const float* transfer) {
  const auto samples = SamplesFor(down, along);
  const auto columns = static_cast<std::size_t>(along.size);
  AllColumns<true>(down, re, im, columns, stride, samples.get());
  AllRows(along, re, im, stride, rows, transfer, samples.get());
  AllColumns<false>(down, re, im, columns, stride, samples.get());
}

/// Forward, of an even kernel in the columns less than `reach` + 1 from the first, both ways round; `im` holds zeros.
/// Its columns' transforms are real, and its rows' too: two rows travel as one.
void TransformKernel(const FourierPlan& down, const FourierPlan& along, float* re, float* im, std::size_t stride,
                     std::size_t rows, std::size_t reach) {
  constexpr std::size_t kRows = 16;
  const auto samples = SamplesFor(down, along);
  const auto columns = static_cast<std::size_t>(along.size);
  const std::size_t filled = (reach + kRows) / kRows * kRows;
  if (2 * filled < columns) {
    AllColumns<true>(down, re, im, filled, stride, samples.get());
    AllColumns<true>(down, re + columns - filled, im + columns - filled, filled, stride, samples.get());
  } else {
    AllColumns<true>(down, re, im, columns, stride, samples.get());
  }
  const std::size_t pairs = rows / (2 * kRows) * kRows;
  AllRows(along, re, re + pairs * stride, stride, pairs, nullptr, samples.get());
  if (2 * pairs < rows) AllRows(along, re + 2 * pairs * stride, im, stride, kRows, nullptr, samples.get());
}

}  // namespace lensd::sim::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lensd::sim {
namespace {

HWY_EXPORT(Transform);
HWY_EXPORT(TransformKernel);

/// The smallest multiple of 16 at least `least` with no other prime factors than 2, 3 and 5.
int GoodSize(int least) {
  for (int size = (least + 15) / 16 * 16;; size += 16) {
    int rest = size;
    for (const int factor : {2, 3, 5}) {
      while (rest % factor == 0) rest /= factor;
    }
    if (rest == 1) return size;
  }
}

/// Two planes of the padded size. Rows are a little longer than that, lest the rows of a column share the same few
/// lines of the cache.
struct Planes {
  std::size_t stride = 0;
  std::size_t rows = 0;
  std::size_t held = 0;
  hwy::AlignedFreeUniquePtr<float[]> re;
  hwy::AlignedFreeUniquePtr<float[]> im;

  void Fit(const FourierPlan& down, const FourierPlan& along) {
    stride = static_cast<std::size_t>(along.size) + 16;
    rows = static_cast<std::size_t>(down.size);
    if (stride * rows <= held) return;
    held = stride * rows;
    re = hwy::AllocateAligned<float>(held);
    im = hwy::AllocateAligned<float>(held);
  }
};

/// Kept from one picture to the next: fresh memory costs as much as a third of the transform.
Planes& ScratchFor(const FourierPlan& down, const FourierPlan& along) {
  thread_local Planes planes;
  planes.Fit(down, along);
  return planes;
}

/// Copies rows [first, first + count) of a rectangle of the source, as far as it has them, and fills up with zeros.
void Fill(const Raster& source, PixelRect rect, int first, int count, const Planes& planes, float* plane) {
  const auto columns = static_cast<std::size_t>(rect.width);
  for (std::size_t y = 0; y < planes.rows; ++y) {
    float* row = plane + y * planes.stride;
    std::size_t filled = 0;
    if (static_cast<int>(y) < count && first + static_cast<int>(y) < rect.height) {
      std::copy_n(source.Row(rect.y + first + static_cast<int>(y)) + (rect.x - source.rect.x), columns, row);
      filled = columns;
    }
    std::fill(row + filled, row + planes.stride, 0.0f);
  }
}

}  // namespace

DiskFourier::DiskFourier(double diameter_px, int width, int height, const ApertureShape& shape)
    : DiskFourier(DiskKernel(diameter_px, shape), width, height) {}

DiskFourier::DiskFourier(const DiskKernel& kernel, int width, int height)
    : reach_(kernel.reach),
      width_(width),
      height_(height),
      half_((height + 1) / 2),
      down_(GoodSize(half_ + 2 * reach_)),
      along_(GoodSize(width + 2 * reach_)) {
  Planes& planes = ScratchFor(down_, along_);
  Fill(Raster(), {}, 0, 0, planes, planes.re.get());
  Fill(Raster(), {}, 0, 0, planes, planes.im.get());
  const double samples = static_cast<double>(down_.size) * along_.size;
  for (int y = -reach_; y <= reach_; ++y) {
    for (int x = -reach_; x <= reach_; ++x) {
      const int row = (y + down_.size) % down_.size;
      const int column = (x + along_.size) % along_.size;
      planes.re[static_cast<std::size_t>(row) * planes.stride + static_cast<std::size_t>(column)] =
          static_cast<float>(kernel.At(x, y) / samples);
    }
  }
  HWY_DYNAMIC_DISPATCH(TransformKernel)
  (down_, along_, planes.re.get(), planes.im.get(), planes.stride, planes.rows, static_cast<std::size_t>(reach_));
  transfer_.assign(planes.re.get(), planes.re.get() + planes.stride * planes.rows);
}

void DiskFourier::Blur(const Raster& source, Raster& out) const {
  Planes& planes = ScratchFor(down_, along_);
  const PixelRect needed = Grown(out.rect, reach_);
  Fill(source, needed, 0, half_ + 2 * reach_, planes, planes.re.get());
  Fill(source, needed, half_, half_ + 2 * reach_, planes, planes.im.get());
  HWY_DYNAMIC_DISPATCH(Transform)
  (down_, along_, planes.re.get(), planes.im.get(), planes.stride, planes.rows, transfer_.data());
  for (int y = 0; y < height_; ++y) {
    const float* plane = y < half_ ? planes.re.get() : planes.im.get();
    const int row = (y < half_ ? y : y - half_) + reach_;
    std::copy_n(plane + static_cast<std::size_t>(row) * planes.stride + static_cast<std::size_t>(reach_), width_,
                out.Row(out.rect.y + y));
  }
}

}  // namespace lensd::sim
#endif
