// An estimate tries some thousand places and slopes, and each takes these sums over forty rings: they are most of what
// autofocus computes. So they run over as many rings at once as a vector holds, compiled for each number of frames and
// once for each instruction set. Matrices are as small as the number of frames, and unrolled.
#include "autofocus/defocus/ring_fit.h"

#include <cmath>
#include <cstddef>
#include <numbers>

#include "autofocus/defocus/disk_response.h"
#include "autofocus/defocus/texture_prior.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autofocus/defocus/ring_fit.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// After foreach_target.h, which includes this file again.
#include <hwy/contrib/math/math-inl.h>

HWY_BEFORE_NAMESPACE();
namespace lensd::autofocus::defocus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr double kModelError = 0.1;   // of the response, independent between frames
constexpr double kModelFloor = 0.02;  // of the response's envelope: real disks have no perfect zeros
constexpr int kSteps = 2;
constexpr double kLongestStep = 1.5;  // of log power
constexpr double kLeastInformation = 1e-9;
constexpr double kVariance = TexturePrior::kScatter * TexturePrior::kScatter;

using D = hn::CappedTag<double, RingColumns::kAbreast>;
using V = hn::Vec<D>;

HWY_INLINE V All(double value) {
  return hn::Set(D(), value);
}

/// Symmetric: the lower triangle is filled.
template <int n>
struct Symmetric {
  V at[n][n];
  HWY_INLINE V operator()(int i, int j) const { return i >= j ? at[i][j] : at[j][i]; }
};

template <int n>
struct Square {
  V at[n][n];
};

template <int n>
struct Inverse {
  Symmetric<n> inverse;
  V determinant;
};

/// The columns that a fit fills on its way, by ring.
enum Scratch : std::size_t { kLogPower, kWanted, kInformation, kGains, kScratch = kGains + 10 };

constexpr std::size_t Slot(int i, int j) {
  return static_cast<std::size_t>(i * (i + 1) / 2 + j);
}

template <int n>
HWY_INLINE Symmetric<n> LoadAt(const double* columns, std::size_t rings, std::size_t r) {
  Symmetric<n> loaded;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) loaded.at[i][j] = hn::LoadU(D(), columns + Slot(i, j) * rings + r);
  }
  return loaded;
}

/// The response of disks, from the table.
HWY_INLINE V ResponseAt(const double* table, V turns) {
  const D d;
  const V end = All(static_cast<double>(kDiskResponseEntries - 2));
  const V at = hn::Mul(hn::Abs(turns), All(kDiskResponsePerTurn));
  const V inside = hn::Min(at, hn::Sub(end, All(1.0)));
  const auto below = hn::ConvertTo(hn::RebindToSigned<D>(), inside);
  const V low = hn::GatherIndex(d, table, below);
  const V high = hn::GatherIndex(d, table + 1, below);
  const V part = hn::Sub(inside, hn::ConvertTo(d, below));
  return hn::IfThenElseZero(hn::Lt(at, end), hn::MulAdd(part, hn::Sub(high, low), low));
}

HWY_INLINE V Envelope(V turns) {
  const V x = hn::Mul(All(std::numbers::pi), hn::Abs(turns));
  const V cube = hn::Mul(hn::Mul(x, x), hn::Mul(x, All(std::numbers::pi)));
  return hn::IfThenElse(hn::Lt(x, All(1.4)), All(1.0), hn::Div(All(8.0), hn::Max(cube, All(1.0))));
}

template <int n>
HWY_INLINE Symmetric<n> Gains(const RingColumns& rings, std::size_t r, const double* table, const double* blur) {
  const D d;
  Symmetric<n> gains;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) gains.at[i][j] = hn::Zero(d);
  }
  for (std::size_t q = 0; q < 3; ++q) {
    const V frequency = hn::LoadU(d, rings[RingColumns::kNear + q] + r);
    const V weight = hn::LoadU(d, rings[RingColumns::kNearWeight + q] + r);
    V response[n];
    for (int i = 0; i < n; ++i) response[i] = ResponseAt(table, hn::Mul(All(blur[i]), frequency));
    for (int i = 0; i < n; ++i) {
      const V weighted = hn::Mul(weight, response[i]);
      for (int j = 0; j <= i; ++j) gains.at[i][j] = hn::MulAdd(weighted, response[j], gains.at[i][j]);
    }
  }
  const V frequency = hn::LoadU(d, rings[RingColumns::kFrequency] + r);
  const V coherence = hn::LoadU(d, rings[RingColumns::kCoherence] + r);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) gains.at[i][j] = hn::Mul(gains.at[i][j], coherence);
    const V floor = hn::Mul(All(kModelFloor), Envelope(hn::Mul(All(blur[i]), frequency)));
    gains.at[i][i] = hn::MulAdd(gains.at[i][i], All(1.0 + kModelError * kModelError), floor);
  }
  return gains;
}

