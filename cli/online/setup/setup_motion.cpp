// The time a move takes over its length is a straight line where the motor has one speed: its slope is the speed, what
// is left at no length at all is what a move takes beside travelling. Acceleration bends the line at its short end,
// which is fitted with it.
#include "cli/online/setup/setup_motion.h"

#include <algorithm>
#include <array>
#include <boost/math/distributions/students_t.hpp>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

namespace lensd::cli {
namespace {

using varlink::Json;

/// Of the rest, each there and back, up and down: short ones tell what a move takes at all, long ones the speed. The
/// short ones come first, for a motor so slow that there is no time for the others.
constexpr std::array kLengths = {1.0 / 32, 1.0 / 16, 1.0 / 8, 1.0 / 4, 1.0 / 2};
constexpr std::size_t kFewest = 4;

double MillisecondsSince(Instant began) {
  return std::chrono::duration<double, std::milli>(MonotonicClock().Now() - began).count();
}

/// What the reports of one move say of its beginning and its end.
class MoveReports {
 public:
  MoveReports(double from, double resolution) : from_(from), near_(0.75 * resolution) {}

  void See(double position, double at_ms) {
    if (started_ms_ == 0.0) {
      (std::abs(position - from_) <= near_ ? still_ms_ : started_ms_) = at_ms;
    }
    if (reports_.empty() || reports_.back().first != position) reports_.emplace_back(position, at_ms);
    last_ms_ = at_ms;
  }

  TimedMove Finish(double to, double elapsed_ms, double end_ms) const {
    TimedMove move{.distance = std::abs(to - from_), .elapsed_ms = elapsed_ms};
    const auto on_the_way = [&](const auto& report) {
      return std::abs(report.first - from_) > near_ && std::abs(report.first - to) > near_;
    };
    if (std::ranges::none_of(reports_, on_the_way)) return move;
    move.still_ms = still_ms_;
    move.started_ms = started_ms_;
    const auto there = std::ranges::find_if(reports_, [&](const auto& r) { return std::abs(r.first - to) <= near_; });
    const double first_there = there == reports_.end() ? last_ms_ : there->second;
    const double last_away = there == reports_.end() ? last_ms_ : std::prev(there)->second;
    move.rest_least_ms = std::max(0.0, end_ms - first_there);
    move.rest_most_ms = std::max(0.0, end_ms - last_away);
    return move;
  }

