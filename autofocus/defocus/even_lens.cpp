// A lens that earlier runs have measured, and whose blur they saw grow alike on both sides of focus: frames far from
// the focus place it between them, so that three are enough. One where the lens stands, one beyond the focus, one
// there. What is open is how much the two sides differ: two frames at distances a and b from a focus that blur places
// where their blurs say it is are off by 2 u a b / (a + b), where half the logarithm of the ratio of both slopes is
// off by u.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "autofocus/defocus/defocus.h"
#include "autofocus/slope_learner.h"

namespace lensd::autofocus {
namespace {

constexpr double kMostOpenPx = 0.7;   // px of blur, a standard deviation
constexpr double kMostSigmaPx = 0.7;  // px of blur, of the estimate under slopes as learned
constexpr std::size_t kMostTaken = 4;
constexpr double kAsLastTime = 0.25,
                 kAsLastTimePx = 4.0;  // so near to the last focus, of the way and in px of blur ...
constexpr double kAsLikely = 0.05;     // ... so much probability is enough to try
constexpr double kBeyond = 1.05,
                 kBeyondPx = 4.0;  // of the way to the focus; px of blur behind it, at least

}  // namespace

using defocus::Posterior;
using defocus::RingStack;

/// Beyond the focus, where one frame may well have as much blur as the place of the last focus would give it: one
/// frame does not tell the side, but lenses mostly look at what they looked at before. The wrong side costs a frame.
std::optional<Advice> Defocus::GoBeyondLastFocus(const Posterior& posterior) {
  if (!(setup_.slope_sigma > 0) || !setup_.uneven || !setup_.last_focus) return std::nullopt;
  const double at = taken_.front().at;
  const double last = *setup_.last_focus / *setup_.blur_px;
  const double far = std::abs(last - at);
  if (posterior.MassNear(last, std::max(kAsLastTime * far, kAsLastTimePx)) < kAsLikely) return std::nullopt;
  const double room = last > at ? setup_.highest / *setup_.blur_px - at : at - setup_.lowest / *setup_.blur_px;
  const double way = std::min(std::max(kBeyond * far, far + kBeyondPx), room);
  if (way < far + kBeyondPx || OpenBy(far, way - far) > kMostOpenPx) return std::nullopt;
  const double to = at + std::copysign(way, last - at);
  const bool against = setup_.ascending ? last < at : last > at;
  return GoTo(to, against && setup_.backlash > 0 ? Backlash::Open : Backlash::TakenUp);
}

/// By how much the nearest frames beside `focus` leave it open, by what is known of the lens; nothing: there are none
/// on some side, or it is not known.
std::optional<double> Defocus::OpenBetween(const std::vector<CurvePoint>& points, double focus) const {
  if (!(setup_.slope_sigma > 0) || !setup_.uneven) return std::nullopt;
  const double least = ReachOfSides(setup_).least;
  std::optional<double> below, above;
  for (const CurvePoint& point : points) {
    const double off = point.position - focus;
    if (off <= -least) below = std::min(below.value_or(-off), -off);
    if (off >= least) above = std::min(above.value_or(off), off);
  }
  if (!below || !above) return std::nullopt;
  return OpenBy(*below, *above);
}

/// What frames so far from the focus on its two sides leave open, in the unit of both.
double Defocus::OpenBy(double below, double above) const {
  return 2.0 * *setup_.uneven * below * above / (below + above);
}

/// To the focus that far frames place, and there the answer. Nothing: they do not, or what is seen there does not bear
/// it out.
std::optional<Advice> Defocus::BetweenFarFrames(const Look& look, const std::vector<CurvePoint>& points, double focus,
                                                const RingStack& stack, const Posterior& posterior) {
  const double px = *setup_.blur_px;
  const auto open = taken_.size() <= kMostTaken ? OpenBetween(points, focus) : std::nullopt;
  if (!open || *open > kMostOpenPx * px || posterior.sigma() > kMostSigmaPx) return std::nullopt;
  if (IsOfAnotherLens(std::log(posterior.relative_slope()), setup_.slope_sigma)) return std::nullopt;
  const double stands = std::max(NearPx(setup_), 0.55 * setup_.resolution);
  const CurvePoint& centre = *NearestTo(points, focus);
  if (std::abs(centre.position - focus) > stands)
    return taken_.size() < kMostTaken ? std::optional(GoTo(focus / px)) : std::nullopt;
  const double all = setup_.highest - setup_.lowest, least = ReachOfSides(setup_).least;
  for (const double sign : {1.0, -1.0}) {
    if (SeenOnSide(points, centre, sign * least, sign * all) != SideSeen::LessSharp) return std::nullopt;
  }
  if (look.position != centre.position) return GoAndLook{centre.position};
  Advice judged = Judge(centre, focus, 2.0 * *open, stack, posterior);
  if (auto* verdict = std::get_if<Verdict>(&judged)) verdict->proven = verdict->focused;
  return judged;
}

/// Half the logarithm of the slope above the focus over that below: from the nearest frames on both sides, the one
/// there and the farthest that may count. The blur of two on one side tells where the focus is by itself.
std::optional<double> Defocus::ShownUneven(const Posterior& posterior, const CurvePoint& centre) const {
  constexpr double kFarthest = 60.0;  // px of blur
  const double px = *setup_.blur_px, least = ReachOfSides(setup_).least / px, most = ReachOfSides(setup_).most / px;
  const double at = centre.position / px;
  std::vector<const Taken*> sorted;
  for (const Taken& taken : taken_) {
    if (!taken.backlash_open) sorted.push_back(&taken);
  }
  std::ranges::stable_sort(sorted, {}, [&](const Taken* taken) { return std::abs(taken->at - at); });
  std::vector<const Taken*> frames;
  const auto add = [&](const auto& fits) {
    const auto found = std::ranges::find_if(sorted, [&](const Taken* taken) { return fits(taken->at - at); });
    if (found == sorted.end()) return false;
    frames.push_back(*found);
    sorted.erase(found);
    return true;
  };
  if (!add([](double) { return true; })) return std::nullopt;
  if (!add([&](double off) { return off >= least && off <= kFarthest; })) return std::nullopt;
  if (!add([&](double off) { return off <= -least && off >= -kFarthest; })) return std::nullopt;
  const bool near = std::ranges::any_of(frames, [&](const Taken* taken) {
    return std::abs(taken->at - at) >= least && std::abs(taken->at - at) <= most;
  });
  std::ranges::reverse(sorted);
  if (!near || !add([&](double off) { return std::abs(off) >= 2.0 * least && std::abs(off) <= kFarthest; }))
    return std::nullopt;
  std::vector<double> positions;
  for (const Taken* taken : frames) positions.push_back(taken->at);
  const RingStack stack = StackOf(frames);
  return posterior.UnevenOf(defocus::Likelihood(stack, positions));
}

}  // namespace lensd::autofocus
