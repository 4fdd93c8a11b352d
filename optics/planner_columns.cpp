// Smallest N over columns. The method is that of planner_strip.h, laid out for speed: one division a line, lines in
// plain arrays scanned in vectors, and every step from the left taken a hair beyond the zero of the narrowest pair, so
// that the scan that ends the search is also its proof.
//
// Many limits: few of them matter. A sample is solved, every limit is tried on its solution (without a division), and
// the ones it breaks most, one of each block, join the sample; with 2,048 to start from two or three rounds settle it.
#include "optics/planner_columns.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "planner_columns_exact.h"

namespace lensd::optics {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

using Two = double __attribute__((vector_size(16)));

Two Load(const double* from) {
  Two v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}

void Store(double* to, Two v) {
  __builtin_memcpy(to, &v, sizeof v);
}

template <int sign>
Two Beyond(Two a, Two b) {
  return sign > 0 ? (a < b ? a : b) : (a > b ? a : b);
}

/// Lines e <= p + q t (or >=); `rows` of them, padded to a multiple of four with lines that bind nothing.
struct Side {
  double* p = nullptr;
  double* q = nullptr;
  std::size_t sharp = 0;  ///< rows of sharp limits, padded; the blurred ones follow
  std::size_t rows = 0;
};

struct Line {
  double value = 0.0, p = 0.0, q = 0.0;
};

/// sign +1: the lowest line, -1: the highest. [from, to) in multiples of four.
template <int sign>
void Extreme(const Side& side, std::size_t from, std::size_t to, double t, Line& best) {
  if (from == to) return;
  const Two at = {t, t};
  Two first = {best.value, best.value}, second = first;
  for (std::size_t i = from; i < to; i += 4) {
    first = Beyond<sign>(Load(side.p + i) + Load(side.q + i) * at, first);
    second = Beyond<sign>(Load(side.p + i + 2) + Load(side.q + i + 2) * at, second);
  }
  first = Beyond<sign>(first, second);
  const double value = sign > 0 ? std::min(first[0], first[1]) : std::max(first[0], first[1]);
  if (value == best.value) return;
  for (std::size_t i = from; i < to; ++i) {
    if (side.p[i] + side.q[i] * t != value) continue;
    best = {value, side.p[i], side.q[i]};
    return;
  }
}

struct Lines {
  Side upper, lower;
  double p_size = 0.0, q_size = 0.0, q_least = kInfinity;  ///< largest |p|, |q|; smallest |q|
};

/// Writes lines into given arrays of at least 2 (limits + 8) doubles each side and column.
class Writer {
 public:
  Writer(const ColumnLens& lens, double* room, std::size_t capacity) : lens_(lens) {
    lines_.upper = {room, room + capacity, 0, 0};
    lines_.lower = {room + 2 * capacity, room + 3 * capacity, 0, 0};
  }

  void Sharp(double near, double far, double limit) {
    const double narrow = 1.0 - lens_.f_number_tolerance;
    Add(lines_.upper, far, limit * narrow, -lens_.sensor_tolerance);
    Add(lines_.lower, near, -limit * narrow, lens_.sensor_tolerance);
  }
  /// The same for whole columns, two lines at a time.
  void Sharp(std::span<const double> near, std::span<const double> far, std::span<const double> limit) {
    const double narrow = 1.0 - lens_.f_number_tolerance;
    Add(lines_.upper, far, limit, narrow, -lens_.sensor_tolerance);
    Add(lines_.lower, near, limit, -narrow, lens_.sensor_tolerance);
    EndSharp();
  }
  void EndSharp() {
    Pad(lines_.upper, kInfinity);
    Pad(lines_.lower, -kInfinity);
    lines_.upper.sharp = lines_.upper.rows;
    lines_.lower.sharp = lines_.lower.rows;
  }
  void Behind(double near, double limit) {
    Add(lines_.lower, near, limit * (1.0 + lens_.f_number_tolerance), lens_.sensor_tolerance);
  }
  void Front(double far, double limit) {
    Add(lines_.upper, far, -limit * (1.0 + lens_.f_number_tolerance), -lens_.sensor_tolerance);
  }
  void Behind(std::span<const double> near, std::span<const double> limit) {
    Add(lines_.lower, near, limit, 1.0 + lens_.f_number_tolerance, lens_.sensor_tolerance);
  }
  void Front(std::span<const double> far, std::span<const double> limit) {
    Add(lines_.upper, far, limit, -1.0 - lens_.f_number_tolerance, -lens_.sensor_tolerance);
  }
  const Lines& End() {
    Pad(lines_.upper, kInfinity);
    Pad(lines_.lower, -kInfinity);
    return lines_;
  }

