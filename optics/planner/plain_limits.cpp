// One pass over the limits checks them and writes their lines; a second one, the report's, is all that follows. Limits
// of all kinds come in any order, which no processor guesses: so every limit writes the lines of both kinds, and keeps
// its own. Whatever is not plain is left to the way that takes everything, side_assignments.h.
#include "optics/planner/plain_limits.h"

#include <algorithm>
#include <limits>

#include "optics/planner/limit_names.h"

namespace lensd::optics {

namespace {

/// A depth as (Z, 1) or (1, U).
struct PlainDepth {
  double scale, u;
};

/// The ends of a plain interval.
struct PlainInterval {
  PlainDepth far, near;
};

/// Nothing where an end may be at or inside the focal length, or the ends may be the same or not.
std::optional<PlainInterval> PlainIntervalOf(const DepthInterval& interval, double f) {
  const auto& [one, other] = interval;
  constexpr double kUlps = 8.0 * std::numeric_limits<double>::epsilon(), kClear = 1.0 - 1e-9;
  constexpr double kMost = std::numeric_limits<double>::max();
  const double low = std::min(one.number.value, other.number.value);
  const double high = std::max(one.number.value, other.number.value);
  const bool same = one.number.value == other.number.value && one.number.decimal == other.number.decimal;
  if (one.is_vergence != other.is_vergence || !(same || high > low * (1.0 + kUlps))) return std::nullopt;
  if (one.is_vergence) {
    if (!(low >= 0.0 && f * high < kClear)) return std::nullopt;
    return PlainInterval{{1.0, low}, {1.0, high}};
  }
  if (!(low * kClear > f)) return std::nullopt;
  const auto distance = [](double z) { return z < kMost ? PlainDepth{z, 1.0} : PlainDepth{1.0, 0.0}; };
  return PlainInterval{distance(high), distance(low)};
}

/// Lines that bound e from one side, sharp ones from the front, the others from the back until all are there.
class LinesInTheMaking {
 public:
  LinesInTheMaking(std::span<double> p, std::span<double> q, std::span<int> name)
      : p_(p), q_(q), name_(name), next_{0, p.size() - 1} {}
  /// Keeps it where `step` is not 0: 1 for a sharp one, -1 for another.
  void Put(double p, double q, int name, bool sharp, int step) {
    std::size_t& next = next_[sharp ? 0 : 1];
    p_[next] = p, q_[next] = q, name_[next] = name;
    next += static_cast<std::size_t>(step);
  }
  /// Brings the others after the sharp ones; how many there are of all.
  std::size_t Close() {
    const auto close = [&](auto column) {
      const auto from = column.begin() + static_cast<std::ptrdiff_t>(next_[1] + 1);
      std::reverse(from, column.end());
      std::copy(from, column.end(), column.begin() + static_cast<std::ptrdiff_t>(sharp()));
    };
    close(p_), close(q_), close(name_);
    return sharp() + p_.size() - (next_[1] + 1);
  }
  std::size_t sharp() const { return next_[0]; }

 private:
  std::span<double> p_, q_;
  std::span<int> name_;
  std::array<std::size_t, 2> next_;
};

/// False where a limit is not plain, or makes no sense.
bool WritePlainLimits(const PlanRequest& request, LinearProgram<double>& programme) {
  const std::size_t count = request.limits.size();
  programme.Resize(count, count);
  LinesInTheMaking upper(programme.upper_p, programme.upper_q, programme.upper_name);
  LinesInTheMaking lower(programme.lower_p, programme.lower_q, programme.lower_name);
  LimitNames names(request.limits);
  const double f = programme.lens.f, delta = programme.lens.delta;
  const double narrow = programme.lens.narrow, widen = programme.lens.widen;
  struct Kind {
    double reach;  ///< of its upper line, in limits
    int upper, lower;
  };
  const std::array<Kind, 3> kinds{{{narrow, 1, 1}, {-widen, 0, -1}, {-widen, -1, 0}}};  // sharp, behind, front
  for (std::size_t i = 0; i < count; ++i) {
    const BlurLimit& limit = request.limits[i];
    const bool sharp = limit.kind == LimitKind::Sharp;
    const double least = limit.limit.value;
    if (!names.Take(i) || limit.depths.size() != 1 || IsOpen(limit)) return false;
    if (!(least > 0.0 && least <= std::numeric_limits<double>::max())) return false;
    const std::optional<PlainInterval> depths = PlainIntervalOf(limit.depths.front(), f);
    if (!depths) return false;
    const auto& [far, near] = *depths;
    const Kind& kind = kinds[KindIndex(limit)];
    const double reach = least * kind.reach;
    const double far_w = far.scale - f * far.u, near_w = near.scale - f * near.u;
    const int name = static_cast<int>(i);
    upper.Put(f * f * far.u / far_w - delta, reach * far.scale / far_w, name, sharp, kind.upper);
    lower.Put(f * f * near.u / near_w + delta, -reach * near.scale / near_w, name, sharp, kind.lower);
  }
  if (count > 0) programme.Shorten(upper.Close(), lower.Close());
  programme.Use(upper.sharp(), lower.sharp());
  return true;
}

}  // namespace

Attempt<Solution> SolvePlainLimits(const PlanRequest& request) {
  if (request.wavelength || request.liquid || request.pupil_factor.value != 1.0 || !request.stops.empty() ||
      request.objective == Objective::Depth) {
    return {};
  }
  LinearProgram<double> programme;
  WriteLens(programme, {.request = &request, .focus_binds = request.focus.has_value()}, ToDouble);
  if (!WritePlainLimits(request, programme)) return {};
  Attempt<Solution> solved = TrySolveForN(programme, WantedN::Smallest);
  if (request.objective != Objective::Sharp || !solved.answer.feasible || !solved.certain) return solved;
  const Attempt<std::optional<Solution>> sharpest = TrySolveForRatio(programme);
  return {sharpest.answer.value_or(solved.answer), sharpest.certain};
}

}  // namespace lensd::optics
