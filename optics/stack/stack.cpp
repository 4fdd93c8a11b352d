// Looks for the f-number of a focus stack. At one f-number the greedy cover of stack_cover.h is the answer. Over a
// range it is a search in two steps: the fewest shots any f-number allows, then the smallest f-number that allows them.
// Both need to know of a whole stretch of f-numbers that none in it does better, and get it from the same greedy cover:
// for every depth take the highest and the lowest extension that *any* f-number of the stretch allows, cover with
// those, and no f-number of the stretch needs fewer shots. Halving stretches until they are decided finds the answer;
// without diffraction a larger f-number always allows more and the halving is a plain bisection.
#include "optics/stack.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "optics/conjugates.h"
#include "optics/planner/request_check.h"
#include "optics/stack/stack_cover.h"
#include "optics/stack/stack_exact.h"
#include "optics/stack/stack_reach.h"

namespace lensd::optics {
namespace {

using Needs = std::vector<Need<double>>;

Cover<double> CoverWith(const Needs& needs, const StackLens& lens, double n_low, double n_high,
                        std::size_t most_shots = kMostShots) {
  return GreedyCover(needs, StretchReach(lens, n_low, n_high), lens.low, lens.high, most_shots);
}

bool Within(const Needs& needs, const StackLens& lens, double n_low, double n_high, std::size_t shots) {
  return CoverWith(needs, lens, n_low, n_high, shots).end == CoverEnd::Covered;
}

/// The smallest f-number of [low, high] that needs at most `shots`; nothing where none does.
std::optional<double> SmallestN(const Needs& needs, const StackLens& lens, double low, double high, std::size_t shots) {
  if (!Within(needs, lens, low, high, shots)) return std::nullopt;
  if (Within(needs, lens, low, low, shots)) return low;
  constexpr double kResolution = 1e-14;
  if (high - low <= kResolution * high) {
    return Within(needs, lens, high, high, shots) ? std::optional(high) : std::nullopt;
  }
  const double middle = low + 0.5 * (high - low);
  if (const auto found = SmallestN(needs, lens, low, middle, shots)) return found;
  return SmallestN(needs, lens, middle, high, shots);
}

/// A question in plain numbers, and how to answer it exactly.
struct StackTask {
  const PlanRequest& request;
  StackLens lens;
  Needs needs;
  double n_low = 0;
  double n_high = 0;
};

/// The cover at one f-number that was given as a decimal. Where widening or narrowing everything by more than rounding
/// could have done changes the count, exact arithmetic decides (without diffraction; stacks beyond a few hundred shots
/// are left to double precision).
Cover<double> CertainCover(const StackTask& task, double n, const Number& stop) {
  Cover<double> cover = CoverWith(task.needs, task.lens, n, n);
  constexpr std::size_t kMostExactShots = 300;
  if (task.lens.airy > 0.0 || cover.extensions.size() > kMostExactShots) return cover;
  const auto shifted = [&](double side) {
    StackLens lens = task.lens;
    const double reach = std::abs(task.needs.back().near) + std::abs(lens.high) + std::abs(lens.low);
    lens.delta += side * (1e-12 * lens.delta + 1e-14 * reach);
    lens.low -= -side * 1e-14 * reach;
    lens.high += -side * 1e-14 * reach;
    const double m = n * (1.0 - side * 1e-12);
    return CoverWith(task.needs, lens, m, m);
  };
  const Cover<double> wide = shifted(-1.0);
  const Cover<double> narrow = shifted(1.0);
  if (wide.end == narrow.end && wide.extensions.size() == narrow.extensions.size()) return cover;
  return ExactCover(task.request, stop);
}

struct Found {
  double n = 0;
  Cover<double> cover;
};

bool Better(const Cover<double>& cover, const std::optional<Found>& found) {
  if (cover.end != CoverEnd::Covered) return false;
  return !found || cover.extensions.size() < found->cover.extensions.size();
}

/// Fewest shots over the stops, then the smallest of them.
std::optional<Found> FewestOverStops(const StackTask& task) {
  std::vector<Number> stops = task.request.stops;
  const double f = task.lens.f;
  const bool diameters = task.request.apertures_are_diameters;
  std::sort(stops.begin(), stops.end(),
            [&](const Number& a, const Number& b) { return diameters ? b.value < a.value : a.value < b.value; });
  std::optional<Found> found;
  for (const Number& stop : stops) {
    const double n = diameters ? f / stop.value : stop.value;
    if (n > task.n_high) continue;
    Cover<double> cover = CertainCover(task, n, stop);
    if (Better(cover, found)) found = Found{n, std::move(cover)};
  }
  return found;
}

/// Where diffraction and geometric blur share each limit alike: f-numbers that are likely to need few shots, so that
/// the search starts close to its end.
std::vector<double> LikelyBest(const StackTask& task) {
  std::vector<double> likely;
  if (task.lens.airy == 0.0) return likely;
  for (const Need<double>& need : task.needs) {
    const double share = need.limit / (std::numbers::sqrt2 * task.lens.airy * (1.0 + need.far / task.lens.scale));
    likely.push_back(std::clamp(share, task.n_low, task.n_high));
  }
  return likely;
}

/// Fewest shots over the range of f-numbers, then the smallest f-number.
std::optional<Found> FewestOverRange(const StackTask& task) {
  const bool diameters = task.request.apertures_are_diameters;
  const Number& last = diameters ? task.request.f_numbers.low : task.request.f_numbers.high;
  std::optional<Found> found;
  const Cover<double> at_end = CertainCover(task, task.n_high, last);
  if (Better(at_end, found)) found = Found{task.n_high, at_end};
  for (const double n : LikelyBest(task)) {
    const Cover<double> cover = CoverWith(task.needs, task.lens, n, n);
    if (Better(cover, found)) found = Found{n, cover};
  }
  for (;;) {
    const std::size_t fewer = found ? found->cover.extensions.size() - 1 : kMostShots;
    if (fewer == 0) break;
    const auto n = SmallestN(task.needs, task.lens, task.n_low, task.n_high, fewer);
    if (!n) break;
    found = Found{*n, CoverWith(task.needs, task.lens, *n, *n)};
  }
  if (!found) return found;
  const std::size_t shots = found->cover.extensions.size();
  if (const auto n = SmallestN(task.needs, task.lens, task.n_low, task.n_high, shots)) {
    found = Found{*n, CoverWith(task.needs, task.lens, *n, *n)};
  }
  return found;
}

StackCause CauseOf(CoverEnd end) {
  switch (end) {
    case CoverEnd::TooFar:
      return StackCause::TooFar;
    case CoverEnd::TooNear:
      return StackCause::TooNear;
    case CoverEnd::Tolerance:
      return StackCause::Tolerance;
    case CoverEnd::Covered:
      return StackCause::Diffraction;
    case CoverEnd::TooMany:
      break;
  }
  return StackCause::TooMany;
}

StackAnswer Impossible(StackCause cause, std::string reason) {
  return {false, {}, cause, std::move(reason)};
}

std::string Reason(const StackTask& task, const Cover<double>& cover) {
  char text[200];
  const double millimetres = task.needs[cover.need].far * 1e3;
  switch (cover.end) {
    case CoverEnd::TooFar:
      return "the farthest depth asked for is beyond what the shortest extension keeps sharp";
    case CoverEnd::TooNear:
      return "the nearest depth asked for needs a longer extension than the lens has";
    case CoverEnd::Tolerance:
      std::snprintf(text, sizeof text,
                    "the sensor tolerance of %.6g um leaves nothing of the depth of focus at f/%.6g for depths that "
                    "focus at an extension of %.6g mm",
                    task.lens.delta * 1e6, task.n_high, millimetres);
      return text;
    case CoverEnd::TooMany:
      break;
    case CoverEnd::Covered:
      return "diffraction and the tolerances leave no f-number that keeps every depth sharp";
  }
  return "it would take more than " + std::to_string(kMostShots) + " shots";
}

StackAnswer Answer(const StackTask& task, const Found& found) {
  StackAnswer answer{.feasible = true, .shots = {}, .reason = {}};
  const StretchReach reach(task.lens, found.n, found.n);
  const Metres f{task.lens.f};
  for (std::size_t i = 0; i < found.cover.extensions.size(); ++i) {
    const Metres e{found.cover.extensions[i]};
    const auto [far, near] = CoveredAround(task.needs, reach, e.value, found.cover.forced_by[i]);
    answer.shots.push_back({.f_number = FNumber{found.n},
                            .extension = e,
                            .near = FocalPlane(f, Metres{near}),
                            .far = FocalPlane(f, Metres{far}),
                            .magnification = e / f});
  }
  return answer;
}

/// The conjugate extensions of all sharp depths, none of them twice.
Needs NeedsOf(const PlanRequest& request) {
  const Metres f{request.focal_length.value};
  const auto conjugate = [&](const PlanDepth& depth) {
    const double value = depth.number.value;
    return Extension(f, depth.is_vergence ? ObjectDepth(Dioptres{value}) : ObjectDepth(Metres{value})).value;
  };
  Needs needs;
  for (const BlurLimit& limit : request.limits) {
    for (const DepthInterval& depths : limit.depths) {
      const double one = conjugate(depths.one_end);
      const double other = conjugate(depths.other_end);
      needs.push_back({std::min(one, other), std::max(one, other), limit.limit.value});
    }
  }
  return Disjoint(needs);
}

/// The largest f-number at which the diffraction disk of a subject in focus stays within its limit.
double DiffractionLimit(const Needs& needs, const StackLens& lens) {
  double largest = std::numeric_limits<double>::infinity();
  if (lens.airy == 0.0) return largest;
  for (const Need<double>& need : needs) {
    largest = std::min(largest, need.limit / (lens.airy * (1.0 + need.near / lens.scale) * (1.0 + lens.epsilon)));
  }
  return largest;
}

StackLens LensOf(const PlanRequest& request) {
  StackLens lens;
  lens.f = request.focal_length.value;
  lens.scale = lens.f * request.pupil_factor.value;
  if (request.wavelength) lens.airy = DiffractionFactor(request.diffraction) * request.wavelength->value;
  lens.delta = request.sensor_tolerance.value;
  lens.epsilon = request.f_number_tolerance.value;
  lens.low = request.extensions.low.value;
  lens.high = request.extensions.high.value;
  return lens;
}

/// What a stack refuses beyond what no plan can do.
std::optional<Error> CheckStack(const PlanRequest& request) {
  const auto bad = [](std::string what) { return Error{Code::InvalidArgument, std::move(what)}; };
  if (request.focus) return bad("a focus stack chooses its own focal planes: leave out the fixed focus");
  if (request.limits.empty()) return bad("a focus stack needs at least one sharp limit");
  for (const BlurLimit& limit : request.limits) {
    if (limit.kind == LimitKind::Sharp) continue;
    return bad("a focus stack only makes things sharp: leave out the blurred limit " + limit.name);
  }
  if (request.liquid) return Error{Code::Unsupported, "a focus stack cannot be planned for a liquid lens yet"};
  return Check(request);
}

/// The range of f-numbers worth searching: diffraction closes its upper end.
void SetRange(StackTask& task) {
  const PlanRequest& request = task.request;
  task.n_high = DiffractionLimit(task.needs, task.lens);
  if (!request.stops.empty()) return;
  const double first = request.f_numbers.low.value;
  const double last = request.f_numbers.high.value;
  task.n_low = request.apertures_are_diameters ? task.lens.f / last : first;
  task.n_high = std::min(task.n_high, request.apertures_are_diameters ? task.lens.f / first : last);
}

}  // namespace

std::string_view StackCauseName(StackCause cause) {
  static constexpr std::string_view kNames[] = {"tooFar", "tooNear", "tolerance", "diffraction", "tooMany"};
  return kNames[static_cast<std::size_t>(cause)];
}

Result<StackAnswer> PlanStack(const PlanRequest& request) {
  if (auto error = CheckStack(request)) return PassOn(*std::move(error));
  StackTask task{.request = request, .lens = LensOf(request), .needs = NeedsOf(request)};
  SetRange(task);
  if (task.n_high < task.n_low)
    return Impossible(StackCause::Diffraction, "at every f-number diffraction alone exceeds a limit");
  const auto found = request.stops.empty() ? FewestOverRange(task) : FewestOverStops(task);
  if (found) return Answer(task, *found);
  const Cover<double> cover = CoverWith(task.needs, task.lens, task.n_low, task.n_high);
  return Impossible(CauseOf(cover.end), Reason(task, cover));
}

}  // namespace lensd::optics