 private:
  double from_, near_;
  double still_ms_ = 0.0, started_ms_ = 0.0, last_ms_ = 0.0;
  std::vector<std::pair<double, double>> reports_;  ///< each position when it was told first
};

/// The middle of what moves left open, and everything that it leaves open.
std::optional<Measured> Between(const std::vector<TimedMove>& moves, double TimedMove::* least,
                                double TimedMove::* most) {
  Measured all{.low = std::numeric_limits<double>::infinity()};
  std::vector<double> middles;
  for (const TimedMove& move : moves) {
    if (!move.SeenOnTheWay()) continue;
    all.low = std::min(all.low, move.*least);
    all.high = std::max(all.high, move.*most);
    middles.push_back((move.*least + move.*most) / 2);
  }
  if (middles.empty()) return std::nullopt;
  const auto middle = middles.begin() + static_cast<std::ptrdiff_t>(middles.size() / 2);
  std::ranges::nth_element(middles, middle);
  all.value = *middle;
  return all;
}

/// One move, its reports watched. A result that is not reached is trouble.
std::expected<void, Failure> MoveOnce(DaemonClient& link, const std::string& lens, const Json& info, double& position,
                                      double target, AxisMotion& motion) {
  const Json& axis = info["axis"];
  MoveReports watch(position, info["resolution"].get<double>());
  const Instant began = MonotonicClock().Now();
  const auto see = [&](const Json& part) {
    if (part.contains("progress") && part["progress"].is_object()) {
      watch.See(part["progress"]["position"].get<double>(), MillisecondsSince(began));
    }
    return true;
  };
  auto reply =
      link.Follow(MethodOfLens("Move"), {{"lens", lens}, {"axis", axis}, {"target", {{"position", target}}}}, see);
  if (!reply) return PassOn(reply);
  const Json& move = (*reply)["move"];
  const double from = std::exchange(position, move["position"].get<double>());
  if (!move.value("reached", false)) {
    motion.trouble = move["reason"].is_string() ? move["reason"].get<std::string>() : "a move did not arrive";
    return {};
  }
  if (position != from) {
    motion.moves.push_back(watch.Finish(position, move["elapsedMs"].get<double>(), MillisecondsSince(began)));
  }
  return {};
}

/// What the times of moves allow.
struct MoveTimes {
  Measured per_unit;     ///< ms a native unit, at speed
  Measured overhead_ms;  ///< beside the travel, of moves that reach the speed
  bool speed_reached = true;
};

/// A motor that accelerates evenly takes c + (d + k) / v over a distance d, and c + 2 sqrt(d k) / v where d is below
/// the distance k = v^2 / a, within which it has to brake before it has its speed: a straight line in either case once
/// k is chosen. Every k that the times do not contradict has its say in the intervals (profile likelihood).
std::optional<MoveTimes> FitTimes(const std::vector<TimedMove>& moves) {
  constexpr double kTimerMs = 0.5;  // what a time is not known better than
  constexpr int kTried = 160;       // values of k, each 6 % above the one before
  if (moves.size() < kFewest) return std::nullopt;
  const auto n = static_cast<double>(moves.size());
  const double longest = std::ranges::max(moves, {}, &TimedMove::distance).distance;
  struct Try {
    double knee, rest, mean_x, xx;
    Line line;
  };
  std::vector<Try> tries;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kTried; ++i) {
    const double knee = i == 0 ? 0.0 : longest * std::pow(1.06, i - kTried);
    std::vector<std::pair<double, double>> points;
    for (const TimedMove& move : moves) {
      const double d = move.distance;
      points.emplace_back(d >= knee ? d + knee : 2.0 * std::sqrt(d * knee), move.elapsed_ms);
    }
    const auto line = FitLine(points);
    if (!line) continue;
    Try tried{.knee = knee, .rest = 0.0, .mean_x = 0.0, .xx = 0.0, .line = *line};
    for (const auto& [x, y] : points) tried.mean_x += x / n;
    for (const auto& [x, y] : points) tried.xx += std::pow(x - tried.mean_x, 2);
    for (const auto& [x, y] : points) tried.rest += std::pow(y - line->At(x), 2);
    least = std::min(least, tried.rest);
    tries.push_back(tried);
  }
  if (tries.empty()) return std::nullopt;
  const double freedom = std::max(1.0, n - 3.0);
  const double t = boost::math::quantile(boost::math::students_t(freedom), 0.975);
  const double allowed = least + t * t * std::max(least / freedom, kTimerMs * kTimerMs);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  MoveTimes times{.per_unit = {0.0, kFar, -kFar}, .overhead_ms = {0.0, kFar, -kFar}};
  for (const Try& tried : tries) {
    if (tried.rest > allowed) continue;
    const double slope_half = std::sqrt((allowed - tried.rest) / tried.xx);
    const double zero_half =
        std::sqrt((allowed - tried.rest) * (1.0 / n + std::pow(tried.knee - tried.mean_x, 2) / tried.xx));
    const double overhead = tried.line.At(tried.knee);
    times.per_unit.low = std::min(times.per_unit.low, tried.line.slope - slope_half);
    times.per_unit.high = std::max(times.per_unit.high, tried.line.slope + slope_half);
    times.overhead_ms.low = std::min(times.overhead_ms.low, overhead - zero_half);
    times.overhead_ms.high = std::max(times.overhead_ms.high, overhead + zero_half);
    if (tried.rest == least) times.per_unit.value = tried.line.slope;
    if (tried.rest == least) times.overhead_ms.value = overhead;
    if (tried.knee >= longest) times.speed_reached = false;
  }
  return times;
}

}  // namespace

std::optional<Line> FitLine(const std::vector<std::pair<double, double>>& points) {
  const auto n = static_cast<double>(points.size());
  if (points.size() < kFewest) return std::nullopt;
  double mean_x = 0.0, mean_y = 0.0, xx = 0.0, xy = 0.0, rest = 0.0;
  for (const auto& [x, y] : points) {
    mean_x += x / n;
    mean_y += y / n;
  }
  for (const auto& [x, y] : points) {
    xx += std::pow(x - mean_x, 2);
    xy += (x - mean_x) * (y - mean_y);
  }
  if (xx == 0.0) return std::nullopt;
  Line line{.slope = xy / xx};
  line.at_zero = mean_y - line.slope * mean_x;
  for (const auto& [x, y] : points) rest += std::pow(y - line.At(x), 2);
  const double t = boost::math::quantile(boost::math::students_t(n - 2.0), 0.975);
  const double sigma = std::sqrt(rest / (n - 2.0));
  line.slope_half = t * sigma / std::sqrt(xx);
  line.zero_half = t * sigma * std::sqrt(1.0 / n + mean_x * mean_x / xx);
  return line;
}

