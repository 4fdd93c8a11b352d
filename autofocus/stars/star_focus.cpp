// The stages of a run: approach, or a pass over the whole range, the curve, and the check at its lowest place.
#include "autofocus/stars/star_focus.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

namespace lensd::autofocus {
namespace {

constexpr double kPassBlurPx = 10.0;
constexpr int kPassIntervals = 48;   ///< of the pass over the range where the optics are not known
constexpr double kNearHfrPx = 4.0;   ///< from here the curve reaches over the focus
constexpr double kAwayPerHfr = 2.8;  ///< px of blur per px of half-flux radius: 2 sqrt(2) of an even disk
constexpr int kMostApproaches = 7;   ///< frames
constexpr double kStepPx = 2.5;      ///< of the curve
constexpr int kStepsPerSide = 4;
constexpr double kReachPx = 13.0;     ///< frames so far from the focus count
constexpr double kLeastSidePx = 2.2;  ///< frames nearer than this to the focus say nothing of a side
constexpr double kRise = 1.2;         ///< times the least: clearly larger
constexpr double kRisePx = 0.2;
constexpr int kMostExtended = 6;
constexpr double kHfrPerPx = 0.354;  ///< of an even disk
constexpr std::size_t kBrightest = 12;

constexpr Why kNoStars{Cause::NoTexture,
                       "no points of light in the region stand out of the noise, apart from each other, at any focus"};
constexpr Why kNoCurve{Cause::Unclear, "no point of light gets smaller toward one place and larger again beyond it"};
constexpr Why kNoisy{Cause::Unclear, "noise leaves open where the stars are smallest"};

/// Of the brightest; nothing: no stars, but perhaps hot pixels.
std::optional<double> TypicalHfr(const StarLook& look) {
  std::vector<double> radii;
  for (const Star& star : look.stars) {
    if (!star.lone_pixel && radii.size() < kBrightest) radii.push_back(star.hfr_px);
  }
  if (radii.empty()) return std::nullopt;
  std::ranges::sort(radii);
  return radii[radii.size() / 2];
}

/// How much light comes together: most in focus, also of stars that are clipped, whose light grows with their size.
double Concentration(const StarLook& look) {
  double sum = 0.0;
  for (const Star& star : look.stars) {
    if (!star.lone_pixel) sum += star.flux / std::pow(std::max(star.hfr_px, 0.6), 3);
  }
  return sum;
}

}  // namespace

StarFocus::StarFocus(const Setup& setup) : setup_(setup), px_(setup.blur_px.value_or(0.0)) {}

int StarFocus::FramesExpected() const {
  constexpr int kApproachFrames = 3, kCurveFrames = 2 * kStepsPerSide + 1;
  if (stage_ == Stage::Check) return frames_ + 1;
  if (stage_ == Stage::Curve) return frames_ + static_cast<int>(to_visit_.size()) + 1;
  return std::max(kApproachFrames, frames_ + static_cast<int>(to_visit_.size())) + kCurveFrames + 1;
}

Advice StarFocus::Next(const Look& look) {
  ++frames_;
  StarLook seen{look.position, look.frame != nullptr ? FindStars(*look.frame, look.window) : std::vector<Star>{}};
  if (stage_ == Stage::Check) {
    if (std::abs(look.position - agreed_.position) > 0.6 * setup_.resolution) return GoAndLook{agreed_.position};
    return Answer(seen);
  }
  looks_.push_back(std::move(seen));
  if (!to_visit_.empty()) return Ask();
  if (stage_ == Stage::Approach) return Approach();
  return stage_ == Stage::Coarse ? AfterCoarse() : AfterCurve();
}

Advice StarFocus::Ask() {
  const double position = to_visit_.front();
  to_visit_.pop_front();
  return GoAndLook{position};
}

/// About so far to a side of it where no frame was taken yet.
std::optional<double> StarFocus::OtherPlace(const StarLook& best, double away) const {
  for (const double sign : {setup_.ascending ? 1.0 : -1.0, setup_.ascending ? -1.0 : 1.0}) {
    const double place = std::clamp(best.position + sign * away, setup_.lowest, setup_.highest);
    if (std::abs(place - best.position) < 0.5 * away) continue;
    const bool there = std::ranges::any_of(looks_, [&](const StarLook& look) {
      return std::abs(look.position - place) < 0.4 * away ||
             ((look.position - best.position) * sign > 0.0 && std::abs(look.position - best.position) < 1.2 * away);
    });
    if (!there) return place;
  }
  return std::nullopt;
}

Advice StarFocus::Approach() {
  const StarLook* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const StarLook& look : looks_) {
    const auto hfr = TypicalHfr(look);
    if (!hfr || *hfr >= least) continue;
    best = &look;
    least = *hfr;
  }
  if (best == nullptr || px_ == 0.0) return StartCoarse();
  if (least <= kNearHfrPx) return StartCurve(best->position);
  if (looks_.size() >= kMostApproaches) return StartCoarse();
  const auto place = OtherPlace(*best, kAwayPerHfr * least * px_);
  if (!place) return StartCoarse();
  return GoAndLook{*place};
}

