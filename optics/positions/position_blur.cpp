// The blur of a thin lens with its focal plane at vergence U_s is s = A Z_s (U_s - U): that holds for every lens here,
// liquid ones included, and its two factors are what a position states. The opening is A = f(0)/N. Uncertainty of the
// focal plane widens the difference, that of the focal length scales it.
#include "optics/positions/position_blur.h"

#include <algorithm>
#include <cmath>

namespace lensd::optics {

namespace {

/// Nothing in front of the lens is nearer.
constexpr double kAtTheLens = 1e9;

bool IsInfinity(const PlanDepth& depth) {
  return depth.is_vergence ? depth.number.value == 0.0 : std::isinf(depth.number.value);
}

/// Stretches that touch or overlap become one.
void MakeDisjoint(std::vector<std::pair<double, double>>& stretches) {
  std::ranges::sort(stretches);
  std::size_t kept = 0;
  for (const auto& stretch : stretches) {
    if (kept > 0 && stretch.first <= stretches[kept - 1].second) {
      stretches[kept - 1].second = std::max(stretches[kept - 1].second, stretch.second);
    } else {
      stretches[kept++] = stretch;
    }
  }
  stretches.resize(kept);
}

}  // namespace

double OpeningNeed::Blur(double n) const {
  return diffraction > 0.0 ? std::hypot(geometric / n, diffraction * n) : geometric / n;
}

double OpeningNeed::Ratio(double low, double high) const {
  if (!sharp) return std::min(limit * high / geometric, kMostBlurRatio);
  // Total blur is convex over N: both ends of a stretch suffice.
  return (diffraction > 0.0 ? std::max(Blur(low), Blur(high)) : geometric / low) / limit;
}

PositionBlur::PositionBlur(const PlanRequest& request, const LensPositions& lens, const DistanceOrigin& origin)
    : request_(request), lens_(lens), origin_(origin), skew_(1.0 / request.pupil_factor.value - 1.0) {
  larger_ = (1.0 + lens.focal_length_error) * (1.0 + lens.focal_length_error);
  smaller_ = (1.0 - lens.focal_length_error) * (1.0 - lens.focal_length_error);
  if (request.wavelength) airy_ = DiffractionFactor(request.diffraction) * request.wavelength->value;
  for (const BlurLimit& asked : request.limits) limits_.push_back(LimitOf(asked));
}

/// What starts at the sensor moves with it against what starts at the centre, so that each end keeps its coordinate. At
/// infinity and past it both are the same.
PositionBlur::Limit PositionBlur::LimitOf(const BlurLimit& asked) const {
  Limit limit{.asked = &asked};
  const bool open = asked.kind == LimitKind::Blurred && asked.side == Side::Either;
  const auto moves = [&](const PlanDepth& depth) { return origin_.at_sensor && !depth.is_vergence; };
  const auto place = [&](const PlanDepth& depth) {
    if (!moves(depth)) return Vergence(depth, lens_.focus.front());
    return IsInfinity(depth) ? 0.0 : 1.0 / depth.number.value;
  };
  for (const DepthInterval& interval : asked.depths) {
    const PlanDepth &one = interval.one_end, &other = interval.other_end;
    const double at_one = place(one), at_other = place(other);
    (moves(one) ? limit.distances : limit.vergences).Add(at_one);
    (moves(other) ? limit.distances : limit.vergences).Add(at_other);
    if (!open) continue;
    const bool one_moves = moves(one) && at_one > 0.0, other_moves = moves(other) && at_other > 0.0;
    if (one_moves != other_moves && at_one > 0.0 && at_other > 0.0) {
      const auto [fixed, moving] = one_moves ? std::pair(at_other, at_one) : std::pair(at_one, at_other);
      limit.open_vergences.emplace_back(fixed, fixed);
      limit.open_distances.emplace_back(moving, moving);
      limit.open_mixed.emplace_back(fixed, moving);
    } else {
      (one_moves || other_moves ? limit.open_distances : limit.open_vergences)
          .emplace_back(std::min(at_one, at_other), std::max(at_one, at_other));
    }
  }
  MakeDisjoint(limit.open_vergences);
  MakeDisjoint(limit.open_distances);
  return limit;
}

double PositionBlur::FromOrigin(double inverse, const FocusPosition& position) const {
  if (inverse <= 0.0) return inverse;
  const double depth = 1.0 / inverse - origin_.At(position).value;
  return depth > 1.0 / kAtTheLens ? 1.0 / depth : kAtTheLens;
}

double PositionBlur::Vergence(const PlanDepth& depth, const FocusPosition& position) const {
  return depth.is_vergence || IsInfinity(depth) ? depth.vergence().value
                                                : FromOrigin(1.0 / depth.number.value, position);
}

std::pair<double, double> PositionBlur::FNumbers(const IrisPosition& position) const {
  const double n = position.f_number.value, epsilon = request_.f_number_tolerance.value;
  return {std::min(position.lowest.value, n * (1.0 - epsilon)), std::max(position.highest.value, n * (1.0 + epsilon))};
}

double PositionBlur::Bound(const FocusPosition& position, double vergence) const {
  // s = A (Z_s (U_s - U) + (1/f - U) times what the sensor is off by).
  const double z = position.sensor_distance.value, f = position.focal_length.value;
  const double of_sensor = lens_.liquid ? 1.0 / z : std::abs(1.0 / f - vergence);
  return std::max(position.bound.value, request_.sensor_tolerance.value * of_sensor / z);
}

double PositionBlur::Breathing(const FocusPosition& position) const {
  return lens_.liquid ? 1.0 : position.focal_length / lens_.focal_length;
}

double PositionBlur::Divisor(double vergence, const FocusPosition& position) const {
  return skew_ == 0.0 ? 1.0 : 1.0 + position.focal_length.value * vergence * skew_;
}

std::pair<double, double> PositionBlur::Depths(std::size_t index, const FocusPosition& position) const {
  const Limit& limit = limits_[index];
  double near = limit.vergences.near, far = limit.vergences.far;
  if (!limit.distances.empty()) {
    near = std::max(near, FromOrigin(limit.distances.near, position));
    far = std::min(far, FromOrigin(limit.distances.far, position));
  }
  return {near, far};
}

/// Of a limit whose side is open: what the nearest depths behind and in front of the focal plane are blurred by, over A
/// Z_s; 0 with the plane among them.
double PositionBlur::LeastToEitherSide(const Limit& limit, const FocusPosition& position, double& at) const {
  const double plane = position.focal_plane.value;
  double least = -kNone;
  const auto consider = [&](double vergence) {
    const double off =
        std::max(std::abs(plane - vergence) - Bound(position, vergence), 0.0) / Divisor(vergence, position);
    if (off < least) least = off, at = vergence;
  };
  const auto search = [&](const Stretches& stretches, double place, const auto& vergence_of) {
    const auto next = std::ranges::lower_bound(stretches, place, {}, &std::pair<double, double>::second);
    if (next != stretches.end()) {
      if (next->first <= place) least = 0.0, at = plane;
      consider(vergence_of(next->first));
    }
    if (next != stretches.begin()) consider(vergence_of(next[-1].second));
  };
  search(limit.open_vergences, plane, [](double vergence) { return vergence; });
  if (!limit.open_distances.empty()) {
    const double place = plane > 0.0 ? 1.0 / (1.0 / plane + origin_.At(position).value) : plane;
    search(limit.open_distances, place, [&](double inverse) { return FromOrigin(inverse, position); });
    const auto among = [&](const auto& ends) { return (plane < ends.first) != (place < ends.second); };
    if (std::ranges::any_of(limit.open_mixed, among)) least = 0.0, at = plane;
  }
  return least;
}

OpeningNeed PositionBlur::Need(std::size_t index, const FocusPosition& position) const {
  const Limit& limit = limits_[index];
  const double scale = lens_.focal_length.value * position.sensor_distance.value;
  const double plane = position.focal_plane.value;
  OpeningNeed need{.limit = limit.asked->limit.value, .sharp = limit.asked->kind == LimitKind::Sharp};
  const auto [near, far] = Depths(index, position);
  if (need.sharp) {
    const double at_near = (std::abs(plane - near) + Bound(position, near)) / Divisor(near, position);
    const double at_far = (std::abs(plane - far) + Bound(position, far)) / Divisor(far, position);
    need.at = at_near >= at_far ? near : far;
    need.geometric = scale * std::max(at_near, at_far) * larger_;
    if (airy_ > 0.0) {
      const double magnification = position.extension / position.focal_length;
      need.diffraction = airy_ * Breathing(position) * (1.0 + magnification / request_.pupil_factor.value);
    }
    return need;
  }
  double least = 0.0;
  if (limit.asked->side == Side::Either) {
    least = LeastToEitherSide(limit, position, need.at);
  } else {
    const bool behind = limit.asked->side == Side::Behind;
    need.at = behind ? near : far;
    const double off = behind ? plane - near : far - plane;
    least = std::max(off - Bound(position, need.at), 0.0) / Divisor(need.at, position);
  }
  need.geometric = scale * least * smaller_;
  return need;
}

PlanRequest PositionBlur::AtPosition(const FocusPosition& position, const IrisPosition& iris, Limits limits) const {
  PlanRequest request;
  request.liquid = lens_.liquid;
  request.focal_length = lens_.liquid ? position.sensor_distance.value : position.focal_length.value;
  const double breathing = Breathing(position), z = position.sensor_distance.value;
  const Metres extension =
      lens_.liquid ? LiquidExtension(position.sensor_distance, position.extension) : position.extension;
  request.extensions = {extension.value, extension.value};
  const double n = iris.f_number.value;
  request.f_numbers = {n * breathing, n * breathing};
  const double bound = position.bound.value;
  request.sensor_tolerance =
      std::min(std::max(request_.sensor_tolerance.value, bound * z * z / std::max(1.0 - bound * z, 0.5)), 0.5 * z);
  const auto [low, high] = FNumbers(iris);
  const double scale = std::max(larger_, 1.0 / smaller_);
  request.f_number_tolerance = std::min(std::max(1.0 - low / (n * scale), high * scale / n - 1.0), 0.9);
  request.wavelength = request_.wavelength;
  request.diffraction = request_.diffraction;
  request.pupil_factor = request_.pupil_factor;
  request.objective = request_.objective;
  request.depth_limit = request_.depth_limit;
  request.calibration_error = request_.calibration_error;
  request.pixel = request_.pixel;
  request.model_tolerance = request_.model_tolerance;
  const auto centred = [&](const PlanDepth& depth) {
    if (depth.is_vergence || IsInfinity(depth)) return depth;
    const double behind = origin_.At(position).value;
    if (behind == 0.0) return depth;
    return PlanDepth::Distance(std::max(depth.number.value - behind, 1.0 / kAtTheLens));
  };
  if (request_.focus) request.focus = centred(*request_.focus);
  if (limits == Limits::LeftOut) return request;
  request.limits = request_.limits;
  for (BlurLimit& limit : request.limits) {
    for (DepthInterval& interval : limit.depths) {
      interval = {centred(interval.one_end), centred(interval.other_end)};
    }
  }
  return request;
}

}  // namespace lensd::optics
