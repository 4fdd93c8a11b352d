// The time a move takes over its length is a straight line where the motor has one speed: its slope is the speed, what
// is left at no length at all is what a move takes beside travelling. Acceleration bends the line, and widens its
// intervals.
#include "cli/online/setup_motion.h"

#include <algorithm>
#include <array>
#include <boost/math/distributions/students_t.hpp>
#include <chrono>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace lensd::cli {
namespace {

using varlink::Json;

/// Of the rest, each there and back: short ones tell what a move takes at all, long ones the speed. The short ones come
/// first, for a motor so slow that there is no time for the others.
constexpr std::array kLengths = {1.0 / 32, 1.0 / 16, 1.0 / 8, 1.0 / 4, 1.0 / 2};
constexpr int kRounds = 2;
constexpr std::size_t kFewest = 4;

double MillisecondsSince(Instant began) {
  return std::chrono::duration<double, std::milli>(MonotonicClock().Now() - began).count();
}

/// What the reports of one move say of its beginning and its end.
class Watch {
 public:
  Watch(double from, double resolution) : from_(from), near_(0.75 * resolution) {}

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
  Watch watch(position, info["resolution"].get<double>());
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

/// Time over distance, in ms and native units.
std::optional<Line> Fit(const std::vector<TimedMove>& moves) {
  std::vector<std::pair<double, double>> points;
  for (const TimedMove& move : moves) points.emplace_back(move.distance, move.elapsed_ms);
  return FitLine(points);
}

/// Those of the shortest length among moves in the order of their distances.
std::span<const TimedMove> Shortest(const std::vector<TimedMove>& moves, double alike) {
  const auto longer = std::ranges::find_if(
      moves, [&](const TimedMove& move) { return move.distance > moves.front().distance + alike; });
  return {moves.begin(), longer};
}

/// A motor that is still accelerating when it has to brake takes longer than the line of the others says: such lengths
/// are left out, the shortest first, as long as two lengths remain.
std::optional<Line> FitThatHolds(std::vector<TimedMove> moves) {
  constexpr double kClearly = 3.0;  // standard errors
  constexpr double kTimerMs = 0.5;  // what a time is not known better than
  constexpr double kAlike = 1.5;    // native units: rounding
  std::ranges::sort(moves, {}, &TimedMove::distance);
  for (;;) {
    const auto line = Fit(moves);
    if (!line) return line;
    const auto few = Shortest(moves, kAlike);
    const std::vector<TimedMove> longer(moves.begin() + static_cast<std::ptrdiff_t>(few.size()), moves.end());
    const auto without = Fit(longer);
    if (!without || longer.back().distance <= Shortest(longer, kAlike).back().distance + kAlike) return line;
    double off = 0.0, scatter = 0.0;
    const auto n = static_cast<double>(few.size());
    for (const TimedMove& move : few) off += (move.elapsed_ms - without->At(move.distance)) / n;
    for (const TimedMove& move : few) scatter += std::pow(move.elapsed_ms - without->At(move.distance) - off, 2) / n;
    if (std::abs(off) <= kClearly * std::hypot(kTimerMs, std::sqrt(scatter / n), without->zero_half / 2)) return line;
    moves = longer;
  }
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
  const auto line = FitThatHolds(motion.moves);
  if (!line) return;
  motion.overhead_ms =
      Measured{line->at_zero, std::max(0.0, line->at_zero - line->zero_half), line->at_zero + line->zero_half};
  if (line->slope - line->slope_half <= 0.0) return;  // the time says nothing of the travel
  motion.speed =
      Measured{1e3 / line->slope, 1e3 / (line->slope + line->slope_half), 1e3 / (line->slope - line->slope_half)};
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
  for (int round = 0; round < kRounds; ++round) {
    for (const double length : kLengths) {
      if (span * length < 2.0 * resolution) continue;
      for (const double target : {low + span / 4 + span * length, low + span / 4}) {
        if (enough()) break;
        if (auto moved = go(target); !moved) return PassOn(moved);
      }
    }
  }
  FitMoves(motion);
  AxisMotion back;
  if (auto moved = MoveOnce(link, lens, info, position, home, back); !moved) return PassOn(moved);
  return motion;
}

}  // namespace lensd::cli