Advice StarFocus::StartCoarse() {
  stage_ = Stage::Coarse;
  searched_ = true;
  extended_ = 0;
  looks_.clear();
  const double range = setup_.highest - setup_.lowest;
  const double step = std::max(px_ > 0.0 ? kPassBlurPx * px_ : range / kPassIntervals, setup_.resolution);
  const int intervals = std::max(4, static_cast<int>(std::ceil(range / step - 1e-6)));
  for (int i = 0; i <= intervals; ++i) {
    to_visit_.push_back(std::lerp(setup_.lowest, setup_.highest, static_cast<double>(i) / intervals));
  }
  if (!setup_.ascending) std::ranges::reverse(to_visit_);
  return Ask();
}

Advice StarFocus::AfterCoarse() {
  const auto best = std::ranges::max_element(looks_, {}, Concentration);
  if (!(Concentration(*best) > 0.0)) return Refuse(kNoStars);
  if (px_ == 0.0) {
    // How fast the stars grow where they grow fastest.
    double slope = 0.0;
    for (std::size_t i = 1; i < looks_.size(); ++i) {
      const auto before = TypicalHfr(looks_[i - 1]), here = TypicalHfr(looks_[i]);
      if (!before || !here) continue;
      slope = std::max(slope, std::abs((*here - *before) / (looks_[i].position - looks_[i - 1].position)));
    }
    if (!(slope > 0.0)) return Refuse(kNoCurve);
    px_ = kHfrPerPx / slope;
  }
  return StartCurve(best->position);
}

Advice StarFocus::StartCurve(double centre) {
  stage_ = Stage::Curve;
  looks_.clear();
  std::vector<double> places;
  for (int i = -kStepsPerSide; i <= kStepsPerSide; ++i) {
    const double place = centre + i * std::max(kStepPx * px_, setup_.resolution);
    if (place >= setup_.lowest && place <= setup_.highest) places.push_back(place);
  }
  return Extend(std::move(places));
}

/// Asks for frames there.
Advice StarFocus::Extend(std::vector<double> places) {
  std::ranges::sort(places);
  if (!setup_.ascending) std::ranges::reverse(places);
  to_visit_.assign(places.begin(), places.end());
  return Ask();
}

std::vector<StarLook> StarFocus::InOrder() const {
  std::vector<StarLook> looks = looks_;
  std::ranges::stable_sort(looks, {}, &StarLook::position);
  return looks;
}

/// Places to look at on that side of the answer, so that the stars are seen to grow there; empty: they are.
std::vector<double> StarFocus::Unseen(const StarFocusPlace& agreed, double sign) const {
  const double room = sign > 0 ? setup_.highest - agreed.position : agreed.position - setup_.lowest;
  int larger = 0;
  for (const FittedStar& star : agreed.agreeing) {
    const double clear = std::max(kRise * star.fit.least_px, star.fit.least_px + kRisePx);
    const auto grown = std::ranges::count_if(star.track.points, [&](const HfrPoint& point) {
      const double off = sign * (point.position - agreed.position);
      return off >= kLeastSidePx * px_ && off <= kReachPx * px_ && point.hfr_px - 2.0 * point.sigma > clear;
    });
    larger += grown >= (room < 2.0 * kStepPx * px_ ? 1 : 2) ? 1 : 0;
  }
  if (2 * larger > static_cast<int>(agreed.agreeing.size())) return {};
  std::vector<double> places;
  for (const double away : {3.0, 5.0, 7.5, 10.0, 12.5}) {
    const double step = std::max(away * px_, away / kStepPx * setup_.resolution);
    if (step > room) break;
    const double place = agreed.position + sign * step;
    const bool taken = std::ranges::any_of(looks_, [&](const StarLook& look) {
      return std::abs(look.position - place) < std::max(1.2 * px_, 0.6 * setup_.resolution);
    });
    if (!taken) places.push_back(place);
  }
  return places;
}

