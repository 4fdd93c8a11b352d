// The method is that of planner_strip.h, laid out for speed: one division a limit, lines in plain arrays scanned in
// vectors, and every step from the left taken a hair beyond the zero of the narrowest pair, so that the scan that ends
// the search is also its proof.
#include "planner_columns_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "planner_columns_rows.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lensd::optics::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::ScalableTag<double>;
using Vec = hn::Vec<Doubles>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

/// sign +1: the lower one, -1: the higher.
template <int sign>
HWY_INLINE Vec Beyond(Vec a, Vec b) {
  return sign > 0 ? hn::Min(a, b) : hn::Max(a, b);
}

template <int sign>
HWY_INLINE double BeyondAll(Vec v) {
  return hn::GetLane(sign > 0 ? hn::MinOfLanes(Doubles(), v) : hn::MaxOfLanes(Doubles(), v));
}

/// Lines e <= p + q t (or >=); `rows` of them, padded to whole vectors with lines that bind nothing.
struct Side {
  double* p = nullptr;
  double* q = nullptr;
  std::size_t sharp = 0;  ///< rows of sharp limits, padded; the blurred ones follow
  std::size_t rows = 0;
};

struct Line {
  double value = 0.0, p = 0.0, q = 0.0;
};

HWY_INLINE Vec ValueAt(const Side& side, std::size_t i, Vec t) {
  const Doubles d;
  return hn::Add(hn::LoadU(d, side.p + i), hn::Mul(hn::LoadU(d, side.q + i), t));
}

/// sign +1: the lowest line, -1: the highest. [from, to) in whole vectors.
template <int sign>
HWY_INLINE void Extreme(const Side& side, std::size_t from, std::size_t to, double t, Line& best) {
  if (from == to) return;
  const Doubles d;
  const std::size_t lanes = hn::Lanes(d);
  const Vec at = hn::Set(d, t);
  Vec first = hn::Set(d, best.value), second = first, third = first, fourth = first;
  std::size_t i = from;
  for (; i + 4 * lanes <= to; i += 4 * lanes) {
    first = Beyond<sign>(ValueAt(side, i, at), first);
    second = Beyond<sign>(ValueAt(side, i + lanes, at), second);
    third = Beyond<sign>(ValueAt(side, i + 2 * lanes, at), third);
    fourth = Beyond<sign>(ValueAt(side, i + 3 * lanes, at), fourth);
  }
  for (; i < to; i += lanes) first = Beyond<sign>(ValueAt(side, i, at), first);
  const double value = BeyondAll<sign>(Beyond<sign>(Beyond<sign>(first, second), Beyond<sign>(third, fourth)));
  if (value == best.value) return;
  const Vec wanted = hn::Set(d, value);
  for (i = from; i < to; i += lanes) {
    const std::intptr_t found = hn::FindFirstTrue(d, hn::Eq(ValueAt(side, i, at), wanted));
    if (found < 0) continue;
    i += static_cast<std::size_t>(found);
    best = {value, side.p[i], side.q[i]};
    return;
  }
}

struct Lines {
  Side upper, lower;
  double p_size = 0.0, q_size = 0.0, q_least = kInfinity;  ///< largest |p|, |q|; smallest |q|
};

/// Writes lines into given room.
class Writer {
 public:
  Writer(const ColumnLens& lens, double* room, std::size_t limits) : lens_(lens) {
    const std::size_t capacity = RoomFor(limits) / 4;
    lines_.upper = {room, room + capacity, 0, 0};
    lines_.lower = {room + 2 * capacity, room + 3 * capacity, 0, 0};
  }

  const Lines& Write(const LimitColumns& limits) {
    const Doubles d;
    p_size_ = q_size_ = hn::Zero(d);
    q_least_ = hn::Set(d, kInfinity);
    const double narrow = 1.0 - lens_.f_number_tolerance, wide = 1.0 + lens_.f_number_tolerance;
    Sharp(limits, narrow);
    Pad();
    lines_.upper.sharp = lines_.upper.rows;
    lines_.lower.sharp = lines_.lower.rows;
    Blurred(lines_.lower, limits.behind_near, limits.behind_limit, wide, lens_.sensor_tolerance);
    Blurred(lines_.upper, limits.front_far, limits.front_limit, -wide, -lens_.sensor_tolerance);
    Pad();
    lines_.p_size = BeyondAll<-1>(p_size_);
    lines_.q_size = BeyondAll<-1>(q_size_);
    lines_.q_least = BeyondAll<1>(q_least_);
    return lines_;
  }