Json JsonOf(const std::optional<Measured>& measured) {
  if (!measured) return nullptr;
  const auto number = [](double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); };
  return {{"value", number(measured->value)}, {"low", number(measured->low)}, {"high", number(measured->high)}};
}

void FitMoves(AxisMotion& motion) {
  motion.latency_ms = Between(motion.moves, &TimedMove::still_ms, &TimedMove::started_ms);
  motion.rest_ms = Between(motion.moves, &TimedMove::rest_least_ms, &TimedMove::rest_most_ms);
  const auto times = FitTimes(motion.moves);
  if (!times) return;
  motion.overhead_ms = times->overhead_ms;
  motion.overhead_ms->low = std::max(0.0, motion.overhead_ms->low);
  // Either the time says nothing of the travel, or the motor may never have come to its speed.
  if (times->per_unit.low <= 0.0 || !times->speed_reached) return;
  motion.speed = Measured{1e3 / times->per_unit.value, 1e3 / times->per_unit.high, 1e3 / times->per_unit.low};
}

std::vector<double> MotionTargets(double low, double span, double resolution) {
  constexpr double kGoldenRatio = 0.6180339887498949, kVaried = 0.3;
  std::vector<double> targets;
  double turn = 0.0;
  const auto varied = [&] {
    turn += kGoldenRatio;
    return kVaried * (turn - std::floor(turn) - 0.5);
  };
  std::vector<double> lengths(kLengths.begin(), kLengths.end());
  lengths.insert(lengths.end(), kLengths.rbegin(), kLengths.rend());
  for (const double length : lengths) {
    if (span * length < 2.0 * resolution) continue;
    targets.push_back(low + span * (0.25 + length * (1.0 + varied())));
    targets.push_back(low + span * (0.25 + length * varied()));
  }
  return targets;
}

std::expected<AxisMotion, Failure> MeasureMotion(DaemonClient& link, const std::string& lens, const Json& info,
                                                 double position, Duration budget) {
  const double minimum = info["minimum"].get<double>(), range = info["maximum"].get<double>() - minimum;
  const double low = minimum + kSetupMargin * range, span = range * (1.0 - 2.0 * kSetupMargin);
  const double resolution = info["resolution"].get<double>(), home = position;
  const Instant began = MonotonicClock().Now();
  AxisMotion motion;
  const auto go = [&](double target) { return MoveOnce(link, lens, info, position, target, motion); };
  if (auto moved = go(low + span / 4); !moved) return PassOn(moved);
  motion.moves.clear();  // from anywhere: its backlash is not that of the others
  const auto enough = [&] {
    return !motion.trouble.empty() || (motion.moves.size() >= kFewest && MonotonicClock().Now() - began > budget);
  };
  for (const double target : MotionTargets(low, span, resolution)) {
    if (enough()) break;
    if (auto moved = go(target); !moved) return PassOn(moved);
  }
  FitMoves(motion);
  AxisMotion back;
  if (auto moved = MoveOnce(link, lens, info, position, home, back); !moved) return PassOn(moved);
  return motion;
}

double SearchAtMostMs(const Json& axes) {
  constexpr double kQuickLensMs = 30e3, kLongestMs = 3600e3;
  constexpr double kMoves = 60.0, kTravels = 8.0;  // twice those of a sweep of the whole range with a second, fine one
  const auto focus = std::ranges::find_if(axes, [](const Json& axis) { return axis["axis"] == "focus"; });
  if (focus == axes.end()) return kQuickLensMs;
  const auto measured = [&](const char* key) { return focus->contains(key) && focus->at(key).is_object(); };
  double whole = kQuickLensMs;
  if (measured("overheadMs")) whole += kMoves * focus->at("overheadMs")["high"].get<double>();
  if (measured("speed")) {
    const double range = focus->at("maximum").get<double>() - focus->at("minimum").get<double>();
    whole += kTravels * 1e3 * range / std::max(focus->at("speed")["low"].get<double>(), 1e-3);
  }
  return std::min(whole, kLongestMs);
}

}  // namespace lensd::cli
