// A subject so near the end of the travel that no frame beyond it can be taken: what takes the place of the less sharp
// frame on that side.
#include <algorithm>
#include <cmath>
#include <optional>

#include "autofocus/defocus/defocus.h"
#include "autofocus/peak_fit.h"

namespace lensd::autofocus {
namespace {

/// Where the parabola through (0, at_end), (x1, y1), (x2, y2) has its top. Nothing: it has none.
std::optional<double> ParabolaTop(double at_end, double x1, double y1, double x2, double y2) {
  const double first = (y1 - at_end) / x1, second = (y2 - y1) / (x2 - x1);
  const double curvature = (second - first) / x2;
  if (!(curvature < 0.0)) return std::nullopt;
  return 0.5 * (x1 - first / curvature);
}

/// The top of sharpness in position, unless it may lie beyond the end by more than standing there still gets into
/// focus. Fine textures fall off as one over a parabola, coarse ones as a Gaussian: the first takes a Gaussian's top
/// for nearer than it is, the second a hyperbola's for farther, so both must place it near, also where noise has
/// lowered the frame at the end. `unit`: a px of blur, towards the other end.
std::optional<double> TopOfThree(const CurvePoint& last, const CurvePoint& next, const CurvePoint& off, double end,
                                 double unit) {
  constexpr double kSigmas = 3.0, kMostByHyperbola = 1.0, kMostByGaussian = 2.5;  // px of blur beyond the end
  const double x1 = (next.position - last.position) / unit, x2 = (off.position - last.position) / unit;
  std::optional<double> top;
  for (const double doubt : {kSigmas * std::hypot(last.sigma, next.sigma), 0.0}) {
    const double value = last.value + doubt;
    const auto hyperbola = ParabolaTop(-1.0 / value, x1, -1.0 / next.value, x2, -1.0 / off.value);
    const auto gaussian = ParabolaTop(std::log(value), x1, std::log(next.value), x2, std::log(off.value));
    if (!hyperbola || !gaussian || *hyperbola < -kMostByHyperbola || *gaussian < -kMostByGaussian) return std::nullopt;
    top = end + 0.5 * (*hyperbola + *gaussian) * unit;
  }
  return top;
}

}  // namespace

using defocus::Posterior;
using defocus::RingStack;

bool Defocus::BestIsAtAnEnd() const {
  const auto points = curve_.Points();
  return AtTheEnd(setup_, points, *std::ranges::max_element(points, {}, &CurvePoint::value));
}

/// Nearly all probability lies where the lens cannot go.
bool Defocus::Beyond(const Posterior& posterior) const {
  const double below = posterior.MassBelow(setup_.lowest / *setup_.blur_px - kHalfDepthOfFieldPx);
  const double inside = posterior.MassBelow(setup_.highest / *setup_.blur_px + kHalfDepthOfFieldPx) - below;
  constexpr double kNearlyAll = 0.99;
  return inside < 1.0 - kNearlyAll;
}

/// The end, where blur places the focus short of it by less than a frame beside an answer has to be away, or beyond it
/// by no more than what standing at the end still gets into focus.
std::optional<double> Defocus::EndBeside(const Posterior& posterior) const {
  constexpr double kBeyondPx = 1.0;
  const double px = *setup_.blur_px;
  const double least = ReachOfSides(setup_).least;
  for (const double end : {setup_.lowest, setup_.highest}) {
    const double inside = (posterior.focus() * px - end) * (end == setup_.lowest ? 1.0 : -1.0);
    if (inside < least && inside > -std::max(kBeyondPx * px, 0.5 * setup_.resolution)) return end;
  }
  return std::nullopt;
}

/// Three frames tell a curve that has its top at the end or short of it from one that still climbs there: one far
/// enough from the end to be less sharp, one just short of it and one at the end. Nothing: it climbs, or noise leaves
/// it open.
std::optional<Advice> Defocus::JudgeEnd(double end, const Look& look, const RingStack& stack,
                                        const Posterior& posterior) {
  struct Spot {
    double wanted, least, most;  // px of blur from the end
  };
  constexpr Spot kFar{5.0, 3.5, 8.0}, kShort{1.2, 0.8, 2.2}, kAtEnd{0.0, 0.0, 0.4};
  const double px = *setup_.blur_px;
  const double unit = std::max(px, setup_.resolution / kShort.wanted) * (end == setup_.lowest ? 1.0 : -1.0);
  if (setup_.highest - setup_.lowest < kFar.most * std::abs(unit)) return std::nullopt;
  for (const Spot& spot : {kFar, kShort, kAtEnd}) {
    const auto there = [&](const Taken& taken) {
      const double inside = (taken.position - end) / unit;
      return !taken.backlash_open && inside >= spot.least && inside <= spot.most;
    };
    if (std::ranges::any_of(taken_, there)) continue;
    if (taken_.size() + 1 >= kFrameBudget) return std::nullopt;
    return GoTo((end + spot.wanted * unit) / px);
  }
  const auto points = curve_.Points();
  const CurvePoint last = *NearestTo(points, end);
  const CurvePoint next = *NearestTo(points, end + kShort.wanted * unit);
  const CurvePoint off = *NearestTo(points, end + kFar.wanted * unit);
  if (!(std::min({last.value, next.value, off.value}) > 0.0)) return std::nullopt;
  const auto top = TopOfThree(last, next, off, end, unit);
  if (!top) return std::nullopt;
  const double estimate = std::clamp(posterior.focus() * px, setup_.lowest, setup_.highest);
  const double vertex = std::clamp(*top, setup_.lowest, setup_.highest);
  if (std::abs(vertex - estimate) > std::max(kTrustedPx * px, setup_.resolution)) return std::nullopt;
  const CurvePoint* centre = NearestTo(points, 0.5 * (vertex + estimate));
  if (look.position != centre->position) return GoAndLook{centre->position};
  return Judge(*centre, 0.5 * (vertex + estimate), std::abs(vertex - estimate), stack, posterior);
}

}  // namespace lensd::autofocus