template <int n>
HWY_INLINE Symmetric<n> Covariance(const RingColumns& rings, const Symmetric<n>& gains, V power) {
  Symmetric<n> covariance;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) covariance.at[i][j] = hn::Mul(power, gains.at[i][j]);
    covariance.at[i][i] = hn::MulAdd(power, gains.at[i][i], All(rings.noise(i)));
  }
  return covariance;
}

/// Where to start: the power whose S G is nearest to what is left without noise.
template <int n>
HWY_INLINE V FirstPower(const RingColumns& rings, const Symmetric<n>& gains, const Symmetric<n>& light) {
  V product = hn::Zero(D()), square = product, trace = product;
  double floor = 0.0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) {
      const V twice = hn::Add(gains.at[i][j], gains.at[i][j]);
      product = hn::MulAdd(twice, light.at[i][j], product);
      square = hn::MulAdd(twice, gains.at[i][j], square);
    }
    product = hn::MulAdd(gains.at[i][i], hn::Sub(light.at[i][i], All(rings.noise(i))), product);
    square = hn::MulAdd(gains.at[i][i], gains.at[i][i], square);
    trace = hn::Add(trace, gains.at[i][i]);
    floor += rings.noise(i);
  }
  return hn::Max(hn::Div(product, square), hn::Div(All(0.03 * floor), trace));
}

/// Of a positive definite matrix, by Cholesky.
template <int n>
HWY_INLINE Inverse<n> Invert(const Symmetric<n>& matrix) {
  V lower[n][n];  // the diagonal inverted, as it is needed
  Inverse<n> result;
  for (int j = 0; j < n; ++j) {
    V pivot = matrix.at[j][j];
    for (int k = 0; k < j; ++k) pivot = hn::NegMulAdd(lower[j][k], lower[j][k], pivot);
    result.determinant = j == 0 ? pivot : hn::Mul(result.determinant, pivot);
    lower[j][j] = hn::Div(All(1.0), hn::Sqrt(pivot));
    for (int i = j + 1; i < n; ++i) {
      V value = matrix.at[i][j];
      for (int k = 0; k < j; ++k) value = hn::NegMulAdd(lower[i][k], lower[j][k], value);
      lower[i][j] = hn::Mul(value, lower[j][j]);
    }
  }
  V inverse[n][n];
  for (int j = 0; j < n; ++j) {
    inverse[j][j] = lower[j][j];
    for (int i = j + 1; i < n; ++i) {
      V sum = hn::Zero(D());
      for (int k = j; k < i; ++k) sum = hn::NegMulAdd(lower[i][k], inverse[k][j], sum);
      inverse[i][j] = hn::Mul(sum, lower[i][i]);
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      V sum = hn::Zero(D());
      for (int k = i; k < n; ++k) sum = hn::MulAdd(inverse[k][i], inverse[k][j], sum);
      result.inverse.at[i][j] = sum;
    }
  }
  return result;
}

template <int n>
HWY_INLINE Square<n> Product(const Symmetric<n>& a, const Symmetric<n>& b) {
  Square<n> product;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      V sum = hn::Zero(D());
      for (int k = 0; k < n; ++k) sum = hn::MulAdd(a(i, k), b(k, j), sum);
      product.at[i][j] = sum;
    }
  }
  return product;
}

template <int n>
HWY_INLINE V TraceOfProduct(const Square<n>& a, const Square<n>& b) {
  V sum = hn::Zero(D());
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) sum = hn::MulAdd(a.at[i][j], b.at[j][i], sum);
  }
  return sum;
}

template <int n>
HWY_INLINE V TraceOfProduct(const Symmetric<n>& a, const Symmetric<n>& b) {
  V sum = hn::Zero(D());
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) sum = hn::MulAdd(hn::Add(a.at[i][j], a.at[i][j]), b.at[i][j], sum);
    sum = hn::MulAdd(a.at[i][i], b.at[i][i], sum);
  }
  return sum;
}

/// A step of Fisher scoring from `log_power`: the log power that the data alone ask for, and the information about it.
template <int n>
HWY_INLINE void Score(const RingColumns& rings, const Symmetric<n>& gains, const Symmetric<n>& light, V count,
                      V log_power, V& wanted, V& information) {
  const D d;
  const V power = hn::Exp(d, log_power);
  const Inverse<n> inverse = Invert<n>(Covariance<n>(rings, gains, power));
  const Square<n> gain = Product<n>(inverse.inverse, gains);
  V trace = hn::Zero(d);
  for (int i = 0; i < n; ++i) trace = hn::Add(trace, gain.at[i][i]);
  const V excess = hn::Sub(TraceOfProduct<n>(gain, Product<n>(inverse.inverse, light)), trace);
  const V counted = hn::Mul(count, power);
  information = hn::Mul(hn::Mul(counted, power), TraceOfProduct<n>(gain, gain));
  const V step = hn::Div(hn::Mul(counted, excess), hn::Max(information, All(kLeastInformation)));
  wanted = hn::Add(log_power, hn::Max(hn::Min(step, All(kLongestStep)), All(-kLongestStep)));
}