 private:
  /// The last vector of a column may be read only in part; the rest is filled with `filler`.
  static HWY_INLINE Vec Load(std::span<const double> column, std::size_t i, Vec filler) {
    const Doubles d;
    const std::size_t left = column.size() - i;
    if (left >= hn::Lanes(d)) return hn::LoadU(d, column.data() + i);
#if HWY_TARGET <= HWY_AVX2  // what is masked is not read
    const auto there = hn::FirstN(d, left);
    return hn::IfThenElse(there, hn::MaskedLoad(there, d, column.data() + i), filler);
#else
    HWY_ALIGN double last[hn::MaxLanes(d)];
    hn::Store(filler, d, last);
    std::copy_n(column.data() + i, left, last);
    return hn::Load(d, last);
#endif
  }

  /// Both lines of a limit with one division: 1/W of one end is W of the other over both.
  void Sharp(const LimitColumns& limits, double narrow) {
    const Doubles d;
    const Vec one = hn::Set(d, 1.0), f = hn::Set(d, lens_.focal_length), zero = hn::Zero(d);
    const Vec delta = hn::Set(d, lens_.sensor_tolerance), factor = hn::Set(d, narrow);
    const std::size_t count = limits.sharp_limit.size();
    for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
      const Vec near = Load(limits.sharp_near, i, zero), far = Load(limits.sharp_far, i, zero);
      const Vec limit = hn::Mul(Load(limits.sharp_limit, i, one), factor);
      const Vec w_near = hn::Sub(one, hn::Mul(f, near)), w_far = hn::Sub(one, hn::Mul(f, far));
      const Vec both = hn::Div(one, hn::Mul(w_near, w_far));
      const Vec q_near = hn::Mul(limit, hn::Mul(both, w_far)), q_far = hn::Mul(limit, hn::Mul(both, w_near));
      const Vec p_near = hn::Mul(hn::Mul(hn::Mul(f, f), near), hn::Mul(both, w_far));
      const Vec p_far = hn::Mul(hn::Mul(hn::Mul(f, f), far), hn::Mul(both, w_near));
      hn::StoreU(hn::Sub(p_far, delta), d, lines_.upper.p + i);
      hn::StoreU(q_far, d, lines_.upper.q + i);
      hn::StoreU(hn::Add(p_near, delta), d, lines_.lower.p + i);
      hn::StoreU(hn::Neg(q_near), d, lines_.lower.q + i);
      const auto real = hn::FirstN(d, count - i);
      p_size_ = hn::Max(p_size_, p_near);
      q_size_ = hn::Max(q_size_, hn::IfThenElseZero(real, hn::Max(q_near, q_far)));
      q_least_ = hn::Min(q_least_, hn::IfThenElse(real, hn::Min(q_near, q_far), q_least_));
    }
    lines_.upper.rows = lines_.lower.rows = count;
  }

  void Blurred(Side& side, std::span<const double> u, std::span<const double> limit, double factor, double shift) {
    const Doubles d;
    const Vec one = hn::Set(d, 1.0), f = hn::Set(d, lens_.focal_length), zero = hn::Zero(d);
    double* const p_to = side.p + side.rows;
    double* const q_to = side.q + side.rows;
    for (std::size_t i = 0; i < u.size(); i += hn::Lanes(d)) {
      const Vec at = Load(u, i, zero);
      const Vec inverse = hn::Div(one, hn::Sub(one, hn::Mul(f, at)));
      const Vec p = hn::Mul(hn::Mul(hn::Mul(f, f), at), inverse);
      const Vec q = hn::Mul(hn::Mul(Load(limit, i, one), hn::Set(d, factor)), inverse);
      hn::StoreU(hn::Add(p, hn::Set(d, shift)), d, p_to + i);
      hn::StoreU(q, d, q_to + i);
      const auto real = hn::FirstN(d, u.size() - i);
      p_size_ = hn::Max(p_size_, p);
      q_size_ = hn::Max(q_size_, hn::IfThenElseZero(real, hn::Abs(q)));
      q_least_ = hn::Min(q_least_, hn::IfThenElse(real, hn::Abs(q), q_least_));
    }
    side.rows += u.size();
  }

  /// A whole vector is written over the last rows, whatever followed them.
  static void Pad(Side& side, double bound) {
    const Doubles d;
    const std::size_t lanes = hn::Lanes(d), whole = (side.rows + lanes - 1) / lanes * lanes;
    for (; side.rows < whole; ++side.rows) {
      side.p[side.rows] = bound;
      side.q[side.rows] = 0.0;
    }
  }
  void Pad() {
    Pad(lines_.upper, kInfinity);
    Pad(lines_.lower, -kInfinity);
  }

  const ColumnLens& lens_;
  Lines lines_;
  Vec p_size_, q_size_, q_least_;
};