 private:
  void Add(Side& side, double u, double reach, double shift) {
    const double f = lens_.focal_length;
    const double inverse = 1.0 / (1.0 - f * u);
    const double p = f * f * u * inverse, q = reach * inverse;
    side.p[side.rows] = p + shift;
    side.q[side.rows++] = q;
    lines_.p_size = std::max(lines_.p_size, p);
    lines_.q_size = std::max(lines_.q_size, std::abs(q));
    lines_.q_least = std::min(lines_.q_least, std::abs(q));
  }
  void Add(Side& side, std::span<const double> u, std::span<const double> limit, double factor, double shift) {
    const double f = lens_.focal_length;
    Two p_size = {lines_.p_size, lines_.p_size}, q_size = {lines_.q_size, lines_.q_size};
    Two q_least = {lines_.q_least, lines_.q_least};
    double* const p_to = side.p + side.rows;
    double* const q_to = side.q + side.rows;
    std::size_t i = 0;
    for (; i + 2 <= u.size(); i += 2) {
      const Two at = Load(u.data() + i);
      const Two inverse = 1.0 / (1.0 - f * at);
      const Two p = f * f * at * inverse, q = Load(limit.data() + i) * factor * inverse;
      const Two q_magnitude = q > -q ? q : -q;
      Store(p_to + i, p + shift);
      Store(q_to + i, q);
      p_size = Beyond<-1>(p, p_size);
      q_size = Beyond<-1>(q_magnitude, q_size);
      q_least = Beyond<1>(q_magnitude, q_least);
    }
    side.rows += i;
    lines_.p_size = std::max(p_size[0], p_size[1]);
    lines_.q_size = std::max(q_size[0], q_size[1]);
    lines_.q_least = std::min(q_least[0], q_least[1]);
    for (; i < u.size(); ++i) Add(side, u[i], limit[i] * factor, shift);
  }
  static void Pad(Side& side, double bound) {
    for (; side.rows % 4 != 0; ++side.rows) {
      side.p[side.rows] = bound;
      side.q[side.rows] = 0.0;
    }
  }

