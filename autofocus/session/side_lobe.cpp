// A curve that rises again is no proof: two depths in a region do that too. Few frequencies are none either: a grating
// in focus has no others. Both together leave open which top is the focus.
#include "autofocus/session/side_lobe.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "autofocus/defocus/repeats.h"
#include "autofocus/defocus/spectrum.h"

namespace lensd::autofocus {
namespace {

constexpr double kOfTop = 1.0 / 12.0;
constexpr double kSigmas = 4.0;
constexpr double kFlicker = 0.03;    ///< of sharpness: what changes from frame to frame besides noise, as hot pixels do
constexpr double kRepeats = 1.2;     ///< RiseWithBlur()
constexpr double kMostBlur = 100.0;  ///< px
constexpr int kMostSide = 256;       ///< px
constexpr double kGratings = 0.6;    ///< ShareOfTwoGratings() of a small window
constexpr double kNearPx = 6.0;      ///< of blur as told: nearer, its shape matters
constexpr double kSlope = 0.7;       ///< of the told blur, at least
constexpr double kTimes = 2.5;       ///< what is left
constexpr double kLeftAnyhow = 0.002;  ///< of the top: shading, and what the spectrum does not show

/// From `begin`, the top, away from it.
template <class Iterator>
bool RisesFrom(const Iterator& begin, const Iterator& end, double top) {
  CurvePoint least = *begin;
  for (auto point = begin; point != end; ++point) {
    const double rise = point->value - least.value;
    if (rise > kOfTop * top && rise > kSigmas * std::hypot(point->sigma, least.sigma)) return true;
    if (point->value < least.value) least = *point;
  }
  return false;
}

bool RisesAgain(std::span<const CurvePoint> points, const CurvePoint& top) {
  const auto here = std::ranges::lower_bound(points, top.position, {}, &CurvePoint::position);
  const auto below = std::make_reverse_iterator(here);
  return (here != points.end() && RisesFrom(here, points.end(), top.value)) ||
         (below != points.rend() && RisesFrom(below, points.rend(), top.value));
}

/// `left`: SharpnessUnderBlur() of the picture at the top. What no focus changes shows in the least sharp frame too.
bool LeavesMore(std::span<const CurvePoint> points, const CurvePoint& top, double px, std::vector<double> left) {
  for (std::size_t i = left.size() - 1; i > 0; --i) left[i - 1] = std::max(left[i - 1], left[i]);
  const CurvePoint least = *std::ranges::min_element(points, {}, &CurvePoint::value);
  return std::ranges::any_of(points, [&](const CurvePoint& point) {
    const double blur = std::abs(point.position - top.position) / px;
    const auto i = static_cast<std::size_t>(kSlope * blur / defocus::kBlurStep);
    return blur > kNearPx && i < left.size() &&
           point.value - least.value > (kTimes * left[i] + kLeftAnyhow) * (top.value - least.value) +
                                           kSigmas * std::hypot(point.sigma, least.sigma) + kFlicker * point.value;
  });
}

}  // namespace

bool MayBeSideLobe(std::span<const CurvePoint> points, const CurvePoint& top, double px, const drivers::Frame& frame,
                   const Window& window) {
  Window inner = window;
  inner.width = std::min(window.width, kMostSide);
  inner.height = std::min(window.height, kMostSide);
  inner.x += (window.width - inner.width) / 2;
  inner.y += (window.height - inner.height) / 2;
  const defocus::Tiles picture = {defocus::SpectrumOf(frame, defocus::TilesOf(inner, kMostSide).front())};
  if (std::min(window.width, window.height) <= defocus::kSmallSide) {
    return RisesAgain(points, top) && defocus::ShareOfTwoGratings(picture.front()) > kGratings;
  }
  if (defocus::RiseWithBlur(picture, kMostBlur) <= kRepeats) return false;
  return RisesAgain(points, top) ||
         (px > 0 && LeavesMore(points, top, px, defocus::SharpnessUnderBlur(picture, kMostBlur)));
}

}  // namespace lensd::autofocus