class Solver {
 public:
  Solver(const ColumnLens& lens, const Lines& lines) : lens_(lens), lines_(lines) {
    const double box = std::max(std::abs(lens.e_low), std::abs(lens.e_high));
    constexpr double kUlps = 12.0;
    unit_ = kUlps * (1.0 + lines.p_size / lens.focal_length) * kEpsilon;
    size_ = lines.p_size + lens.sensor_tolerance;
    box_error_ = kEpsilon * box;
  }

  /// How far a computed width at N may be off.
  double Error(double n) const { return unit_ * (size_ + lines_.q_size * n) + box_error_; }

  Settled SmallestN() const {
    Settled settled;
    double n = lens_.n_low, zero = n;
    for (;;) {
      const Narrow narrow = At(n);
      const double error = Error(n);
      if (narrow.width > error) {
        settled.verdict = Verdict::Feasible;
        settled.n = zero;
        settled.beyond = n;
        settled.inside = (narrow.high + narrow.low) / 2.0;
        Finish(settled);
        return settled;
      }
      if (narrow.width >= -error) return settled;
      if (!(narrow.slope > 0.0)) {
        const double at_end = narrow.width + narrow.slope * (lens_.n_high - n);
        if (at_end < -Error(lens_.n_high)) settled.verdict = Verdict::Infeasible;
        return settled;
      }
      const double next = n - narrow.width / narrow.slope;
      const double off = 2.0 * Error(next) / narrow.slope;
      if (next - off > lens_.n_high) {
        settled.verdict = Verdict::Infeasible;
        return settled;
      }
      constexpr double kRelative = 1e-12;
      if (!(off <= kRelative * next) || next + off > lens_.n_high) return settled;
      zero = next;
      n = next + off;
    }
  }

 private:
  struct Narrow {
    double width = kInfinity, slope = 0.0;
    double high = 0.0, low = 0.0;
  };

  Narrow At(double n) const {
    Line upper{kInfinity, 0.0, 0.0}, lower{-kInfinity, 0.0, 0.0};
    Extreme<1>(lines_.upper, 0, lines_.upper.rows, n, upper);
    Extreme<-1>(lines_.lower, 0, lines_.lower.rows, n, lower);
    Narrow narrow;
    narrow.high = std::min(upper.value, lens_.e_high);
    narrow.low = std::max(lower.value, lens_.e_low);
    const auto consider = [&](double width, double slope) {
      if (width < narrow.width || (width == narrow.width && slope < narrow.slope)) {
        narrow.width = width;
        narrow.slope = slope;
      }
    };
    consider(upper.value - lower.value, upper.q - lower.q);
    consider(upper.value - lens_.e_low, upper.q);
    consider(lens_.e_high - lower.value, -lower.q);
    return narrow;
  }

  /// The pair alpha + sharp N r - floor N/r.
  struct Facing {
    double width = kInfinity, alpha = 0.0, sharp = 0.0, floor = 0.0;
  };

  static std::optional<double> RatioOf(const Facing& facing, double n) {
    if (!(facing.floor > 0.0)) return facing.sharp > 0.0 ? std::max(-facing.alpha / (facing.sharp * n), 0.0) : 0.0;
    if (!(facing.sharp > 0.0)) {
      if (!(facing.alpha > 0.0)) return std::nullopt;
      return facing.floor * n / facing.alpha;
    }
    const double root = std::sqrt(facing.alpha * facing.alpha + 4.0 * facing.floor * facing.sharp * n * n);
    if (facing.alpha > 0.0) return 2.0 * facing.floor * n / (facing.alpha + root);
    return (root - facing.alpha) / (2.0 * facing.sharp * n);
  }