  const ColumnLens& lens_;
  Lines lines_;
};

enum class Verdict { Feasible, Infeasible, Unsure };

struct Settled {
  Verdict verdict = Verdict::Unsure;
  double n = 0.0, e = 0.0, ratio = 0.0;
  double beyond = 0.0, inside = 0.0;  ///< a point (N, e) a hair inside, all of whose limits hold for certain
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

/// A limit in a working set.
struct Index {
  std::uint32_t kind;  ///< 0 sharp, 1 behind, 2 front
  std::uint32_t row;
};

void WriteLimit(Writer& writer, const LimitColumns& limits, Index index) {
  const std::size_t i = index.row;
  if (index.kind == 0) writer.Sharp(limits.sharp_near[i], limits.sharp_far[i], limits.sharp_limit[i]);
  if (index.kind == 1) writer.Behind(limits.behind_near[i], limits.behind_limit[i]);
  if (index.kind == 2) writer.Front(limits.front_far[i], limits.front_limit[i]);
}

Settled SolveSome(const ColumnLens& lens, const LimitColumns& limits, std::vector<Index>& chosen) {
  std::sort(chosen.begin(), chosen.end(), [](Index a, Index b) { return a.kind < b.kind; });
  const std::size_t capacity = chosen.size() + 8;
  std::vector<double> room(4 * capacity);
  Writer writer(lens, room.data(), capacity);
  std::size_t i = 0;
  for (; i < chosen.size() && chosen[i].kind == 0; ++i) WriteLimit(writer, limits, chosen[i]);
  writer.EndSharp();
  for (; i < chosen.size(); ++i) WriteLimit(writer, limits, chosen[i]);
  return Solver(lens, writer.End()).SmallestN();
}

/// The limits broken at (n, e) with sharp limits times r and blurred ones over r, the worst of each block.
class Checker {
 public:
  Checker(const ColumnLens& lens, const LimitColumns& limits, double n, double e, double r) : limits_(limits) {
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

  void Collect(std::vector<Index>& broken) const {
    Blocks(limits_.sharp_limit.size(), 0, broken, [&](auto load, std::size_t i) {
      const auto far = out_ - out_by_u_ * load(limits_.sharp_far, i);
      const auto near = in_by_u_ * load(limits_.sharp_near, i) - in_;
      return (far > near ? far : near) - sharp_reach_ * load(limits_.sharp_limit, i);
    });
    Blocks(limits_.behind_limit.size(), 1, broken, [&](auto load, std::size_t i) {
      return blurred_reach_ * load(limits_.behind_limit, i) - (in_ - in_by_u_ * load(limits_.behind_near, i));
    });
    Blocks(limits_.front_limit.size(), 2, broken, [&](auto load, std::size_t i) {
      return blurred_reach_ * load(limits_.front_limit, i) - (out_by_u_ * load(limits_.front_far, i) - out_);
    });
  }

 private:
  template <class Excess>
  void Blocks(std::size_t count, std::uint32_t kind, std::vector<Index>& broken, const Excess& excess) const {
    constexpr std::size_t kBlock = 512;
    const auto two = [](std::span<const double> column, std::size_t i) { return Load(column.data() + i); };
    const auto one = [](std::span<const double> column, std::size_t i) { return column[i]; };
    for (std::size_t start = 0; start < count; start += kBlock) {
      const std::size_t end = std::min(count, start + kBlock);
      Two first = {slack_, slack_}, second = first;
      std::size_t i = start;
      for (; i + 4 <= end; i += 4) {
        first = Beyond<-1>(excess(two, i), first);
        second = Beyond<-1>(excess(two, i + 2), second);
      }
      first = Beyond<-1>(first, second);
      double most = std::max(first[0], first[1]);
      for (; i < end; ++i) most = std::max(most, excess(one, i));
      if (!(most > slack_)) continue;
      for (i = start; i < end && excess(one, i) < most; ++i) {
      }
      if (i < end) broken.push_back({kind, static_cast<std::uint32_t>(i)});
    }
  }

  const LimitColumns& limits_;
  double out_, out_by_u_, in_, in_by_u_, sharp_reach_, blurred_reach_, slack_;
};

std::size_t CountOf(const LimitColumns& limits) {
  return limits.sharp_limit.size() + limits.behind_limit.size() + limits.front_limit.size();
}

std::vector<Index> Sample(const LimitColumns& limits) {
  constexpr std::size_t kSample = 2048;
  const std::array<std::size_t, 3> counts{limits.sharp_limit.size(), limits.behind_limit.size(),
                                          limits.front_limit.size()};
  const std::size_t all = counts[0] + counts[1] + counts[2];
  std::vector<Index> sample;
  std::uint64_t random = 0x9E3779B97F4A7C15u;
  for (std::uint32_t kind = 0; kind < 3; ++kind) {
    const std::size_t count = counts[kind], wanted = std::min(count, kSample * count / all + 16);
    for (std::size_t i = 0; i < wanted; ++i) {
      random = random * 6364136223846793005u + 1442695040888963407u;
      sample.push_back({kind, static_cast<std::uint32_t>((random >> 33) % count)});
    }
  }
  return sample;
}

ColumnPlan Exactly(const ColumnLens& lens, const LimitColumns& limits) {
  return PlanColumnsExactly(lens, limits);
}

ColumnPlan PlanMany(const ColumnLens& lens, const LimitColumns& limits) {
  std::vector<Index> chosen = Sample(limits);
  constexpr int kMostRounds = 60;
  for (int round = 0; round < kMostRounds; ++round) {
    const Settled settled = SolveSome(lens, limits, chosen);
    if (settled.verdict == Verdict::Infeasible) return {};
    if (settled.verdict == Verdict::Unsure) break;
    // Past n_low the vertex itself is on the verge: what must hold is the point a hair inside.
    const bool vertex = settled.n != lens.n_low;
    std::vector<Index> broken;
    Checker(lens, limits, vertex ? settled.beyond : settled.n, vertex ? settled.inside : settled.e,
            vertex ? 1.0 : settled.ratio)
        .Collect(broken);
    if (broken.empty()) return {true, settled.n, settled.e, settled.ratio};
    chosen.insert(chosen.end(), broken.begin(), broken.end());
  }
  return Exactly(lens, limits);
}

}  // namespace

ColumnPlan PlanColumns(const ColumnLens& lens, const LimitColumns& limits) {
  constexpr std::size_t kFew = 128, kRoom = kFew + 8;
  if (CountOf(limits) > kFew) return PlanMany(lens, limits);
  std::array<double, 4 * kRoom> room;  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  Writer writer(lens, room.data(), kRoom);
  writer.Sharp(limits.sharp_near, limits.sharp_far, limits.sharp_limit);
  writer.Behind(limits.behind_near, limits.behind_limit);
  writer.Front(limits.front_far, limits.front_limit);
  const Settled settled = Solver(lens, writer.End()).SmallestN();
  if (settled.verdict == Verdict::Unsure) return Exactly(lens, limits);
  return {settled.verdict == Verdict::Feasible, settled.n, settled.e, settled.ratio};
}

Extremes ExtremesOf(std::span<const double> values) {
  std::array<Two, 4> least, greatest;
  least.fill(Two{kInfinity, kInfinity});
  greatest.fill(Two{-kInfinity, -kInfinity});
  std::size_t i = 0;
  for (; i + 8 <= values.size(); i += 8) {
    for (std::size_t lane = 0; lane < 4; ++lane) {
      const Two v = Load(values.data() + i + 2 * lane);
      least[lane] = Beyond<1>(v, least[lane]);
      greatest[lane] = Beyond<-1>(v, greatest[lane]);
    }
  }
  Extremes extremes{kInfinity, -kInfinity};
  for (std::size_t lane = 0; lane < 4; ++lane) {
    extremes.least = std::min({extremes.least, least[lane][0], least[lane][1]});
    extremes.greatest = std::max({extremes.greatest, greatest[lane][0], greatest[lane][1]});
  }
  for (; i < values.size(); ++i) {
    extremes.least = std::min(extremes.least, values[i]);
    extremes.greatest = std::max(extremes.greatest, values[i]);
  }
  return extremes;
}

namespace {

/// Samples that do not count become 65535 for the nearest and 0 for the farthest: no branch. One subtraction turns the
/// unknown depth 0 into 65535, so that one comparison serves for the nearest.
template <bool masked>
DepthExtremes ExtremesWhere(std::span<const std::uint16_t> depths, std::span<const std::uint16_t> classes,
                            std::uint16_t wanted) {
  using Samples = std::uint16_t __attribute__((vector_size(16)));
  constexpr std::size_t kLanes = sizeof(Samples) / sizeof(std::uint16_t), kChains = 2;
  const auto load = [](std::span<const std::uint16_t> from, std::size_t i) {
    Samples samples;
    __builtin_memcpy(&samples, from.data() + i, sizeof samples);
    return samples;
  };
  std::array<Samples, kChains> least, greatest;
  least.fill(~Samples{});
  greatest.fill(Samples{});
  std::size_t i = 0;
  for (; i + kChains * kLanes <= depths.size(); i += kChains * kLanes) {
    for (std::size_t chain = 0; chain < kChains; ++chain) {
      const std::size_t at = i + chain * kLanes;
      Samples depth = load(depths, at);
      if constexpr (masked) depth &= (Samples)(load(classes, at) == wanted);
      const Samples known = depth - 1;
      least[chain] = known < least[chain] ? known : least[chain];
      greatest[chain] = depth > greatest[chain] ? depth : greatest[chain];
    }
  }
  std::uint16_t nearest = 65535, farthest = 0;
  const auto take = [&](std::uint16_t below, std::uint16_t depth) {
    nearest = std::min(nearest, below);
    farthest = std::max(farthest, depth);
  };
  for (std::size_t chain = 0; chain < kChains; ++chain) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) take(least[chain][lane], greatest[chain][lane]);
  }
  for (; i < depths.size(); ++i) {
    const std::uint16_t depth = !masked || classes[i] == wanted ? depths[i] : std::uint16_t{0};
    take(static_cast<std::uint16_t>(depth - 1), depth);
  }
  if (farthest == 0) return {};
  return {static_cast<std::uint16_t>(nearest + 1), farthest};
}

}  // namespace

DepthExtremes ExtremesOfClass(std::span<const std::uint16_t> depths, std::span<const std::uint16_t> classes,
                              std::uint16_t wanted) {
  return ExtremesWhere<true>(depths, classes, wanted);
}

DepthExtremes ExtremesOfDepths(std::span<const std::uint16_t> depths) {
  return ExtremesWhere<false>(depths, {}, 0);
}

}  // namespace lensd::optics