/// What the prior's curve is fitted to.
struct CurveSums {
  V normal[6];
  V right[3];
  HWY_INLINE CurveSums() {
    for (V& sum : normal) sum = hn::Zero(D());
    for (V& sum : right) sum = hn::Zero(D());
  }
  HWY_INLINE void Add(V l, V l2, V log_power, V weight) {
    const V first = hn::Mul(weight, l), second = hn::Mul(weight, l2);
    normal[0] = hn::Add(normal[0], weight);
    normal[1] = hn::Add(normal[1], first);
    normal[2] = hn::Add(normal[2], second);
    normal[3] = hn::MulAdd(first, l, normal[3]);
    normal[4] = hn::MulAdd(first, l2, normal[4]);
    normal[5] = hn::MulAdd(second, l2, normal[5]);
    right[0] = hn::MulAdd(weight, log_power, right[0]);
    right[1] = hn::MulAdd(first, log_power, right[1]);
    right[2] = hn::MulAdd(second, log_power, right[2]);
  }
  HWY_INLINE TexturePrior::Sums Take() const {
    TexturePrior::Sums sums;
    for (std::size_t i = 0; i < 6; ++i) sums.normal[i] = hn::GetLane(hn::SumOfLanes(D(), normal[i]));
    for (std::size_t i = 0; i < 3; ++i) sums.right[i] = hn::GetLane(hn::SumOfLanes(D(), right[i]));
    return sums;
  }
};

HWY_INLINE V CurveAt(const std::array<double, 3>& curve, V l, V l2) {
  return hn::MulAdd(All(curve[2]), l2, hn::MulAdd(All(curve[1]), l, All(curve[0])));
}

/// The log power that data and prior together ask for.
HWY_INLINE V Expected(V wanted, V information, V by_curve) {
  const V sum = hn::MulAdd(wanted, information, hn::Mul(by_curve, All(1.0 / kVariance)));
  return hn::Div(sum, hn::Add(information, All(1.0 / kVariance)));
}

template <int n>
HWY_INLINE Fit FitOf(const RingColumns& rings, const double* table, const double* blur, double* scratch) {
  const D d;
  const std::size_t count_of_rings = rings.rings();
  const auto column = [&](std::size_t which, std::size_t r) HWY_ATTR { return scratch + which * count_of_rings + r; };
  TexturePrior prior;
  for (int step = 0; step < kSteps; ++step) {
    CurveSums sums;
    for (std::size_t r = 0; r < count_of_rings; r += hn::Lanes(d)) {
      const V count = hn::LoadU(d, rings[RingColumns::kCount] + r);
      const V l = hn::LoadU(d, rings[RingColumns::kLog] + r), l2 = hn::LoadU(d, rings[RingColumns::kLog2] + r);
      const auto light = LoadAt<n>(rings[RingColumns::kPower], count_of_rings, r);
      Symmetric<n> gains;
      V log_power, wanted, information;
      if (step == 0) {
        gains = Gains<n>(rings, r, table, blur);
        for (int i = 0; i < n; ++i) {
          for (int j = 0; j <= i; ++j) hn::StoreU(gains.at[i][j], d, column(kGains + Slot(i, j), r));
        }
        log_power = hn::Log(d, FirstPower<n>(rings, gains, light));
      } else {
        gains = LoadAt<n>(column(kGains, 0), count_of_rings, r);
        log_power = Expected(hn::LoadU(d, column(kWanted, r)), hn::LoadU(d, column(kInformation, r)),
                             CurveAt(prior.curve(), l, l2));
      }
      Score<n>(rings, gains, light, count, log_power, wanted, information);
      hn::StoreU(wanted, d, column(kWanted, r));
      hn::StoreU(information, d, column(kInformation, r));
      const V spread = hn::Add(hn::Div(All(1.0), hn::Max(information, All(kLeastInformation))), All(kVariance));
      const auto counts = hn::Gt(count, hn::Zero(d));
      sums.Add(l, l2, wanted, hn::IfThenElseZero(counts, hn::Div(All(1.0), spread)));
    }
    prior = TexturePrior(sums.Take());
  }
  V likelihood = hn::Zero(d), of_texture = hn::Zero(d), excess = hn::Zero(d);
  for (std::size_t r = 0; r < count_of_rings; r += hn::Lanes(d)) {
    const V count = hn::LoadU(d, rings[RingColumns::kCount] + r);
    const V l = hn::LoadU(d, rings[RingColumns::kLog] + r), l2 = hn::LoadU(d, rings[RingColumns::kLog2] + r);
    const V information = hn::LoadU(d, column(kInformation, r)), by_curve = CurveAt(prior.curve(), l, l2);
    const V log_power = Expected(hn::LoadU(d, column(kWanted, r)), information, by_curve);
    const auto gains = LoadAt<n>(column(kGains, 0), count_of_rings, r);
    const Inverse<n> inverse = Invert<n>(Covariance<n>(rings, gains, hn::Exp(d, log_power)));
    const V trace = TraceOfProduct<n>(inverse.inverse, LoadAt<n>(rings[RingColumns::kPower], count_of_rings, r));
    const V off = hn::Sub(log_power, by_curve);
    likelihood = hn::MulAdd(count, hn::Add(hn::Log(d, inverse.determinant), trace), likelihood);
    const V scatter = hn::Log(d, hn::MulAdd(All(kVariance), information, All(1.0)));
    const V density = hn::MulAdd(hn::Mul(off, off), All(1.0 / kVariance), scatter);
    of_texture = hn::Add(of_texture, hn::IfThenElseZero(hn::Gt(count, hn::Zero(d)), density));
    excess = hn::MulAdd(count, hn::Sub(hn::Mul(trace, All(1.0 / n)), All(1.0)), excess);
  }
  const auto total = [&](V sum) HWY_ATTR { return hn::GetLane(hn::SumOfLanes(d, sum)); };
  return {.log_likelihood = -total(likelihood),
          .log_prior = prior.LogDensity() - 0.5 * total(of_texture),
          .excess = rings.count() > 0 ? total(excess) / rings.count() : 0.0};
}

