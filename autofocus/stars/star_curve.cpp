// Tracks, hyperbolas and what they agree on. Nothing here asks for frames.
#include "autofocus/stars/star_curve.h"

#include <algorithm>
#include <cmath>

#include "autofocus/algebra/matrix3.h"
#include "autofocus/stars/star_patch.h"

namespace lensd::autofocus {
namespace {

constexpr double kDriftPx = 3.0;         ///< between neighbouring frames, besides a part of the star's size
constexpr double kDriftPart = 0.5;       ///< of its half-flux radius
constexpr std::size_t kLeastPoints = 5;  ///< of a curve
constexpr double kPixelPhase = 0.06;     ///< px of HFR that hang on where in a pixel the star stands
constexpr double kShape = 0.03;          ///< of the HFR: what no hyperbola explains
constexpr double kClearCurve = 6.0;      ///< standard deviations of the curvature
constexpr double kPixelRadius = 0.5;     ///< px: what is smaller hangs on where in its pixel it stands
constexpr double kMostScatter = 0.25;    ///< of the HFR, root mean square
constexpr double kElsewherePx = 4.5;     ///< of blur from the answer
constexpr double kMostElsewhere = 0.3;   ///< of the stars
constexpr double kLeastSigmaPx = 0.1;    ///< of blur

}  // namespace

const StarTrack* TrackOf(const Star& star, std::span<const StarTrack> tracks) {
  const StarTrack* nearest = nullptr;
  double least = 0.0;
  for (const StarTrack& track : tracks) {
    const double size = std::max(star.hfr_px, track.points.back().hfr_px);
    const double distance = std::hypot(star.x - track.x, star.y - track.y);
    if (distance > kDriftPx + kDriftPart * size || (nearest != nullptr && distance >= least)) continue;
    nearest = &track;
    least = distance;
  }
  return nearest;
}

std::vector<StarTrack> Follow(std::span<const StarLook> looks) {
  std::vector<StarTrack> tracks;
  for (const StarLook& look : looks) {
    const std::vector<StarTrack> before = tracks;
    for (const Star& star : look.stars) {
      const HfrPoint point{look.position, star.hfr_px, star.hfr_sigma};
      const StarTrack* known = TrackOf(star, before);
      if (known == nullptr) {
        tracks.push_back({star.x, star.y, {point}});
        continue;
      }
      StarTrack& track = tracks[static_cast<std::size_t>(known - before.data())];
      if (track.points.size() > known->points.size()) continue;  // another one of this frame was there first
      track.x = star.x;
      track.y = star.y;
      track.points.push_back(point);
    }
  }
  return tracks;
}

double HfrFit::At(double where) const {
  return std::hypot(least_px, slope * (where - position));
}

std::optional<HfrFit> FitHfr(std::span<const HfrPoint> points, double px) {
  if (points.size() < kLeastPoints) return std::nullopt;
  double middle = 0.0;
  for (const HfrPoint& point : points) middle += point.position / static_cast<double>(points.size());
  Matrix3 matrix{};
  Vector3 right{};
  const auto terms = [&](const HfrPoint& point) {
    const double x = (point.position - middle) / px;
    return Vector3{1.0, x, x * x};
  };
  const auto sigma_of = [](const HfrPoint& point) {
    return 2.0 * point.hfr_px * std::hypot(point.sigma, kPixelPhase + kShape * point.hfr_px);
  };
  for (const HfrPoint& point : points) {
    const Vector3 at = terms(point);
    const double weight = 1.0 / std::pow(sigma_of(point), 2);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) matrix[i][j] += weight * at[i] * at[j];
      right[i] += weight * at[i] * point.hfr_px * point.hfr_px;
    }
  }
  const auto covariance = InverseOfSymmetric(matrix);
  if (!covariance) return std::nullopt;
  Vector3 found{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) found[i] += (*covariance)[i][j] * right[j];
  }
  const auto& [level, tilt, curve] = found;
  if (!(curve > kClearCurve * std::sqrt((*covariance)[2][2]))) return std::nullopt;
  const double place = -tilt / (2.0 * curve);
  HfrFit fit;
  fit.position = middle + place * px;
  fit.least_px = std::sqrt(std::max(level - curve * place * place, 0.0));
  fit.slope = std::sqrt(curve) / px;
  double residual2 = 0.0, scatter2 = 0.0;
  for (const HfrPoint& point : points) {
    const Vector3 at = terms(point);
    const double miss = point.hfr_px * point.hfr_px - level - tilt * at[1] - curve * at[2];
    residual2 += std::pow(miss / sigma_of(point), 2);
    scatter2 += std::pow((fit.At(point.position) - point.hfr_px) / (point.hfr_px + kPixelRadius), 2) /
                static_cast<double>(points.size());
  }
  if (scatter2 > kMostScatter * kMostScatter) return std::nullopt;
  const double by_tilt = -0.5 / curve, by_curve = -place / curve;
  const double variance = by_tilt * by_tilt * (*covariance)[1][1] + 2.0 * by_tilt * by_curve * (*covariance)[1][2] +
                          by_curve * by_curve * (*covariance)[2][2];
  const double beyond = std::max(1.0, residual2 / static_cast<double>(points.size() - 3));
  fit.sigma = px * std::sqrt(std::max(variance, 0.0) * beyond);
  return fit;
}

std::vector<FittedStar> FitStars(std::span<const StarTrack> tracks, double px) {
  std::vector<FittedStar> stars;
  for (const StarTrack& track : tracks) {
    const auto fit = FitHfr(track.points, px);
    if (fit && 3.0 * fit->sigma < 2.0 * kHalfDepthOfFieldPx * px) stars.push_back({track, *fit});
  }
  return stars;
}

std::optional<StarFocusPlace> AgreeOn(std::span<const FittedStar> stars, double px) {
  if (stars.empty()) return std::nullopt;
  std::vector<double> places;
  for (const FittedStar& star : stars) places.push_back(star.fit.position);
  const double middle = MedianOf(places);
  StarFocusPlace agreed;
  double weights = 0.0, sum = 0.0;
  for (const FittedStar& star : stars) {
    if (std::abs(star.fit.position - middle) > kElsewherePx * px) continue;
    const double weight = 1.0 / std::pow(std::max(star.fit.sigma, kLeastSigmaPx * px), 2);
    weights += weight;
    sum += weight * star.fit.position;
    agreed.agreeing.push_back(star);
  }
  agreed.position = sum / weights;
  double residual2 = 0.0;
  for (const FittedStar& star : agreed.agreeing) {
    residual2 += std::pow((star.fit.position - agreed.position) / std::max(star.fit.sigma, kLeastSigmaPx * px), 2);
  }
  const auto count = static_cast<double>(agreed.agreeing.size());
  const double beyond = count > 1.0 ? std::max(1.0, residual2 / (count - 1.0)) : 1.0;
  agreed.sigma = std::max(std::sqrt(beyond / weights), kLeastSigmaPx * px);
  agreed.confidence = std::erf(kHalfDepthOfFieldPx * px / (agreed.sigma * std::sqrt(2.0)));
  if (static_cast<double>(stars.size()) - count > kMostElsewhere * static_cast<double>(stars.size())) {
    std::ranges::sort(places);
    for (const double place : places) {
      if (agreed.several.empty() || place - agreed.several.back() > kElsewherePx * px) agreed.several.push_back(place);
    }
  }
  return agreed;
}

}  // namespace lensd::autofocus
