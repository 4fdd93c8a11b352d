// A subject that moves in depth while it is searched for. One that moves evenly is one that stands, looked at from
// places that move the other way: so the same likelihood judges every speed. Where a speed explains the frames better
// than none, a place beside the answer is looked at again; where that has changed, the method follows the subject.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "autofocus/defocus/defocus.h"
#include "autofocus/peak_fit.h"

namespace lensd::autofocus {

using defocus::Posterior;
using defocus::RingStack;

namespace {

constexpr double kDrifts[] = {0.5, 1.0,  1.5,  2.0,  3.0,  4.0,  5.0, 6.0,
                              8.0, 10.0, 12.0, 15.0, 18.0, 22.0, 26.0};  // px of blur from the first frame to the last
constexpr double kBetterMoving = 4.0;      // log probability: less is no reason for two more frames
constexpr double kMatters = 1.0;           // px: by less the answer may be off
constexpr double kHopeless = 20.0;         // log probability below the best: more drift is no better
constexpr double kAsGood = 2.0;            // log probability below the best that leaves a course open
constexpr double kFarSlope = 0.2;          // log of the slope over the one told: drift looks like that, too
constexpr double kImpossibleSlope = 0.45;  // the same: more than optics are told wrongly
constexpr double kMetPx = 1.0;             // between the subject's focus and the lens
constexpr double kKnownPx = 1.0;           // how well a course that is followed must be known
constexpr double kCourseMisfit = 0.6;      // of the frames
constexpr std::size_t kMostFollowed = 11;
constexpr Why kMovesOn{Cause::SubjectMoved,
                       "the picture changes although the lens reports that it stands: the lens still moves, or the "
                       "subject moves in depth and could not be followed"};

double Seconds(Instant at) {
  return std::chrono::duration<double>(at.time_since_epoch()).count();
}

}  // namespace

double Defocus::MidExposure(const drivers::Frame& frame) {
  return 0.5 * (Seconds(frame.exposure_start) + Seconds(frame.exposure_end));
}

/// The even motion that explains the frames best. Nothing: when they were taken is not known.
std::optional<Defocus::Course> Defocus::CourseOf(const RingStack& stack, const std::vector<const Taken*>& frames,
                                                 const Posterior& posterior) {
  const auto [first, last] = std::ranges::minmax(frames, {}, &Taken::seconds);
  const double span = last->seconds - first->seconds;
  if (!(span > 0)) return std::nullopt;
  const auto drifted = [&](double by, const Posterior::Peak& from) {
    std::vector<double> places;
    for (const Taken* frame : frames) places.push_back(frame->at - by * (frame->seconds - last->seconds) / span);
    return posterior.TopNear(defocus::Likelihood(stack, places), from);
  };
  std::vector<std::pair<double, Posterior::Peak>> seen;
  const auto still = drifted(0.0, {.focus = posterior.focus(), .slope = posterior.relative_slope()});
  seen.emplace_back(0.0, still);
  double best = still.height;
  for (const double sign : {1.0, -1.0}) {
    auto peak = still;
    for (const double drift : kDrifts) {
      peak = drifted(sign * drift, peak);
      seen.emplace_back(sign * drift, peak);
      if (peak.height < best - kHopeless && drift > 2.0) break;
      best = std::max(best, peak.height);
    }
  }
  const auto& [drift, peak] = *std::ranges::max_element(seen, {}, [](const auto& one) { return one.second.height; });
  Course course{.speed = drift / span, .focus = peak.focus, .slope = peak.slope, .misfit = peak.excess};
  course.gain = peak.height - still.height;
  course.off = std::abs(peak.focus - still.focus);
  for (const auto& [other, there] : seen) {
    if (there.height > peak.height - kAsGood) course.open = std::max(course.open, std::abs(there.focus - peak.focus));
  }
  return course;
}

/// A subject that moved evenly explains the frames better than one that stood, or better than the optics allow.
bool Defocus::MayDrift(const RingStack& stack, const std::vector<const Taken*>& frames,
                       const Posterior& posterior) const {
  const auto course = CourseOf(stack, frames, posterior);
  if (!course) return false;
  return std::abs(std::log(posterior.relative_slope())) > kImpossibleSlope ||
         (course->gain > kBetterMoving && course->off > kMatters);
}

/// The earliest frame on a side of `centre`, unless such a place has been seen again since: after half of the time.
/// Sharpness tells motion on the sides, at the top it hardly changes.
std::optional<double> Defocus::SideToSeeAgain(const CurvePoint& centre) const {
  const double same = kSamePlace * *setup_.blur_px;
  const SideReach reach = ReachOfSides(setup_);
  std::vector<const Taken*> sides;
  for (const Taken& one : taken_) {
    const double off = std::abs(one.position - centre.position);
    if (!one.backlash_open && off >= reach.least && off <= reach.most) sides.push_back(&one);
  }
  if (sides.empty()) return std::nullopt;
  const double half = 0.5 * (taken_.back().seconds - sides.front()->seconds);
  for (const Taken* one : sides) {
    for (const Taken* other : sides) {
      if (other->seconds - one->seconds >= half && std::abs(one->position - other->position) <= same)
        return std::nullopt;
    }
  }
  return sides.front()->position;
}

/// Where the subject is expected when the next frame is taken, until it was met there: the frames agree on its course,
/// the last one stands at its focus, and seen from the subject there were less sharp ones on both sides.
Advice Defocus::Follow(const Look& look) {
  taken_.back().followed = true;
  std::vector<const Taken*> frames;
  for (std::size_t i = taken_.size() - std::min<std::size_t>(taken_.size(), defocus::kMostFrames); i < taken_.size();
       ++i)
    frames.push_back(&taken_[i]);
  const RingStack stack = StackOf(frames);
  if (!defocus::HasTexture(stack) || taken_.size() >= kMostFollowed) return RefuseForGood(kMovesOn);
  const auto course = CourseOf(stack, frames, PosteriorOf(stack, frames));
  if (!course) return RefuseForGood(kMovesOn);
  const double px = *setup_.blur_px;
  const Taken& last = taken_.back();
  const bool known = frames.size() > 2 && course->open <= kKnownPx && course->misfit <= kCourseMisfit &&
                     std::abs(std::log(course->slope)) <= kFarSlope;
  double next = course->focus + course->speed * (last.seconds - taken_[taken_.size() - 2].seconds);
  if (next * px < setup_.lowest || next * px > setup_.highest) return RefuseForGood(kMovesOn);
  auto points = curve_.Taken();
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i].position -= course->speed * px * (taken_[i].seconds - last.seconds);
  const SideReach reach = ReachOfSides(setup_);
  const CurvePoint centre = points.back();
  const double off = std::abs(course->focus - last.at);
  for (const double sign : {1.0, -1.0}) {
    const SideSeen seen = SeenOnSide(points, centre, sign * reach.least, sign * reach.most);
    if (known && off <= kMetPx && seen == SideSeen::LessSharp) continue;
    // What is not known yet is seen best from beside the focus.
    if (!known || seen == SideSeen::Nothing) next += sign * reach.wanted / px * (taken_.size() % 2 == 0 ? 1.0 : -1.0);
    return GoTo(next);
  }
  if (!taken_[taken_.size() - 2].followed) return GoTo(next);  // it has not been met yet
  Verdict verdict;
  verdict.focused = verdict.proven = true;
  verdict.position = look.position;
  const double sigma = std::hypot(course->open, 0.2) * px;
  verdict.subject = {.position = std::clamp(course->focus * px, setup_.lowest, setup_.highest), .sigma = sigma};
  verdict.sigma = std::hypot(sigma, off * px, setup_.resolution / std::sqrt(12.0));
  verdict.found_by = FoundBy::Blur;
  verdict.confidence = std::erf(kHalfDepthOfFieldPx * px / (std::sqrt(2.0) * verdict.sigma));
  std::ostringstream reason;
  reason.precision(2);
  reason << "found where it was expected: the subject moves in depth by " << std::abs(course->speed)
         << " px of blur a second, so this holds for now";
  verdict.reason = reason.str();
  return verdict;
}

}  // namespace lensd::autofocus