Fit FitFrames(const RingColumns& rings, const double* table, const double* blur, double* scratch) {
  switch (rings.frames()) {
    case 1:
      return FitOf<1>(rings, table, blur, scratch);
    case 2:
      return FitOf<2>(rings, table, blur, scratch);
    case 3:
      return FitOf<3>(rings, table, blur, scratch);
    default:
      return FitOf<4>(rings, table, blur, scratch);
  }
}

}  // namespace lensd::autofocus::defocus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lensd::autofocus::defocus {
HWY_EXPORT(FitFrames);

namespace {

constexpr double kDisplacement = 0.2;  // px: of one frame against another
constexpr double kSmear = 0.8;         // bins
constexpr double kSmearWeights[] = {0.32, 0.36, 0.32};

}  // namespace

RingColumns::RingColumns(const RingStack& stack)
    : frames_(stack.frames),
      rings_((stack.rings.size() + kAbreast - 1) / kAbreast * kAbreast),
      noise_(stack.noise),
      values_(kColumns * rings_) {
  for (std::size_t r = 0; r < rings_; ++r) {
    const bool counts = r < stack.rings.size();
    const Ring& ring = counts ? stack.rings[r] : stack.rings.back();
    const auto set = [&](std::size_t column, double value) { values_[column * rings_ + r] = value; };
    const double phase = 2.0 * std::numbers::pi * ring.frequency * kDisplacement;
    const TexturePrior::Place place = TexturePrior::PlaceOf(ring.frequency);
    set(kFrequency, ring.frequency);
    set(kCount, counts ? ring.count : 0.0);
    set(kCoherence, std::exp(-0.5 * phase * phase));
    set(kLog, place.l);
    set(kLog2, place.l2);
    double weights[3], total = 0.0;
    for (std::size_t q = 0; q < 3; ++q) {
      const double off = (static_cast<double>(q) - 1.0) * kSmear * ring.spread;
      const double near = std::max(ring.frequency + off, 0.25 * ring.frequency), relative = ring.frequency / near;
      set(kNear + q, near);
      total += weights[q] = kSmearWeights[q] * relative * relative;
    }
    for (std::size_t q = 0; q < 3; ++q) set(kNearWeight + q, weights[q] / total);
    for (std::size_t i = 0, slot = kPower; i < kMostFrames; ++i) {
      for (std::size_t j = 0; j <= i; ++j) set(slot++, ring.power[i * kMostFrames + j]);
    }
    if (counts) count_ += ring.count;
  }
}

Fit FitRings(const RingColumns& rings, const std::array<double, kMostFrames>& blur) {
  static thread_local std::vector<double> scratch;
  scratch.resize(HWY_NAMESPACE::kScratch * rings.rings());
  return HWY_DYNAMIC_DISPATCH(FitFrames)(rings, DiskResponseTable(), blur.data(), scratch.data());
}

}  // namespace lensd::autofocus::defocus
#endif
