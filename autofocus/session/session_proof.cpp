// An answer stands once less sharp frames were seen on both sides of it and the last one was taken there. Which frame
// is still wanted follows from those taken so far.
#include <algorithm>
#include <cmath>

#include "autofocus/search/searches.h"
#include "autofocus/search/sharpness_curve.h"
#include "autofocus/session.h"
#include "autofocus/session/fixed_pattern.h"
#include "autofocus/session/side_lobe.h"

namespace lensd::autofocus {
namespace {

constexpr int kMostMovesOn = 3;  ///< of an answer to a sharper frame beside it

/// A frame of this place is there, as near as the motor gets: it need not be asked for again.
bool TakenAt(const std::vector<CurvePoint>& points, double place, double resolution) {
  return std::ranges::any_of(
      points, [&](const CurvePoint& point) { return std::abs(point.position - place) <= 0.6 * resolution; });
}

}  // namespace

/// Frames on both sides of the answer, as far as the travel goes, and last one at the answer itself.
Advice Session::Prove(double stands) {
  Verdict& verdict = proof_->verdict;
  const double answer = verdict.position;
  if (const auto side = SideToSee(answer)) return GoAndLook{*side};
  if (stands != answer && !proof_->sent) {
    proof_->sent = true;
    return GoAndLook{answer};
  }
  if (const auto farther = FartherSide()) {
    proof_->sent = false;
    return GoAndLook{*farther};
  }
  // A frame beside it that is sharper takes its place.
  if (const auto better = SharperBeside()) {
    if (++proof_->moves_on > kMostMovesOn)
      return Refuse({Cause::Unclear, "wherever an answer was tried, frames beside it are sharper"});
    verdict.sigma = std::max(verdict.sigma, 0.5 * std::abs(*better - answer));
    verdict.position = *better;
    verdict.subject.reset();
    verdict.found_by = FoundBy::Sharpness;
    proof_->sent = true;
    return GoAndLook{*better};
  }
  return Check();
}

/// A place beside the answer where no frame has been taken yet.
std::optional<double> Session::SideToSee(double answer) const {
  const auto [least, most, wanted] = ReachOfSides(setup_);
  const auto points = curve_->Points();
  const CurvePoint centre{.position = answer};
  for (const double sign : {1.0, -1.0}) {
    const double room = sign > 0 ? setup_.highest - answer : answer - setup_.lowest;
    if (room < least) continue;
    if (SeenOnSide(points, centre, sign * least, sign * most) != SideSeen::Nothing) continue;
    const double place = answer + sign * std::min(wanted, room);
    if (!TakenAt(points, place, setup_.resolution)) return place;
  }
  return std::nullopt;
}

/// From the answer, where the lens stands: a place farther to a side where what was seen is as sharp, as far as that
/// may still prove a top. A fine texture falls off within a depth of field, a coarse one later.
std::optional<double> Session::FartherSide() const {
  constexpr double kFar = 0.8;  ///< of the farthest
  if (!setup_.blur_px) return std::nullopt;
  const auto [least, most, wanted] = ReachOfSides(setup_);
  const auto taken = curve_->Taken();
  const CurvePoint& last = taken.back();
  for (const double sign : {1.0, -1.0}) {
    const double room = sign > 0 ? setup_.highest - last.position : last.position - setup_.lowest;
    if (room < kFar * most) continue;
    if (SeenOnSide(taken, last, sign * least, sign * most) != SideSeen::Alike) continue;
    if (SeenOnSide(taken, last, sign * kFar * most, sign * most) != SideSeen::Nothing) continue;
    const double place = last.position + sign * std::min(0.95 * most, room);
    if (!TakenAt(taken, place, setup_.resolution)) return place;
  }
  return std::nullopt;
}

/// Where a frame near the one taken last is the sharpest of all and clearly sharper.
std::optional<double> Session::SharperBeside() const {
  const auto [least, most, wanted] = ReachOfSides(setup_);
  if (!setup_.blur_px) return std::nullopt;
  const auto taken = curve_->Taken();
  const CurvePoint& last = taken.back();
  const auto& best = *std::ranges::max_element(taken, {}, &CurvePoint::value);
  const double off = best.position - last.position;
  if (std::abs(off) < least || std::abs(off) > most) return std::nullopt;
  if (SeenOnSide({&best, 1}, last, off, off) != SideSeen::Sharper) return std::nullopt;
  return best.position;
}

/// Something must have changed with focus, the frame at the answer must be no worse than the one before the run began,
/// no frame of the run may be clearly sharper than it, and on each side one must have been clearly less sharp.
Verdict Session::Check() const {
  constexpr double kSharpestShare = 0.8;  ///< of the sharpest frame seen: less is another place than the peak
  constexpr double kSigmas = 4.0;
  // Sigmas. What of the scene is left in a pattern scatters beside the noise.
  const double clear_rise = stays_->known() ? 12.0 : 6.0;
  const auto sharpness = curve_->Taken();
  const CurvePoint& last = sharpness.back();
  Verdict verdict = proof_->verdict;
  const auto refuse = [&](Why why) {
    verdict.focused = false;
    verdict.confidence = 0.0;
    verdict.cause = why.cause;
    verdict.reason = why.reason;
    return verdict;
  };
  const auto clearly_below = [&](const CurvePoint& other, double share) {
    return last.value + kSigmas * std::hypot(last.sigma, other.sigma) < share * other.value;
  };
  const auto dullest = std::ranges::min_element(sharpness, {}, &CurvePoint::value);
  if (last.value - dullest->value < clear_rise * std::hypot(last.sigma, dullest->sigma)) {
    return refuse(curve_->Overexposed() ? kTooBright : kNoPeak);
  }
  if (clearly_below(sharpness.front(), 1.0)) {
    return refuse({Cause::Unclear, "the check frame is less sharp than the first frame was"});
  }
  const auto sharpest = std::ranges::max_element(sharpness, {}, &CurvePoint::value);
  if (clearly_below(*sharpest, kSharpestShare)) {
    return refuse({Cause::Unclear, "the check frame is less sharp than the search promised"});
  }
  const auto [least, most, wanted] = ReachOfSides(setup_);
  for (const double sign : {1.0, -1.0}) {
    const double room = sign > 0 ? setup_.highest - last.position : last.position - setup_.lowest;
    if (room < least) continue;  // the method has judged the end of the travel
    const SideSeen seen = SeenOnSide(sharpness, last, sign * least, sign * most);
    if (seen == SideSeen::LessSharp) continue;
    // A sweep has looked at the whole travel: what is level here may still fall from here on, and never rise.
    const bool falls = SeenOnSide(sharpness, last, sign * least, sign * room) == SideSeen::LessSharp;
    if (names_[running_] == "sweep" && falls) continue;
    if (room < 2.0 * least) return refuse(AtTheEndOf(setup_));
    return refuse({Cause::Unclear, seen == SideSeen::Sharper
                                       ? "a frame beside the answer is sharper than the answer"
                                       : "frames beside the answer are as sharp as the answer: no top was seen"});
  }
  if (const auto doubt = DoubtOfLast(setup_, *curve_)) return refuse(*doubt);
  if (MayRepeat(last)) {
    return refuse({Cause::Ambiguous,
                   "contrast rises again farther away, as with a periodic texture: the sharpest position may be a side "
                   "lobe, and the focus may lie beyond the range"});
  }
  return verdict;
}

/// By the picture at the answer, and by the optics where the method goes by them. What of the scene is left in a
/// pattern is left far from focus, too.
bool Session::MayRepeat(const CurvePoint& answer) const {
  if (!last_) return false;
  const bool knows_optics = std::ranges::find(Searches(), names_[running_], &Search::name) == Searches().end();
  const double px = setup_.blur_px && knows_optics ? NearPx(setup_) : 0.0;
  if (!stays_->known()) return MayBeSideLobe(curve_->Points(), answer, px, last_->frame, last_->window);
  const drivers::Frame clean = stays_->PictureWithout(last_->frame, last_->window);
  return MayBeSideLobe(curve_->Points(), answer, 0.0, clean, {0, 0, clean.width, clean.height});
}

}  // namespace lensd::autofocus