/// Refuses, once the whole range has been looked at: what was taken for stars may have been parts of large ones.
Advice StarFocus::GiveUp(Why why) {
  if (!searched_) return StartCoarse();
  return Refuse(why);
}

Advice StarFocus::AfterCurve() {
  std::vector<StarLook> looks = InOrder();
  const double middle = std::ranges::max_element(looks, {}, Concentration)->position;
  std::erase_if(looks, [&](const StarLook& look) { return std::abs(look.position - middle) > kReachPx * px_; });
  const auto smallest = std::ranges::max_element(looks, {}, Concentration);
  const std::vector<FittedStar> fitted = FitStars(Follow(looks), px_);
  auto agreed = AgreeOn(fitted, px_);
  const bool more = ++extended_ <= kMostExtended;
  if (!agreed) {
    // The frame in which most light comes together is the next curve's middle, unless it is this one's already.
    const auto beside = [&](double end) { return std::abs(smallest->position - end) < 1.5 * kStepPx * px_; };
    if (!(Concentration(*smallest) > 0.0)) return GiveUp(kNoStars);
    if (beside(setup_.lowest) || beside(setup_.highest)) return GiveUp(AtTheEndOf(setup_));
    if (!more || !(beside(looks.front().position) || beside(looks.back().position))) return GiveUp(kNoCurve);
    return StartCurve(smallest->position);
  }
  if (!agreed->several.empty()) {
    if (!searched_) return StartCoarse();
    Verdict verdict = Refuse(kSeveralDepths);
    for (const double place : agreed->several) {
      if (place >= setup_.lowest && place <= setup_.highest) verdict.candidates.push_back({place, 0.0, 0});
    }
    return verdict;
  }
  const double below = agreed->position - setup_.lowest, above = setup_.highest - agreed->position;
  if (std::min(below, above) < kLeastSidePx * px_) return Refuse(AtTheEndOf(setup_));
  std::vector<double> places;
  for (const double sign : {-1.0, 1.0}) {
    const auto unseen = Unseen(*agreed, sign);
    places.insert(places.end(), unseen.begin(), unseen.end());
  }
  if (!places.empty() && more) return Extend(std::move(places));
  if (!places.empty()) return GiveUp(kNoCurve);
  if (3.0 * agreed->sigma > kHalfDepthOfFieldPx * px_) return Refuse(kNoisy);
  agreed_ = *std::move(agreed);
  stage_ = Stage::Check;
  return GoAndLook{agreed_.position};
}

/// From the frame at the answer: the stars that agreed are there, and as small as their curves say.
Verdict StarFocus::Answer(const StarLook& last) const {
  std::vector<StarTrack> tracks;
  std::vector<HfrFit> fits;
  for (const FittedStar& star : agreed_.agreeing) {
    tracks.push_back(star.track);
    fits.push_back(star.fit);
  }
  std::vector<Star> found;
  int small = 0;
  for (const Star& star : last.stars) {
    const StarTrack* track = TrackOf(star, tracks);
    if (track == nullptr) continue;
    found.push_back(star);
    const HfrFit& fit = fits[static_cast<std::size_t>(track - tracks.data())];
    small += star.hfr_px - 2.0 * star.hfr_sigma <= 1.25 * fit.At(last.position) + 0.3 ? 1 : 0;
  }
  if (2 * small <= static_cast<int>(tracks.size())) {
    return Refuse({Cause::Unclear, "the stars of the check frame are larger than the curve promised, or are gone"});
  }
  Verdict verdict;
  verdict.focused = verdict.proven = true;
  verdict.position = agreed_.position;
  verdict.sigma = agreed_.sigma;
  verdict.found_by = FoundBy::Stars;
  verdict.confidence = agreed_.confidence;
  verdict.stars = FiguresOf(found);
  std::ostringstream reason;
  reason.precision(3);
  reason << found.size() << (found.size() == 1 ? " star is" : " stars are")
         << " smallest here and seen larger on both sides";
  if (verdict.stars->hfr_px) reason << ", half-flux radius " << *verdict.stars->hfr_px << " px";
  if (verdict.stars->clipped > 0) reason << ", " << verdict.stars->clipped << " of them too bright for the sensor";
  reason << ", checked by a last frame";
  verdict.reason = reason.str();
  return verdict;
}

}  // namespace lensd::autofocus
