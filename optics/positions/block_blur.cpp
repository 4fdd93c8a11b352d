// What a whole block of positions may ask of the opening. Each formula is that of position_blur.cpp between ends: every
// step of it rises or falls with each of its numbers, and so does its rounding; a hair on top covers what a compiler
// may fuse. Where something has no cheap end the answer is the one that leaves out nothing.
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <utility>

#include "optics/positions/position_blur.h"

namespace lensd::optics {

namespace {

using BlockEnds = FocusRange::Ends;

constexpr double kRoundedBelow = 1.0 - 1e-12, kRoundedAbove = 1.0 + 1e-12;
constexpr double kAnyBlur = std::numeric_limits<double>::infinity();
constexpr double kLeastDivisor = 1e-3;  ///< nearer to zero its rounding counts

BlockEnds EndsOf(std::initializer_list<double> values) {
  const auto [low, high] = std::minmax(values);
  return {low, high};
}

/// Between numbers of two ranges.
double LeastApart(const BlockEnds& a, const BlockEnds& b) {
  return std::max({0.0, a.low - b.high, b.low - a.high});
}

/// Positions that stand at either end of a block's sensor distances, which is all that a depth's vergence depends on.
std::pair<FocusPosition, FocusPosition> AtEnds(const FocusRange& block) {
  std::pair<FocusPosition, FocusPosition> ends;
  ends.first.sensor_distance = Metres{block.sensor_distance.low};
  ends.second.sensor_distance = Metres{block.sensor_distance.high};
  return ends;
}

}  // namespace

double PositionBlur::LeastOff(const PlanDepth& depth, const FocusRange& block) const {
  const auto [low, high] = AtEnds(block);
  return LeastApart(EndsOf({Vergence(depth, low), Vergence(depth, high)}), block.focal_plane) * kRoundedBelow;
}

/// As Divisor().
PositionBlur::Ends PositionBlur::Divisors(Ends vergence, const FocusRange& block) const {
  if (skew_ == 0.0) return {1.0, 1.0};
  const auto [low, high] = block.focal_length;
  return EndsOf({1.0 + low * vergence.low * skew_, 1.0 + low * vergence.high * skew_, 1.0 + high * vergence.low * skew_,
                 1.0 + high * vergence.high * skew_});
}

/// As Bound().
double PositionBlur::LeastBound(Ends vergence, const FocusRange& block) const {
  const double tolerance = request_.sensor_tolerance.value;
  if (!(tolerance > 0.0)) return block.bound.low;
  const double z = block.sensor_distance.high;
  const Ends power{1.0 / block.focal_length.high, 1.0 / block.focal_length.low};
  const double of_sensor = lens_.liquid ? 1.0 / z : LeastApart(power, vergence);
  return std::max(block.bound.low, tolerance * of_sensor / z);
}

/// Of the greater of a sharp limit's two ends, over A Z_s.
double PositionBlur::LeastSharp(Ends near, Ends far, const FocusRange& block) const {
  double least = 0.0;
  for (const Ends& end : {near, far}) {
    const Ends divisor = Divisors(end, block);
    if (!(divisor.low > kLeastDivisor)) return 0.0;
    least = std::max(least, (LeastApart(end, block.focal_plane) + LeastBound(end, block)) / divisor.high);
  }
  return least;
}

/// Of a depth that the focal plane is at most `off` from, over A Z_s.
double PositionBlur::MostOff(double off, Ends vergence, const FocusRange& block) const {
  const Ends divisor = Divisors(vergence, block);
  if (!(divisor.low > kLeastDivisor)) return kAnyBlur;
  return std::max(off - LeastBound(vergence, block), 0.0) / divisor.low;
}

/// As LeastToEitherSide(), where all planes of the block lie in one gap between the depths, or in one stretch of them.
/// What distances from the sensor leave can only be less.
double PositionBlur::MostToEitherSide(const Limit& limit, const FocusRange& block) const {
  const Stretches& stretches = limit.open_vergences;
  const auto after = [&](double plane) {
    return std::ranges::lower_bound(stretches, plane, {}, &std::pair<double, double>::second);
  };
  const auto [low, high] = block.focal_plane;
  const auto next = after(high);
  if (next != after(low)) return kAnyBlur;
  double most = kAnyBlur;
  if (next != stretches.end()) {
    const double end = next->first;
    if (end <= low) return 0.0;
    if (end <= high) return kAnyBlur;
    most = std::min(most, MostOff(end - low, {end, end}, block));
  }
  if (next != stretches.begin()) {
    const double end = next[-1].second;
    most = std::min(most, MostOff(high - end, {end, end}, block));
  }
  return most;
}

double PositionBlur::MostBlurred(const Limit& limit, Ends near, Ends far, const FocusRange& block) const {
  switch (limit.asked->side) {
    case Side::Either:
      return MostToEitherSide(limit, block);
    case Side::Behind:
      return MostOff(block.focal_plane.high - near.low, near, block);
    case Side::Front:
      return MostOff(far.high - block.focal_plane.low, far, block);
  }
  return kAnyBlur;
}

OpeningNeed PositionBlur::LeastNeed(std::size_t index, const FocusRange& block) const {
  const Limit& limit = limits_[index];
  OpeningNeed need{.limit = limit.asked->limit.value, .sharp = limit.asked->kind == LimitKind::Sharp};
  const auto [low, high] = AtEnds(block);
  const auto [near_low, far_low] = Depths(index, low);
  const auto [near_high, far_high] = limit.distances.empty() ? std::pair(near_low, far_low) : Depths(index, high);
  const Ends near{std::min(near_low, near_high), std::max(near_low, near_high)};
  const Ends far{std::min(far_low, far_high), std::max(far_low, far_high)};
  const double f = lens_.focal_length.value;
  if (!need.sharp) {
    need.geometric = f * block.sensor_distance.high * MostBlurred(limit, near, far, block) * smaller_ * kRoundedAbove;
    if (!(need.geometric >= 0.0)) need.geometric = kAnyBlur;
    return need;
  }
  need.geometric = f * block.sensor_distance.low * LeastSharp(near, far, block) * larger_ * kRoundedBelow;
  if (!(need.geometric >= 0.0)) need.geometric = 0.0;
  if (airy_ > 0.0) {
    const Ends extension = block.extension, focal_length = block.focal_length;
    const double magnification = extension.low / (extension.low < 0.0 ? focal_length.low : focal_length.high);
    const double breathing = lens_.liquid ? 1.0 : focal_length.low / f;
    need.diffraction =
        std::max(airy_ * breathing * (1.0 + magnification / request_.pupil_factor.value) * kRoundedBelow, 0.0);
  }
  return need;
}

}  // namespace lensd::optics