  Facing FacingAt(double n, double r, double& high, double& low) const {
    const double t = n * r, u = r > 0.0 ? n / r : 0.0;
    Line sharp_upper{kInfinity, 0, 0}, floor_upper{kInfinity, 0, 0}, sharp_lower{-kInfinity, 0, 0},
        floor_lower{-kInfinity, 0, 0};
    Extreme<1>(lines_.upper, 0, lines_.upper.sharp, t, sharp_upper);
    Extreme<1>(lines_.upper, lines_.upper.sharp, lines_.upper.rows, u, floor_upper);
    Extreme<-1>(lines_.lower, 0, lines_.lower.sharp, t, sharp_lower);
    Extreme<-1>(lines_.lower, lines_.lower.sharp, lines_.lower.rows, u, floor_lower);
    const bool upper_sharp = sharp_upper.value<floor_upper.value, lower_sharp = sharp_lower.value> floor_lower.value;
    const Line& upper = upper_sharp ? sharp_upper : floor_upper;
    const Line& lower = lower_sharp ? sharp_lower : floor_lower;
    Facing best;
    const auto consider = [&](bool has_upper, bool has_lower) {
      const double top = has_upper ? upper.value : lens_.e_high, bottom = has_lower ? lower.value : lens_.e_low;
      if (!(top - bottom < best.width)) return;
      best = {top - bottom, (has_upper ? upper.p : lens_.e_high) - (has_lower ? lower.p : lens_.e_low), 0.0, 0.0};
      if (has_upper) (upper_sharp ? best.sharp : best.floor) += std::abs(upper.q);
      if (has_lower) (lower_sharp ? best.sharp : best.floor) += std::abs(lower.q);
    };
    consider(true, true);
    consider(true, false);
    consider(false, true);
    high = std::min(upper.value, lens_.e_high);
    low = std::max(lower.value, lens_.e_low);
    return best;
  }

  /// The e and the ratio at settled.n. At a vertex past n_low the ratio is 1.
  void Finish(Settled& settled) const {
    constexpr double kPart = 2e-12;
    const double n = settled.n;
    if (lines_.upper.rows + lines_.lower.rows == 0) {
      settled.e = (lens_.e_low + lens_.e_high) / 2.0;
      return;
    }
    if (Error(n) > kPart * lines_.q_least * n) {
      settled.verdict = Verdict::Unsure;
      return;
    }
    double high = 0.0, low = 0.0, ratio = 1.0;
    Facing facing = FacingAt(n, 1.0, high, low);
    if (n == lens_.n_low) {
      // From the left: the zero of any pair is not above the least ratio.
      const std::optional<double> first = RatioOf(facing, n);
      double start = first ? *first : 0.0;
      const auto raise = [&](const Side& side, double box, double sign) {
        if (side.sharp == side.rows) return;
        const double alpha = sign * (side.p[side.sharp] - box);
        if (alpha > 0.0) start = std::max(start, std::abs(side.q[side.sharp]) * n / alpha);
      };
      raise(lines_.upper, lens_.e_low, 1.0);
      raise(lines_.lower, lens_.e_high, -1.0);
      ratio = start;
      constexpr int kMostSteps = 100;
      for (int step = 0; step < kMostSteps; ++step) {
        facing = FacingAt(n, ratio, high, low);
        if (!(facing.width < 0.0)) break;
        const std::optional<double> next = RatioOf(facing, n);
        if (!next || !(*next > ratio * (1.0 + 2.0 * kEpsilon))) break;
        ratio = *next;
      }
    }
    settled.ratio = ratio;
    settled.e = std::clamp(high < low ? (high + low) / 2.0 : low, lens_.e_low, lens_.e_high);
  }

  const ColumnLens& lens_;
  const Lines& lines_;
  double unit_ = 0.0, size_ = 0.0, box_error_ = 0.0;
};

/// The limits broken at (n, e) with sharp limits times r and blurred ones over r, the worst of each block.
class Checker {
 public:
  Checker(const ColumnLens& lens, double n, double e, double r) {
    const double f = lens.focal_length, delta = lens.sensor_tolerance;
    out_ = e + delta;
    out_by_u_ = f * (f + out_);
    in_ = e - delta;
    in_by_u_ = f * (f + in_);
    sharp_reach_ = n * r * (1.0 - lens.f_number_tolerance);
    blurred_reach_ = n / r * (1.0 + lens.f_number_tolerance);
    constexpr double kUlps = 8.0;
    slack_ = kUlps * kEpsilon * (std::abs(e) + delta);
  }

