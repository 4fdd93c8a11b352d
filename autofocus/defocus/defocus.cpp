// Which place the method asks for next, and when it believes an answer: first from blur alone, then, where blur has no
// say, from the sharpest frames seen.
#include "autofocus/defocus/defocus.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "autofocus/peak_fit.h"
#include "autofocus/slope_learner.h"

namespace lensd::autofocus {
namespace {

using defocus::Posterior;
using defocus::RingStack;

constexpr double kPastFocus = 1.25;  // the same where it is to lie behind the focus
constexpr double kShortestStep = 8.0;
constexpr double kLongestStep = 80.0;
constexpr double kClearlyOneSide = 0.65;
constexpr double kClearlyBack = 0.5;  // for a backlash_open frame
constexpr double kMostMisfit = 0.6;
constexpr double kMisfitPx = 1.5, kMostMisfitPx = 0.5;  // px of blur by which a misfit may move the answer
constexpr double kMostLeftOut = 0.8;                    // of the region
constexpr double kFewLeft = 0.5;                        // less is no judge of several depths
constexpr double kClearMotion = 1.5;                    // px sideways
constexpr double kWorthNaming = 0.1;  // of all probability: a distance that cannot be told from the others
constexpr Why kMoved{Cause::SubjectMoved, "the subject or the camera moved between the frames"};
constexpr Why kRestless{
    Cause::SubjectMoved,
    "the picture changes although the lens reports that it stands: the lens or the subject still moves"};
constexpr Why kOneGrating{Cause::Ambiguous, "the texture is periodic: several distances give equal contrast"};
constexpr double kStandsPx = 1.0;  // px of blur between the top and the frame that counts as standing there
constexpr double kTrustedMass = 0.9;
constexpr double kNearPx = 9.0;    // px of blur between less sharp frames that hold a top between them
constexpr double kOddSlope = 0.1;  // between frames near and far: more, and some did not stand where they say
// Of what noise leaves, gradient energy over blur b falls about as (1 + (b/w)^2)^-1.7 on pictures and print.
constexpr double kCurvePower = -0.6;
constexpr double kClearTop = 1.3;  // over what is seen on either side: without the help of the optics less is no top

/// A few frequencies stand far out of the noise and the others show nothing.
bool Repeats(const RingStack& stack) {
  constexpr double kFarOut = 100.0;  // times the power of the noise
  return std::ranges::any_of(stack.rings, [&](const defocus::Ring& ring) {
    for (int i = 0; i < stack.frames; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (ring.power[at * defocus::kMostFrames + at] > kFarOut * stack.noise[at]) return true;
    }
    return false;
  });
}

}  // namespace

/// Where no search for the sharpest place could do better.
Verdict Defocus::RefuseForGood(const Why& why) {
  Verdict verdict = Refuse(why);
  verdict.final = true;
  return verdict;
}

Advice Defocus::Next(const Look& look) {
  if (!setup_.blur_px) {
    return Refuse({Cause::Uncalibrated, "depth from defocus needs a calibrated lens: blur per step is not known"});
  }
  Take(look);
  if (LeftOut() > kMostLeftOut) return Refuse(kTooBright);
  Register();
  const std::vector<const Taken*> frames = Nearest(focus_);
  registered_ = false;
  RingStack stack = StackOf(frames);
  Posterior posterior = PosteriorOf(stack, frames);
  if (moved_ > 0 && posterior.misfit() > kMostMisfit) {
    // A scene that stands still does not explain the frames: perhaps one that moved sideways does.
    registered_ = true;
    RingStack moved_stack = StackOf(frames);
    Posterior moved = PosteriorOf(moved_stack, frames);
    registered_ = moved.misfit() <= kMostMisfit;
    if (registered_) {
      stack = std::move(moved_stack);
      posterior = std::move(moved);
    }
  }
  // Of one period, or next to nothing, what lies at another contrast looks like another picture: a search can tell.
  if (unlike_) return defocus::HasTexture(stack) ? RefuseForGood(kMoved) : WhyNot(stack, posterior);
  focus_ = posterior.focus();
  if (taken_.size() == 1) return GoToSecond(posterior);
  if (defocus::IsOneGrating(stack)) return Refuse(kOneGrating);
  if (taken_[taken_.size() - 2].followed || Restless()) return may_move() ? Follow(look) : RefuseForGood(kRestless);
  if (taken_.size() >= 3 && !defocus::HasTexture(stack)) {
    const auto top = TopOf(curve_.Points());
    if (!top && taken_.size() >= kFramesWithoutTexture) return WhyNot(stack, posterior);
  }
  if (taken_.size() >= kFrameBudget) return WhyNot(stack, posterior);
  const bool fits = defocus::HasTexture(stack) && posterior.misfit() <= kMostMisfit;
  if (taken_.size() >= 3 && fits && Beyond(posterior) && BestIsAtAnEnd()) return Refuse(AtTheEndOf(setup_));
  return Decide(look, stack, posterior);
}

/// The sharpest place seen leads; the estimate from blur says where to look first, as long as nothing contradicts it.
Advice Defocus::Decide(const Look& look, const RingStack& stack, const Posterior& posterior) {
  const double px = *setup_.blur_px;
  const auto points = curve_.Points();
  const auto best = std::ranges::max_element(points, {}, &CurvePoint::value);
  const SideReach reach = ReachOfSides(setup_);
  const double stands = std::max(kStandsPx * NearPx(setup_), 0.55 * setup_.resolution);
  const bool fits = defocus::HasTexture(stack) && posterior.misfit() <= kMostMisfit;
  const double estimate = std::clamp(posterior.focus() * px, setup_.lowest, setup_.highest);
  const bool sure = fits && posterior.MassNear(posterior.focus(), kTrustedPx) >= kTrustedMass;

  if (sure) {
    if (auto advice = BetweenFarFrames(look, points, estimate, stack, posterior)) return *std::move(advice);
  }
  const bool seen = std::ranges::any_of(points, [&](const CurvePoint& point) {
    return std::abs(point.position - estimate) <= std::max(stands, reach.least);
  });
  if (const auto vertex = VertexAt(points, *best)) {
    // Less sharp frames stand near on both sides: the top is between them. Where the blur agrees, both count.
    const bool agrees = fits && std::abs(estimate - *vertex) <= std::max(kTrustedPx * px, setup_.resolution);
    const bool more = taken_.size() + 1 < kFrameBudget;
    if (!agrees && !seen && sure && more) return GoTo(estimate / px);
    const double top = agrees ? 0.5 * (*vertex + estimate) : *vertex;
    // A motor this coarse has a sharpest step, and none beside it is better.
    const bool coarse = setup_.resolution > kStandsPx * px && std::abs(best->position - *vertex) < setup_.resolution;
    const CurvePoint* centre = coarse ? &*best : NearestTo(points, top);
    if (std::abs(centre->position - top) > stands && more) return GoTo(top / px);
    if (const auto gap = agrees ? std::nullopt : GapBeside(points, *best); gap && more) return GoTo(*gap / px);
    if (look.position != centre->position) return GoAndLook{centre->position};
    const double slope = posterior.relative_slope();
    const bool odd = std::abs(SlopeNear(*centre).value_or(slope) - slope) > kOddSlope;
    if ((!agrees || odd) && more) {
      if (const auto again = ToSeeAgain(*centre)) return GoAndLook{*again};
    }
    if (more && may_move() && MayDrift(stack, Nearest(focus_), posterior)) {
      if (const auto again = SideToSeeAgain(*centre)) return GoAndLook{*again};
    }
    return Judge(*centre, top, agrees ? std::abs(estimate - *vertex) : -1.0, stack, posterior);
  }
  if (sure) {
    if (const auto end = EndBeside(posterior)) {
      if (auto advice = JudgeEnd(*end, look, stack, posterior)) return *std::move(advice);
    }
  }
  // Where nothing has been seen near the estimate, or what was seen there is the sharpest, it is worth following.
  if (!seen && (sure || taken_.size() == 2)) {
    if (!sure || posterior.sigma() > 0.5 * kTrustedPx || setup_.resolution > reach.least) return GoTo(estimate / px);
    for (const double sign : {look.position < estimate ? -1.0 : 1.0, look.position < estimate ? 1.0 : -1.0}) {
      const double room = sign > 0 ? setup_.highest - estimate : estimate - setup_.lowest;
      if (room < reach.least) continue;
      if (SeenOnSide(points, {.position = estimate}, sign * reach.least, sign * reach.most) == SideSeen::Nothing) {
        return GoTo((estimate + sign * std::min(reach.wanted, room)) / px);
      }
    }
    return GoTo(estimate / px);
  }
  return Climb(points, static_cast<std::size_t>(best - points.begin()), stack, posterior);
}

/// Towards a top with less sharp frames near on either side: outward where none has been seen, else nearer to it. From
/// an end of the travel, which may be no more than the edge of what shows nothing, into the widest gap.
Advice Defocus::Climb(const std::vector<CurvePoint>& points, std::size_t best, const RingStack& stack,
                      const Posterior& posterior) {
  const double px = *setup_.blur_px;
  const SideReach reach = ReachOfSides(setup_);
  const double here = points[best].position;
  double widest = 0.0;
  int outward = 0;
  std::optional<double> next;
  for (const int sign : {1, -1}) {
    const double room = sign > 0 ? setup_.highest - here : here - setup_.lowest;
    if (room < reach.least) continue;
    double less = 0.0, alike = 0.0;  // distance of the nearest frame that is less sharp, of the farthest before it
    for (const CurvePoint& point : points) {
      const double off = sign * (point.position - here);
      if (off < reach.least) continue;
      const bool below = SeenOnSide({&point, 1}, points[best], sign * off, sign * off) == SideSeen::LessSharp;
      if (below && (less == 0.0 || off < less)) less = off;
    }
    for (const CurvePoint& point : points) {
      const double off = sign * (point.position - here);
      if (off >= reach.least && (less == 0.0 || off < less)) alike = std::max(alike, off);
    }
    if (less == 0.0 && room - alike >= reach.least && outward == 0) {
      outward = sign;
      const double step = std::clamp(widest > 0 ? widest : alike, reach.wanted, 4.0 * reach.wanted);
      next = here + sign * std::min(alike + step, room);
    } else if (less - alike > reach.least && less > reach.most && less > widest && outward == 0) {
      next = here + sign * std::max(alike + std::min(0.5 * (less - alike), 2.0 * reach.wanted), reach.wanted);
    }
    widest = std::max(widest, less);
  }
  if (next) return GoTo(*next / px);
  const auto [gap, middle] = WidestGap(points);
  if (gap > 2.0 * std::max(reach.most, 1.6 * setup_.resolution)) return GoTo(middle / px);
  if (AtTheEnd(setup_, points, points[best])) return Refuse(AtTheEndOf(setup_));
  return WhyNot(stack, posterior);
}

/// Between frames, or from the outermost ones to the ends of the travel: its width and its middle.
std::pair<double, double> Defocus::WidestGap(const std::vector<CurvePoint>& points) const {
  std::pair<double, double> widest{0.0, 0.0};
  double last = setup_.lowest;
  for (std::size_t i = 0; i <= points.size(); ++i) {
    const double next = i < points.size() ? points[i].position : setup_.highest;
    if (next - last > widest.first) widest = {next - last, 0.5 * (last + next)};
    last = next;
  }
  return widest;
}

/// The top of the curve, where frames near the sharpest one are clearly less sharp on both sides.
std::optional<double> Defocus::VertexAt(const std::vector<CurvePoint>& points, const CurvePoint& best) const {
  const SideReach reach = ReachOfSides(setup_);
  for (const double sign : {1.0, -1.0}) {
    if (SeenOnSide(points, best, sign * reach.least, sign * reach.most) != SideSeen::LessSharp) return std::nullopt;
  }
  const auto near_by = [&](double distance) {
    for (const double sign : {1.0, -1.0}) {
      if (SeenOnSide(points, best, sign * reach.least, sign * distance) != SideSeen::LessSharp) return false;
    }
    return true;
  };
  const double distance = near_by(1.5 * reach.wanted) ? 1.5 * reach.wanted : reach.most;
  std::vector<CurvePoint> near;
  for (const CurvePoint& point : points) {
    if (std::abs(point.position - best.position) > distance || point.value <= 0.05 * best.value) continue;
    // No curve has exactly this form: how far it is from it counts for more than noise.
    near.push_back({point.position, point.value, std::hypot(point.sigma, 0.03 * point.value), 0.0});
  }
  const auto fit = FitPeak(near, kCurvePower);
  const double limit = std::max(0.5 * reach.wanted, 0.6 * setup_.resolution);
  if (!fit) return best.position;
  return std::clamp(fit->position, best.position - limit, best.position + limit);
}

/// Where blur has no say, the less sharp frames that hold the top between them must be near each other: the middle of
/// the wider gap, if they are not.
std::optional<double> Defocus::GapBeside(const std::vector<CurvePoint>& points, const CurvePoint& best) const {
  const SideReach reach = ReachOfSides(setup_);
  double below = setup_.lowest, above = setup_.highest;
  for (const CurvePoint& point : points) {
    const double off = point.position - best.position;
    if (SeenOnSide({&point, 1}, best, off, off) != SideSeen::LessSharp) continue;
    if (off < 0) below = std::max(below, point.position);
    if (off > 0) above = std::min(above, point.position);
  }
  if (above - below <= std::max(kNearPx * *setup_.blur_px, 3.2 * setup_.resolution)) return std::nullopt;
  const double side = best.position - below > above - best.position ? below : above;
  const double step = std::max(0.5 * std::abs(side - best.position), reach.least);
  return best.position + (side > best.position ? step : -step);
}

/// Where no place near has been seen twice, what lies beside the answer may have been seen before the lens came to
/// rest, or the subject: the earliest frame near it is to be taken again.
std::optional<double> Defocus::ToSeeAgain(const CurvePoint& centre) const {
  const double same = kSamePlace * *setup_.blur_px;
  const double most = ReachOfSides(setup_).most;
  std::optional<double> earliest;
  for (const Taken& one : taken_) {
    if (one.backlash_open || std::abs(one.position - centre.position) > most) continue;
    for (const Taken& other : taken_) {
      if (&one != &other && !other.backlash_open && std::abs(one.position - other.position) <= same)
        return std::nullopt;
    }
    if (!earliest && std::abs(one.position - centre.position) > same) earliest = one.position;
  }
  return earliest;
}

/// The lens stands at a top that was seen on both sides: whether it is the one, and how well it is known.
Advice Defocus::Judge(const CurvePoint& centre, double vertex, double apart, const RingStack& stack,
                      const Posterior& posterior) {
  const bool agrees = apart >= 0;
  const double px = *setup_.blur_px;
  const auto points = curve_.Points();
  if (!SeveralDepths(setup_, curve_.PartPeaks(), centre.position).empty()) {
    // What little the light has left of each part is no judge of its distance.
    return Refuse(LeftOut() > kFewLeft ? kTooBright : kSeveralDepths);
  }
  if (MayBeASideTop(centre, agrees, posterior.relative_slope())) return RefuseOpen(kOneGrating, posterior);
  if (!agrees) {
    if (!defocus::HasTexture(stack)) return WhyNot(stack, posterior);
    const double rest = std::ranges::min_element(points, {}, &CurvePoint::value)->value;
    if (centre.value < kClearTop * rest) return WhyNot(stack, posterior);
  }
  const double log_slope = ShownSlope(stack, posterior, vertex);
  Verdict verdict;
  verdict.focused = true;
  verdict.log_slope = log_slope;
  verdict.uneven = ShownUneven(posterior, centre);
  verdict.position = centre.position;
  const double disagree = agrees ? apart : kHalfDepthOfFieldPx * px;
  // Optics with another slope than was told are others in more than that: no disk, best elsewhere for each texture.
  const bool odd = setup_.slope_sigma > 0 && IsOfAnotherLens(log_slope, setup_.slope_sigma);
  const double relative = odd ? log_slope : std::log(posterior.relative_slope());
  const double unlike = 1.2 * std::abs(relative + setup_.learned_log_factor);
  // What no disk explains is an aberration, perhaps, which moves the sharpest place off that of the smallest spot.
  const double no_disk = std::clamp(kMisfitPx * posterior.misfit(), 0.0, kMostMisfitPx);
  const double known = std::hypot(posterior.sigma() * px, 0.5 * disagree);
  const double sigma = std::hypot(known, std::hypot(0.2, no_disk, unlike) * px);
  verdict.sigma = std::hypot(sigma, vertex - centre.position, setup_.resolution / std::sqrt(12.0));
  verdict.subject = {.position = vertex, .sigma = sigma};
  verdict.found_by = agrees ? FoundBy::Blur : FoundBy::Sharpness;
  verdict.confidence =
      std::erf(std::max(kHalfDepthOfFieldPx * px, setup_.resolution) / (std::sqrt(2.0) * verdict.sigma));
  std::ostringstream reason;
  reason.precision(2);
  const double least = ReachOfSides(setup_).least;
  const bool at_end = std::min(centre.position - setup_.lowest, setup_.highest - centre.position) < least;
  reason << "the sharpest of " << taken_.size()
         << (at_end ? " frames, level at the end of the travel and less sharp before it"
                    : " frames, with less sharp ones on both sides");
  if (agrees) reason << "; their blur agrees on this distance to " << disagree / px << " px of blur";
  verdict.reason = reason.str();
  return verdict;
}

int Defocus::FramesExpected() const {
  return std::max<int>(4, static_cast<int>(taken_.size()));
}

Advice Defocus::GoTo(double at, Backlash backlash) {
  asked_open_ = backlash == Backlash::Open;
  return GoAndLook{.position = std::clamp(at * *setup_.blur_px, setup_.lowest, setup_.highest),
                   .backlash_open = asked_open_};
}

/// A good part of the first frame's blur away, to the side where the focus is. One frame seldom tells the side: then
/// the way that leaves no backlash behind costs one motion less. Where the backlash is known, so does a backlash_open
/// frame beyond the focus: from there the way to the focus takes the backlash up.
Advice Defocus::GoToSecond(const Posterior& posterior) {
  const double at = taken_.front().at;
  const double distance = posterior.TypicalDistance(at);
  if (auto beyond = GoBeyondLastFocus(posterior)) return *std::move(beyond);
  const double step = std::clamp(kPartOfBlur * distance, kShortestStep, kLongestStep);
  const double below = posterior.MassBelow(at);
  const double lowest = setup_.lowest / *setup_.blur_px;
  const double highest = setup_.highest / *setup_.blur_px;
  const double slack = setup_.backlash / *setup_.blur_px;
  const double back = setup_.ascending ? below : 1.0 - below;
  if (slack > 0 && back > kClearlyBack) {
    const double past = std::clamp(kPastFocus * distance, kShortestStep + slack, kLongestStep);
    const double room = setup_.ascending ? at - lowest : highest - at;
    if (room > kShortestStep + slack) return GoTo(setup_.ascending ? at - past : at + past, Backlash::Open);
  }
  bool down = setup_.ascending ? below > kClearlyOneSide : below > 1.0 - kClearlyOneSide;
  if ((down ? at - lowest : highest - at) < kShortestStep) down = !down;
  return GoTo(down ? at - step : at + step);
}

/// Whether two frames of one place differ in sharpness by more than noise explains.
bool Defocus::Restless() const {
  constexpr double kSigmas = 4.0;
  constexpr double kClearly = 0.1;  // of the sharpness: lamps flicker
  const auto points = curve_.Taken();
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const CurvePoint &one = points[i], &other = points.back();
    if (std::abs(one.position - other.position) > kSamePlace * *setup_.blur_px || taken_[i].backlash_open) continue;
    const double allowed = kSigmas * std::hypot(one.sigma, other.sigma) + kClearly * std::max(one.value, other.value);
    if (std::abs(one.value - other.value) > allowed) return true;
  }
  return false;
}

Verdict Defocus::WhyNot(const RingStack& stack, const Posterior& posterior) const {
  if (!defocus::HasTexture(stack)) {
    if (!Repeats(stack)) return Refuse({Cause::NoTexture, "too little texture to distinguish blur from shading"});
    return RefuseOpen(kOneGrating, posterior);
  }
  if (posterior.misfit() <= kMostMisfit) {
    return RefuseOpen(
        {Cause::Ambiguous, "the frames leave the distance open: repeating or too little texture, or too little light"},
        posterior);
  }
  if (moving_ || moved_ > kClearMotion) return Refuse(kMoved);
  return Refuse(
      {Cause::Unclear, "blur alone does not explain the frames: several depths, motion, or light that changed"});
}

/// Names the distances that the frames cannot tell apart.
Verdict Defocus::RefuseOpen(Why why, const Posterior& posterior) const {
  Verdict verdict = Refuse(why);
  for (const double place : posterior.Places(kWorthNaming)) {
    const double position = place * *setup_.blur_px;
    if (position >= setup_.lowest && position <= setup_.highest) verdict.candidates.push_back({position, 0.0, 0});
  }
  if (verdict.candidates.size() < 2) verdict.candidates.clear();
  return verdict;
}

}  // namespace lensd::autofocus
