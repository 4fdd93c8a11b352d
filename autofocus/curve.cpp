#include "curve.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "autofocus/peak_model.h"
#include "autofocus/sharpness.h"

namespace lensd::autofocus {
namespace {

constexpr double kClearProminence = 6.0;  ///< standard deviations of the noise
constexpr double kClearContrast = 0.1;    ///< of the peak over the rest of the range
constexpr double kHalfDepthOfFieldPx = 2.0;
constexpr double kOverexposed = 1e-3;  ///< of the region: more than so many more clipped pixels in some frames
constexpr double kSigmas = 3.0;

/// The finer passes crowd around the top, so not the median.
double LowerQuartile(std::vector<CurvePoint> points) {
  const auto quarter = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 4);
  std::ranges::nth_element(points, quarter, {}, &CurvePoint::value);
  return quarter->value;
}

std::vector<CurvePoint> Around(const std::vector<CurvePoint>& points, double centre, double reach) {
  std::vector<CurvePoint> near;
  for (const CurvePoint& point : points) {
    if (std::abs(point.position - centre) <= reach && point.value > 2 * point.sigma) near.push_back(point);
  }
  return near;
}

/// The end of the range where the top of the curve lies, if it does: there sharpness is level and then falls, while
/// short of a subject beyond the range it still climbs. Blur falls evenly with position, so a curve that climbs loses
/// about as much in its last step as in the one before.
std::optional<double> FlatEnd(const std::vector<CurvePoint>& points, double top, double step) {
  constexpr double kAsSharp = 0.97;
  constexpr double kLevel = 0.25;  ///< of the fall three steps away: straight would be a third, a parabola a ninth
  const auto flat = [&](auto begin, auto end) {
    const CurvePoint& last = *begin;
    const auto distance = [&](const CurvePoint& point) { return std::abs(point.position - last.position); };
    const auto next = std::find_if(begin, end, [&](const CurvePoint& point) { return distance(point) > 0.5 * step; });
    const auto off = std::find_if(begin, end, [&](const CurvePoint& point) { return distance(point) > 2.5 * step; });
    if (off == end || last.value < kAsSharp * top) return false;
    const double noise = kSigmas * std::hypot(last.sigma, next->sigma);
    return std::max(last.value - next->value, 0.0) + noise < kLevel * (last.value - off->value);
  };
  if (flat(points.begin(), points.end())) return points.front().position;
  if (flat(points.rbegin(), points.rend())) return points.back().position;
  return std::nullopt;
}

std::string Reason(double prominence, const PeakChoice* choice) {
  std::ostringstream reason;
  reason.precision(3);
  reason << "one peak in the range, " << prominence << " times the noise above the rest";
  if (choice != nullptr) {
    reason << ", best as a " << PeakModelName(choice->model);
    std::string separator = " (";
    for (std::size_t i = 0; i < kPeakModels.size(); ++i) {
      if (!choice->fits[i].rejected) continue;
      reason << separator << PeakModelName(kPeakModels[i]) << " rejected: F = " << choice->fits[i].f;
      separator = ", ";
    }
    if (separator == ", ") reason << ", limit " << choice->f_limit << ")";
  }
  reason << ", checked by a last frame";
  return reason.str();
}

}  // namespace

Verdict Refuse(std::string reason) {
  Verdict verdict;
  verdict.reason = std::move(reason);
  return verdict;
}

void SharpnessCurve::SetFrame(const Look& look) {
  if (look.frame != nullptr) bits_ = look.frame->bits;
  pixels_ = std::max(look.window.width * look.window.height, 1);
}

void SharpnessCurve::Add(const Look& look) {
  samples_.push_back({look.position, look.position_sigma, look.score});
}

std::vector<CurvePoint> SharpnessCurve::Points() const {
  std::vector<FocusScore> scores;
  for (const CurveSample& sample : samples_) scores.push_back(sample.score);
  const double noise = NoiseVariance(scores, bits_);
  std::vector<CurvePoint> points;
  for (const CurveSample& sample : samples_) {
    const Sharpness sharpness = SharpnessOf(sample.score, noise, pixels_);
    points.push_back({sample.position, sharpness.value, sharpness.sigma, sample.position_sigma});
  }
  std::ranges::sort(points, {}, &CurvePoint::position);
  return points;
}

bool SharpnessCurve::Overexposed() const {
  const auto [least, most] =
      std::ranges::minmax(samples_, {}, [](const CurveSample& sample) { return sample.score.saturated_fraction; });
  return most.score.saturated_fraction - least.score.saturated_fraction > kOverexposed;
}

std::optional<CurveTop> TopOf(const std::vector<CurvePoint>& points) {
  const auto top = std::ranges::max_element(points, {}, &CurvePoint::value);
  const double rest = LowerQuartile(points);
  const double above = top->value - rest;
  if (above < kClearProminence * top->sigma || above < kClearContrast * top->value) return std::nullopt;
  return CurveTop{static_cast<std::size_t>(top - points.begin()), above / top->sigma, rest};
}

Verdict JudgePeak(const Setup& setup, const SharpnessCurve& curve, const std::vector<CurvePoint>& points,
                  const CurveTop& top, double reach, double step) {
  const CurvePoint& highest = points[top.index];
  const double allowed = setup.blur_px ? kHalfDepthOfFieldPx * *setup.blur_px : 2 * step;
  const bool at_end = top.index == 0 || top.index + 1 == points.size();
  std::string trouble = "sharpest at the end of the focus range: the subject may lie beyond what this lens reaches";
  std::optional<PeakChoice> peak;
  if (!at_end) {
    auto choice = ChoosePeak(Around(points, highest.position, reach));
    if (!choice) {
      trouble = std::move(choice.error());
    } else if (kSigmas * choice->sigma > allowed) {
      trouble = "noise leaves open where the sharpest place is";
    } else if (std::abs(choice->position - highest.position) > 2 * step) {
      trouble = "the sharpest frames do not agree on one peak";
    } else {
      peak = *choice;
    }
  }
  double position = 0.0, sigma = 0.5 * step;
  if (peak) {
    position = peak->position;
    sigma = peak->sigma;
  } else {
    const auto end = FlatEnd(points, highest.value, step);
    if (!end) return Refuse(trouble);
    position = *end;
  }
  if (curve.Overexposed()) {
    return Refuse("too much of the region is clipped when sharp: a clipped light looks sharpest out of focus");
  }
  Verdict verdict;
  verdict.focused = true;
  verdict.position = std::clamp(position, setup.lowest, setup.highest);
  verdict.sigma = std::max(sigma, setup.resolution / std::sqrt(12.0));
  verdict.confidence = std::erf(allowed / (std::sqrt(2.0) * verdict.sigma));
  verdict.reason = Reason(top.prominence, peak ? &*peak : nullptr);
  return verdict;
}

}  // namespace lensd::autofocus
