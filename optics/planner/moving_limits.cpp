// N times the signed blur is x = e - f (f + e) U, over the pupil's divisor. With U = 1/(L - e), L being a distance from
// the sensor less f and the gap, it is e + f - f (f + L)/(L - e): concave, so that over a stretch of extensions its
// least is at an end and its greatest at an end or where (L - e)^2 = f (f + L). Stretches that leave the f-number no
// room are left out, the others halved, until the middle of one holds or none is left.
#include "optics/planner/moving_limits.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "optics/planner/certain_conflict.h"
#include "optics/planner/limit_lines.h"
#include "optics/planner/minimal_conflict.h"

namespace lensd::optics {

namespace {

constexpr double kNoEnd = std::numeric_limits<double>::infinity();
constexpr double kRoundedUp = 1.0 + 1e-9;

bool MovesWithSensor(const PlanDepth& depth) {
  return !depth.is_vergence && std::isfinite(depth.number.value);
}

bool MovesWithSensor(const BlurLimit& limit) {
  return std::ranges::any_of(limit.depths, [](const DepthInterval& interval) {
    return MovesWithSensor(interval.one_end) || MovesWithSensor(interval.other_end);
  });
}

bool Has(const std::vector<int>& names, int name) {
  return std::ranges::find(names, name) != names.end();
}

}  // namespace

bool Moves(const PlanRequest& request) {
  return std::ranges::any_of(request.limits, [](const BlurLimit& limit) { return MovesWithSensor(limit); });
}

std::optional<Metres> ExtensionThatHolds(const MovingRequest& asked) {
  return MovingLimits(asked).Holds();
}

std::vector<std::string> MovingConflict(const MovingRequest& asked, const std::vector<std::string>& conflict) {
  const MovingLimits limits(asked);
  const std::vector<int> guess = Numbered(asked.request, conflict);
  // The depth of field is that of a fixed focus, where nothing moves.
  if (!limits.Moves(guess) || Has(guess, kDepthName)) return conflict;
  return Spelled(asked.request, CertainConflict(guess, EveryName(asked.request),
                                                [&](const std::vector<int>& names) { return limits.Refute(names); }));
}

MovingLimits::MovingLimits(const MovingRequest& asked)
    : request_(asked.request),
      f_(asked.request.focal_length.value),
      behind_(asked.behind.value),
      delta_(asked.request.sensor_tolerance.value),
      epsilon_(asked.request.f_number_tolerance.value),
      skew_(1.0 / asked.request.pupil_factor.value - 1.0),
      box_{asked.request.f_numbers.low.value, asked.request.f_numbers.high.value} {
  if (request_.wavelength) airy_ = DiffractionFactor(request_.diffraction) * request_.wavelength->value;
  if (request_.apertures_are_diameters) box_ = {f_ / box_.high, f_ / box_.low};
  for (const Number& stop : request_.stops) {
    stops_.push_back(request_.apertures_are_diameters ? f_ / stop.value : stop.value);
  }
  std::ranges::sort(stops_);
  if (!stops_.empty()) box_ = {stops_.front(), stops_.back()};
}

bool MovingLimits::Moves(const std::vector<int>& names) const {
  return std::ranges::any_of(
      names, [&](int name) { return name >= 0 && MovesWithSensor(request_.limits[static_cast<std::size_t>(name)]); });
}

/// The extension at which the subject would be at the lens centre.
double MovingLimits::Reach(const PlanDepth& depth) const {
  return MovesWithSensor(depth) ? depth.number.value - f_ - behind_ : kNoEnd;
}

MovingLimits::Search MovingLimits::SearchOf(const std::vector<int>& names) const {
  constexpr double kAnyFNumber = 1e-3, kBeforeTheLens = 1e-9;
  const double low = request_.extensions.low.value, high = request_.extensions.high.value;
  Search search{.limits = {},
                .extensions = {std::min(low, 0.0), std::max(high, f_)},
                .f_numbers = {kAnyFNumber * box_.low, kNoEnd}};
  if (Has(names, kFNumberName)) search.f_numbers = box_, search.stops = !stops_.empty();
  if (Has(names, kExtensionName)) search.extensions = {low, high};
  if (Has(names, kFocusName) && request_.focus) {
    const double u = request_.focus->vergence().value, e = f_ * f_ * u / (1.0 - f_ * u);
    const double hair = 1e-12 * (f_ + std::abs(e));
    search.extensions = {std::max(search.extensions.low, e - hair), std::min(search.extensions.high, e + hair)};
  }
  for (const int name : names) {
    if (name < 0) continue;
    const BlurLimit& limit = request_.limits[static_cast<std::size_t>(name)];
    search.limits.push_back(&limit);
    for (const DepthInterval& interval : limit.depths) {
      const double reach = std::min(Reach(interval.one_end), Reach(interval.other_end));
      if (std::isfinite(reach))
        search.extensions.high = std::min(search.extensions.high, reach - kBeforeTheLens * std::abs(reach));
    }
  }
  return search;
}

MovingLimits::Ends MovingLimits::Vergences(const PlanDepth& depth, const Ends& extensions) const {
  const double reach = Reach(depth);
  if (std::isinf(reach)) return {depth.vergence().value, depth.vergence().value};
  return {1.0 / (reach - extensions.low), 1.0 / (reach - extensions.high)};
}

MovingLimits::Ends MovingLimits::BlurTimesN(const PlanDepth& depth, const Ends& extensions) const {
  const double reach = Reach(depth);
  const auto [at_low, at_high] = Vergences(depth, extensions);
  const double first = extensions.low - f_ * (f_ + extensions.low) * at_low;
  const double last = extensions.high - f_ * (f_ + extensions.high) * at_high;
  Ends blur{std::min(first, last), std::max(first, last)};
  if (std::isinf(reach) || !(f_ + reach > 0.0)) return blur;
  const double from_lens = std::sqrt(f_ * (f_ + reach)), turn = reach - from_lens;
  if (turn > extensions.low && turn < extensions.high) blur.high = reach + f_ - 2.0 * from_lens;
  return blur;
}

/// N times the least blur that a depth may have at any of the extensions.
double MovingLimits::LeastSharp(const PlanDepth& depth, const Ends& extensions) const {
  const Ends u = Vergences(depth, extensions), blur = BlurTimesN(depth, extensions);
  const Ends across{1.0 - f_ * u.high, 1.0 - f_ * u.low};
  const double off = across.low > 0.0 ? across.low : std::max(-across.high, 0.0);
  const double divisor = 1.0 + std::max(f_ * u.low * skew_, f_ * u.high * skew_);
  if (!(divisor > 0.0)) return 0.0;
  return (std::max({blur.low, -blur.high, 0.0}) + delta_ * off) / divisor;
}

/// N times the greatest blur that an interval may have, on the side where it has the least, with `sign` 1 behind the
/// plane in focus and -1 in front of it.
double MovingLimits::MostToOneSide(const DepthInterval& interval, double sign, const Ends& extensions) const {
  double most = kNoEnd;
  for (const PlanDepth* depth : {&interval.one_end, &interval.other_end}) {
    const Ends u = Vergences(*depth, extensions), blur = BlurTimesN(*depth, extensions);
    const Ends across{1.0 - f_ * u.high, 1.0 - f_ * u.low};
    const double off = across.low > 0.0 ? across.low : std::max(-across.high, 0.0);
    const double least = (sign > 0.0 ? blur.high : -blur.low) - delta_ * off;
    const double divisor = 1.0 + std::min(f_ * u.low * skew_, f_ * u.high * skew_);
    if (least > 0.0 && !(divisor > 0.0)) continue;
    most = std::min(most, least > 0.0 ? least / divisor : 0.0);
  }
  return most;
}

double MovingLimits::MostBlurred(const BlurLimit& limit, const Ends& extensions) const {
  double most = kNoEnd;
  for (const DepthInterval& interval : limit.depths) {
    const double behind = limit.side == Side::Front ? 0.0 : MostToOneSide(interval, 1.0, extensions);
    const double front = limit.side == Side::Behind ? 0.0 : MostToOneSide(interval, -1.0, extensions);
    most = std::min(most, std::max(behind, front));
  }
  return most;
}

MovingLimits::Ends MovingLimits::RoomOf(const BlurLimit& limit, const Ends& extensions) const {
  const double c = limit.limit.value;
  if (limit.kind == LimitKind::Blurred) return {0.0, MostBlurred(limit, extensions) / c / (1.0 + epsilon_)};
  double blur = 0.0;
  for (const DepthInterval& interval : limit.depths) {
    blur = std::max({blur, LeastSharp(interval.one_end, extensions), LeastSharp(interval.other_end, extensions)});
  }
  const double disk = airy_ * (1.0 + (extensions.low - delta_) / (f_ * request_.pupil_factor.value));
  if (!(disk > 0.0)) return {blur / c / (1.0 - epsilon_), kNoEnd};
  // (blur/N)^2 + (disk N)^2 <= c^2, quadratic in N^2.
  const double under = c * c * c * c - 4.0 * blur * blur * disk * disk;
  if (under < 0.0) return {kNoEnd, 0.0};
  const double sum = c * c + std::sqrt(under);
  return {std::sqrt(2.0 / sum) * blur / (1.0 - epsilon_), std::sqrt(0.5 * sum) / disk / (1.0 + epsilon_)};
}

MovingLimits::Ends MovingLimits::Room(const Search& search, const Ends& extensions) const {
  Ends room = search.f_numbers;
  for (const BlurLimit* limit : search.limits) {
    const Ends one = RoomOf(*limit, extensions);
    room = {std::max(room.low, one.low), std::min(room.high, one.high)};
  }
  return room;
}

bool MovingLimits::Admits(const Search& search, const Ends& room) const {
  const Ends wide{room.low / kRoundedUp, room.high * kRoundedUp};
  if (!(wide.low <= wide.high)) return false;
  if (!search.stops) return true;
  const auto stop = std::ranges::lower_bound(stops_, wide.low);
  return stop != stops_.end() && *stop <= wide.high;
}

MovingLimits::Found MovingLimits::Find(const Search& search) const {
  constexpr std::size_t kMostDepths = 2'000'000;
  constexpr double kNarrow = 1e-13;
  if (!(search.extensions.low <= search.extensions.high)) return {};
  std::vector<Ends> open{search.extensions};
  bool certain = true;
  std::size_t intervals = 1;
  for (const BlurLimit* limit : search.limits) intervals += limit->depths.size();
  for (std::size_t looked = 0; !open.empty(); looked += intervals) {
    if (looked > kMostDepths) return {.certain = false, .extension = {}};
    const Ends stretch = open.back();
    open.pop_back();
    if (!Admits(search, Room(search, stretch))) continue;
    const double middle = 0.5 * (stretch.low + stretch.high);
    if (Admits(search, Room(search, {middle, middle}))) return {.certain = false, .extension = middle};
    if (stretch.high - stretch.low <= kNarrow * (f_ + std::abs(middle))) {
      certain = false;
      continue;
    }
    open.push_back({stretch.low, middle});
    open.push_back({middle, stretch.high});
  }
  return {.certain = certain, .extension = {}};
}

std::optional<std::vector<int>> MovingLimits::Refute(const std::vector<int>& names) const {
  const Found found = Find(SearchOf(names));
  if (!found.extension) return found.certain ? std::nullopt : std::optional(std::vector<int>());
  const double e = *found.extension;
  const Search wanted = SearchOf(EveryName(request_));
  std::vector<int> broken;
  if (e < request_.extensions.low.value || e > request_.extensions.high.value) broken.push_back(kExtensionName);
  if (e < wanted.extensions.low || e > wanted.extensions.high) {
    if (broken.empty()) broken.push_back(request_.focus ? kFocusName : kExtensionName);
    return broken;
  }
  if (Admits(wanted, Room(wanted, {e, e}))) return broken;
  // What leaves the least room at either end, and the f-numbers there are.
  std::pair<double, int> low{-kNoEnd, kFNumberName}, high{kNoEnd, kFNumberName};
  for (std::size_t i = 0; i < wanted.limits.size(); ++i) {
    const Ends room = RoomOf(*wanted.limits[i], {e, e});
    low = std::max(low, {room.low, static_cast<int>(i)});
    if (room.high < high.first) high = {room.high, static_cast<int>(i)};
  }
  broken.insert(broken.end(), {low.second, high.second, kFNumberName});
  return broken;
}

std::optional<Metres> MovingLimits::Holds() const {
  const Found found = Find(SearchOf(EveryName(request_)));
  return found.extension ? std::optional(Metres{*found.extension}) : std::nullopt;
}

}  // namespace lensd::optics
