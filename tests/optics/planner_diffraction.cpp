// The planner's problem with diffraction in eighty digits: over the f-number by ternary search of the concave width,
// which is sound while limits are small next to the focal length over the f-number.
#include "planner_diffraction.h"

#include <algorithm>
#include <cmath>

#include "planner_reference.h"

namespace lensd::optics::reference {
namespace {

/// Exact ties come out with an error this small, relative to what is compared.
const Real kTie("1e-70");

/// Whether the concave width is certainly below zero all over [a, b], from its values at a < left < right: chords,
/// prolonged, lie above it.
bool NothingBetween(const Real& a, const Real& b, const Real& left, const Real& right, const Left& at_a,
                    const Left& at_left, const Left& at_right) {
  const Real slope = (at_right.width() - at_left.width()) / (right - left);
  const Real before = (at_left.width() - at_a.width()) / (left - a);
  const Real most = std::max({Real(at_left.width() - slope * (left - a)), Real(at_right.width() + slope * (b - right)),
                              Real(at_left.width() + before * (right - left)), at_left.width()});
  const Real margin = abs(at_left.low) + abs(at_left.high) + abs(at_right.low) + abs(at_right.high);
  return most < -1000 * kTie * margin;
}

/// Whether some f-number of [a, b] leaves something, by ternary search of the concave width.
bool SomeLeaves(const LinearProgram& programme, const Optics& o, Real a, Real b, const Real& ratio) {
  auto at_a = LeftAt(programme, o, a, ratio);
  if (Leaves(at_a)) return true;
  Real largest = 0;
  for (const Wall& wall : programme.walls) {
    if (wall.kind == Wall::Kind::Sharp) largest = std::max(largest, Real(wall.size * ratio));
  }
  const Real concave_up_to =
      largest > 0 ? Real(Real("0.355") * o.f * std::min(o.pupil, Real(1)) / (largest * (1 + o.epsilon))) : b;
  for (int i = 0; i < 220 && b - a > Real("1e-55") * b; ++i) {
    const Real left = a + (b - a) / 3, right = b - (b - a) / 3;
    const auto at_left = LeftAt(programme, o, left, ratio), at_right = LeftAt(programme, o, right, ratio);
    if (Leaves(at_left) || Leaves(at_right)) return true;
    const bool known = at_a && at_left && at_right && b <= concave_up_to;
    if (known && NothingBetween(a, b, left, right, *at_a, *at_left, *at_right)) return false;
    if (!at_left) {
      b = left;
    } else if (!at_right || at_left->width() > at_right->width()) {
      b = right;
    } else {
      a = left;
      at_a = at_left;
    }
  }
  return Leaves(LeftAt(programme, o, b, ratio));
}

/// The largest f-number at which the width is concave for sure, c N/f <= 0.3.
Real ConcaveUpTo(const PlanRequest& request, const Optics& o, const Names& names) {
  Real most = 10000;
  for (const BlurLimit& limit : request.limits) {
    if (limit.kind != LimitKind::Sharp || !names.contains(limit.name)) continue;
    most = std::min(most, Real(3 * o.f / (10 * ToReal(limit.limit))));
  }
  return most;
}

}  // namespace

Real ToReal(const Number& number) {
  const Rational exact = Exact(number);
  return Real(numerator(exact)) / Real(denominator(exact));
}

Real Vergence80(const PlanDepth& depth) {
  if (depth.is_vergence) return ToReal(depth.number);
  return std::isinf(depth.number.value) ? Real(0) : Real(1 / ToReal(depth.number));
}

Names AllNames(const PlanRequest& request) {
  Names names{"fNumber", "extension"};
  if (request.focus) names.insert("focus");
  for (const BlurLimit& limit : request.limits) names.insert(limit.name);
  return names;
}

std::optional<Left> LeftAt(const LinearProgram& programme, const Optics& o, const Real& n, const Real& ratio) {
  Left left{programme.low, programme.high};
  for (const Wall& wall : programme.walls) {
    const Real w = 1 / o.f - wall.u, fu = o.f * wall.u, g = o.Skew(wall.u);
    if (wall.kind == Wall::Kind::Sharp) {
      for (const Real& held : {Real(n * (1 - o.epsilon)), Real(n * (1 + o.epsilon))}) {
        // (s w e - s f u)² + (d e/p + d f)² <= c² with s = f/(N g), d = λ' N/f: a quadratic in e
        const Real c = wall.size * ratio, s = o.f / (held * g), d = o.lambda * held / o.f;
        const Real a = s * s * w * w + d * d / (o.pupil * o.pupil);
        const Real middle = s * s * w * fu - d * d * o.f / o.pupil;
        const Real apart = s * d * o.f * (w + wall.u / o.pupil);
        const Real root = a * c * c - apart * apart;
        if (root < 0) return std::nullopt;
        left.low = std::max(left.low, Real((middle - sqrt(root)) / a + o.delta));
        left.high = std::min(left.high, Real((middle + sqrt(root)) / a - o.delta));
      }
    } else {
      const Real reach = wall.size * (1 + o.epsilon) / ratio * n * g / o.f;  // e w - f u = ± reach
      const bool behind = wall.kind == Wall::Kind::Behind;
      const Real edge = (fu + (behind ? reach : -reach)) / w;
      if (behind) left.low = std::max(left.low, Real(edge + o.delta));
      if (!behind) left.high = std::min(left.high, Real(edge - o.delta));
    }
  }
  return left;
}

bool Leaves(const std::optional<Left>& left) {
  if (!left) return false;
  return left->width() >= -kTie * std::max(abs(left->low), abs(left->high));
}

void ForEachProgramme(const PlanRequest& request, const Optics& o, const Names& names,
                      const std::function<void(const LinearProgram&)>& visit) {
  LinearProgram programme;
  const Real range_low = ToReal(request.extensions.low);
  programme.low = names.contains("extension") ? range_low : std::min(range_low, Real(0));
  programme.high = names.contains("extension") ? ToReal(request.extensions.high) : Real("1e9");
  if (request.focus && names.contains("focus")) {
    const Real u = Vergence80(*request.focus), e = o.f * o.f * u / (1 - o.f * u), tie = kTie * abs(e);
    if (e < programme.low - tie || e > programme.high + tie) return;
    programme.low = programme.high = e;
  }
  std::vector<const BlurLimit*> open;  // one entry an interval
  std::vector<const DepthInterval*> intervals;
  const auto add = [&](const BlurLimit& limit, const DepthInterval& interval, Wall::Kind kind) {
    for (const PlanDepth* end : {&interval.one_end, &interval.other_end}) {
      programme.walls.push_back({kind, Vergence80(*end), ToReal(limit.limit)});
    }
  };
  for (const BlurLimit& limit : request.limits) {
    if (!names.contains(limit.name)) continue;
    for (const DepthInterval& interval : limit.depths) {
      if (limit.kind == LimitKind::Blurred && limit.side == Side::Either) {
        open.push_back(&limit);
        intervals.push_back(&interval);
      } else {
        add(limit, interval,
            limit.kind == LimitKind::Sharp ? Wall::Kind::Sharp
            : limit.side == Side::Behind   ? Wall::Kind::Behind
                                           : Wall::Kind::Front);
      }
    }
  }
  const std::size_t given = programme.walls.size();
  for (std::uint32_t sides = 0; sides < 1u << open.size(); ++sides) {
    programme.walls.resize(given);
    for (std::size_t i = 0; i < open.size(); ++i) {
      add(*open[i], *intervals[i], (sides >> i & 1u) != 0 ? Wall::Kind::Behind : Wall::Kind::Front);
    }
    visit(programme);
  }
}

std::optional<bool> FeasibleExactly(const PlanRequest& request, const Names& names, const Real& ratio) {
  const Optics o(request);
  Real a = ToReal(request.f_numbers.low), b = ToReal(request.f_numbers.high);
  if (!names.contains("fNumber")) {
    a = Real("1e-36");
    b = ConcaveUpTo(request, o, names) / ratio;
    for (const BlurLimit& limit : request.limits) {  // larger ones must be ruled out by diffraction alone
      const bool sharp = limit.kind == LimitKind::Sharp && names.contains(limit.name);
      if (sharp && ToReal(limit.limit) * ratio > o.lambda * b / 2) return std::nullopt;
    }
  }
  bool feasible = false;
  ForEachProgramme(request, o, names, [&](const LinearProgram& programme) {
    if (feasible) return;
    if (request.stops.empty() || !names.contains("fNumber")) {
      feasible = SomeLeaves(programme, o, a, b, ratio);
      return;
    }
    for (const Number& stop : request.stops) feasible = feasible || Leaves(LeftAt(programme, o, ToReal(stop), ratio));
  });
  return feasible;
}

}  // namespace lensd::optics::reference