  /// `near` is not read for Front, `far` not for Behind.
  template <LimitIndex::Kind kind>
  void Collect(const double* near, const double* far, std::span<const double> limit,
               std::vector<LimitIndex>& broken) const {
    constexpr std::size_t kBlock = 512;
    const Doubles d;
    const hn::CappedTag<double, 1> one;
    const std::size_t lanes = hn::Lanes(d);
    for (std::size_t start = 0; start < limit.size(); start += kBlock) {
      const std::size_t end = std::min(limit.size(), start + kBlock);
      Vec first = hn::Set(d, slack_), second = first;
      std::size_t i = start;
      for (; i + 2 * lanes <= end; i += 2 * lanes) {
        first = hn::Max(Excess<kind>(d, near + i, far + i, limit.data() + i), first);
        second = hn::Max(Excess<kind>(d, near + i + lanes, far + i + lanes, limit.data() + i + lanes), second);
      }
      double most = BeyondAll<-1>(hn::Max(first, second));
      for (; i < end; ++i) {
        most = std::max(most, hn::GetLane(Excess<kind>(one, near + i, far + i, limit.data() + i)));
      }
      if (!(most > slack_)) continue;
      for (i = start; i < end; ++i) {
        if (!(hn::GetLane(Excess<kind>(one, near + i, far + i, limit.data() + i)) < most)) break;
      }
      if (i < end) broken.push_back({kind, static_cast<std::uint32_t>(i)});
    }
  }

 private:
  template <LimitIndex::Kind kind, class D>
  HWY_INLINE hn::Vec<D> Excess(D d, const double* near, const double* far, const double* limit) const {
    const auto out = hn::Set(d, out_), in = hn::Set(d, in_);
    const auto blur_out = [&](const double* u) HWY_ATTR { return hn::Mul(hn::Set(d, out_by_u_), hn::LoadU(d, u)); };
    const auto blur_in = [&](const double* u) HWY_ATTR { return hn::Mul(hn::Set(d, in_by_u_), hn::LoadU(d, u)); };
    const auto reach =
        hn::Mul(hn::Set(d, kind == LimitIndex::Sharp ? sharp_reach_ : blurred_reach_), hn::LoadU(d, limit));
    if constexpr (kind == LimitIndex::Sharp) {
      return hn::Sub(hn::Max(hn::Sub(out, blur_out(far)), hn::Sub(blur_in(near), in)), reach);
    } else if constexpr (kind == LimitIndex::Behind) {
      return hn::Sub(reach, hn::Sub(in, blur_in(near)));
    } else {
      return hn::Sub(reach, hn::Sub(blur_out(far), out));
    }
  }

  double out_, out_by_u_, in_, in_by_u_, sharp_reach_, blurred_reach_, slack_;
};

Settled SolveColumns(const ColumnLens& lens, const LimitColumns& limits, double* room) {
  const std::size_t count = limits.sharp_limit.size() + limits.behind_limit.size() + limits.front_limit.size();
  Writer writer(lens, room, count);
  return Solver(lens, writer.Write(limits)).SmallestN();
}

void CollectBroken(const ColumnLens& lens, const LimitColumns& limits, double n, double e, double r,
                   std::vector<LimitIndex>& broken) {
  const Checker checker(lens, n, e, r);
  checker.Collect<LimitIndex::Sharp>(limits.sharp_near.data(), limits.sharp_far.data(), limits.sharp_limit, broken);
  checker.Collect<LimitIndex::Behind>(limits.behind_near.data(), limits.behind_near.data(), limits.behind_limit,
                                      broken);
  checker.Collect<LimitIndex::Front>(limits.front_far.data(), limits.front_far.data(), limits.front_limit, broken);
}

}  // namespace lensd::optics::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lensd::optics {

HWY_EXPORT(SolveColumns);
HWY_EXPORT(CollectBroken);

Settled SolveColumns(const ColumnLens& lens, const LimitColumns& limits, double* room) {
  return HWY_DYNAMIC_DISPATCH(SolveColumns)(lens, limits, room);
}

void CollectBroken(const ColumnLens& lens, const LimitColumns& limits, double n, double e, double r,
                   std::vector<LimitIndex>& broken) {
  HWY_DYNAMIC_DISPATCH(CollectBroken)(lens, limits, n, e, r, broken);
}

}  // namespace lensd::optics
#endif  // HWY_ONCE
