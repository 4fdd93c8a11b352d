#include "sweep.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "autofocus/sharpness.h"

namespace lensd::autofocus {
namespace {

constexpr double kCoarseBlurPx = 10.0;  ///< of the first pass: at most 5 px of blur from some frame
constexpr double kFineBlurPx = 1.25;    ///< about where the search ends
constexpr int kBlindIntervals = 48;     ///< of the first pass where the optics are not known
constexpr int kDivision = 3;            ///< of the step, from pass to pass
constexpr int kLeastIntervals = 4;
constexpr double kFitSteps = 2.6;         ///< the fit takes the frames this near to the sharpest
constexpr double kClearProminence = 6.0;  ///< standard deviations of the noise
constexpr double kClearContrast = 0.1;    ///< of the peak over the rest of the range
constexpr double kPlateau = 0.7;          ///< neighbours at this share of the peak: the step is below its width
constexpr double kHalfDepthOfFieldPx = 2.0;
constexpr double kOverexposed = 1e-3;  ///< of the region: more than so many more clipped pixels in some frames
constexpr double kSigmas = 3.0;

/// What the curve comes down to away from its top. The finer passes crowd around the top, so not the median.
double LowerQuartile(std::vector<CurvePoint> curve) {
  const auto quarter = curve.begin() + static_cast<std::ptrdiff_t>(curve.size() / 4);
  std::ranges::nth_element(curve, quarter, {}, &CurvePoint::value);
  return quarter->value;
}

Verdict Refuse(std::string reason) {
  Verdict verdict;
  verdict.reason = std::move(reason);
  return verdict;
}

}  // namespace

Sweep::Sweep(const Setup& setup) : setup_(setup) {
  const double range = setup.highest - setup.lowest;
  const double wanted = setup.blur_px ? kCoarseBlurPx * *setup.blur_px : range / kBlindIntervals;
  const double step = std::max(wanted, setup.resolution);
  const int intervals = std::max(kLeastIntervals, static_cast<int>(std::ceil(range / step)));
  step_ = range / intervals;
  fine_step_ = setup.blur_px ? std::max(kFineBlurPx * *setup.blur_px, setup.resolution) : 0.0;
  PlanPass(setup.lowest, setup.highest, intervals, true);
}

/// Positions that divide from..to into intervals, in the direction that takes up the backlash; inside the range.
void Sweep::PlanPass(double from, double to, int intervals, bool with_ends) {
  std::vector<double> positions;
  for (int i = with_ends ? 0 : 1; i <= (with_ends ? intervals : intervals - 1); ++i) {
    const double position = std::lerp(from, to, static_cast<double>(i) / intervals);
    if (position >= setup_.lowest && position <= setup_.highest) positions.push_back(position);
  }
  if (!setup_.ascending) std::ranges::reverse(positions);
  to_visit_.assign(positions.begin(), positions.end());
}

int Sweep::FramesExpected() const {
  int later = 0;
  const double end = fine_step_ > 0 ? fine_step_ : step_ / (kDivision * kDivision);
  for (double step = step_; step > end * kDivision / 2; step /= kDivision) later += 2 * (kDivision - 1);
  return 1 + static_cast<int>(samples_.size() + to_visit_.size()) + later;
}

Advice Sweep::Ask() {
  const double position = to_visit_.front();
  to_visit_.pop_front();
  return GoAndLook{position};
}

Advice Sweep::Next(const Look& look) {
  if (!started_) {
    // The first frame was reached from an unknown side: it is the standard to beat, not a point of the curve.
    started_ = true;
    if (look.frame != nullptr) bits_ = look.frame->bits;
    pixels_ = std::max(look.window.width * look.window.height, 1);
    return Ask();
  }
  samples_.push_back({look.position, look.score});
  if (!to_visit_.empty()) return Ask();

  const std::vector<CurvePoint> curve = Curve();
  const auto top = std::ranges::max_element(curve, {}, &CurvePoint::value);
  const auto best = static_cast<std::size_t>(top - curve.begin());
  const double rest = LowerQuartile(curve);
  const double prominence = (top->value - rest) / top->sigma;
  if (prominence < kClearProminence || top->value - rest < kClearContrast * top->value) {
    return Refuse("nothing in the region changes with focus: no texture, too much noise, or too little light");
  }
  if (FineEnough(curve, best)) return Conclude(curve, best, prominence);
  PlanPass(top->position - step_, top->position, kDivision, false);
  std::deque<double> below = std::move(to_visit_);
  PlanPass(top->position, top->position + step_, kDivision, false);
  if (setup_.ascending)
    below.insert(below.end(), to_visit_.begin(), to_visit_.end());
  else
    below.insert(below.begin(), to_visit_.begin(), to_visit_.end());
  to_visit_ = std::move(below);
  step_ /= kDivision;
  return Ask();
}

/// All frames of the sweep as a curve, in order of position.
std::vector<CurvePoint> Sweep::Curve() const {
  std::vector<FocusScore> scores;
  for (const Sample& sample : samples_) scores.push_back(sample.score);
  const double noise = NoiseVariance(scores, bits_);
  std::vector<CurvePoint> curve;
  for (const Sample& sample : samples_) {
    const Sharpness sharpness = SharpnessOf(sample.score, noise, pixels_);
    curve.push_back({sample.position, sharpness.value, sharpness.sigma});
  }
  std::ranges::sort(curve, {}, &CurvePoint::position);
  return curve;
}

bool Sweep::FineEnough(const std::vector<CurvePoint>& curve, std::size_t best) const {
  if (step_ <= setup_.resolution * kDivision) return true;
  if (fine_step_ > 0) return step_ <= fine_step_ * kDivision / 2;
  const double level = kPlateau * curve[best].value;
  const bool low_side = best == 0 || curve[best - 1].value >= level;
  const bool high_side = best + 1 == curve.size() || curve[best + 1].value >= level;
  return low_side && high_side;
}

std::vector<CurvePoint> Sweep::Around(const std::vector<CurvePoint>& curve, double centre) const {
  std::vector<CurvePoint> near;
  for (const CurvePoint& point : curve) {
    if (std::abs(point.position - centre) <= kFitSteps * step_ && point.value > 2 * point.sigma) near.push_back(point);
  }
  return near;
}

/// Whether clipping comes and goes with focus: then gradients are cut off just where they would be steepest.
bool Sweep::Overexposed() const {
  const auto [least, most] =
      std::ranges::minmax(samples_, {}, [](const Sample& sample) { return sample.score.saturated_fraction; });
  return most.score.saturated_fraction - least.score.saturated_fraction > kOverexposed;
}

/// The end of the range where the top of the curve lies, if it does: there sharpness is level and then falls, while
/// short of a subject beyond the range it still climbs. Blur falls evenly with position, so a curve that climbs loses
/// about as much in its last step as in the one before.
std::optional<double> Sweep::FlatEnd(const std::vector<CurvePoint>& curve, double top) const {
  constexpr double kAsSharp = 0.97;
  constexpr double kLevel = 0.25;  ///< of the fall three steps away: straight would be a third, a parabola a ninth
  const auto flat = [&](auto begin, auto end) {
    const CurvePoint& last = *begin;
    const CurvePoint& next = *std::next(begin);
    const auto off = std::find_if(
        begin, end, [&](const CurvePoint& point) { return std::abs(point.position - last.position) > 2.5 * step_; });
    if (off == end || last.value < kAsSharp * top) return false;
    const double noise = kSigmas * std::hypot(last.sigma, next.sigma);
    return std::max(last.value - next.value, 0.0) + noise < kLevel * (last.value - off->value);
  };
  if (flat(curve.begin(), curve.end())) return curve.front().position;
  if (flat(curve.rbegin(), curve.rend())) return curve.back().position;
  return std::nullopt;
}

Verdict Sweep::Conclude(const std::vector<CurvePoint>& curve, std::size_t best, double prominence) const {
  const double top = curve[best].position;
  const double allowed = setup_.blur_px ? kHalfDepthOfFieldPx * *setup_.blur_px : 2 * step_;
  const bool at_end = best == 0 || best + 1 == curve.size();
  std::string trouble = "sharpest at the end of the focus range: the subject may lie beyond what this lens reaches";
  std::optional<PeakFit> peak;
  if (!at_end) {
    peak = FitPeak(Around(curve, top));
    if (!peak) trouble = "the sharpest frames do not form a peak";
    if (peak && kSigmas * peak->sigma > allowed) {
      trouble = "noise leaves open where the sharpest place is";
      peak.reset();
    } else if (peak && std::abs(peak->position - top) > 2 * step_) {
      trouble = "the sharpest frames do not agree on one peak";
      peak.reset();
    }
  }
  if (!peak) {
    const auto end = FlatEnd(curve, curve[best].value);
    if (!end) return Refuse(trouble);
    peak = {*end, 0.5 * step_};
  }
  if (Overexposed()) {
    return Refuse("too much of the region is clipped when sharp: a clipped light looks sharpest out of focus");
  }

  Verdict verdict;
  verdict.focused = true;
  verdict.position = std::clamp(peak->position, setup_.lowest, setup_.highest);
  verdict.sigma = std::max(peak->sigma, setup_.resolution / std::sqrt(12.0));
  verdict.confidence = std::erf(allowed / (std::sqrt(2.0) * verdict.sigma));
  std::ostringstream reason;
  reason.precision(3);
  reason << "one peak in the range, " << prominence << " times the noise above the rest, checked by a last frame";
  verdict.reason = reason.str();
  return verdict;
}

}  // namespace lensd::autofocus
