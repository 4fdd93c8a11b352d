// The places of a pass and what follows from it. Frames come in the order they were asked for, after the first one,
// which is of where the lens happened to stand and no point of the curve.
#include "autofocus/search/sweep.h"

#include <algorithm>
#include <cmath>

namespace lensd::autofocus {
namespace {

constexpr double kCoarseBlurPx = 10.0;  ///< of the first pass: at most 5 px of blur from some frame
constexpr double kFineBlurPx = 1.25;    ///< about where the search ends
constexpr int kBlindIntervals = 48;     ///< of the first pass where the optics are not known
constexpr int kDivision = 3;            ///< of the step, from pass to pass
constexpr int kLeastIntervals = 4;
constexpr double kRounding = 1e-6;        ///< of an interval
constexpr int kSmallSide = 32;            ///< px
constexpr double kFaintBlurPx = 5.0;      ///< between frames: fine texture in noise shows from no farther away
constexpr std::size_t kMostFrames = 100;  ///< so many are taken to find some texture
constexpr double kPlateau = 0.7;          ///< neighbours at this share of the peak: the step is below its width

}  // namespace

int FirstIntervals(const Setup& setup) {
  const double range = setup.highest - setup.lowest;
  const double usual = setup.blur_px ? kCoarseBlurPx * *setup.blur_px : range / kBlindIntervals;
  const double step = std::max(setup.step.value_or(usual), setup.resolution);
  return std::max(kLeastIntervals, static_cast<int>(std::ceil(range / step - kRounding)));
}

/// A motor of few steps is looked at step by step.
int DivisionOf(const Setup& setup, double step) {
  return std::min(kDivision, static_cast<int>(std::lround(step / setup.resolution)));
}

double LastStep(const Setup& setup) {
  return setup.blur_px ? std::max(kFineBlurPx * *setup.blur_px, setup.resolution) : 0.0;
}

bool FineEnough(const Setup& setup, double step, const std::vector<CurvePoint>& curve, std::size_t best) {
  if (step < 1.5 * setup.resolution) return true;
  if (const double last = LastStep(setup); last > 0) return step <= last * kDivision / 2;
  const double level = kPlateau * curve[best].value;
  const bool low_side = best == 0 || curve[best - 1].value >= level;
  const bool high_side = best + 1 == curve.size() || curve[best + 1].value >= level;
  return low_side && high_side;
}

Sweep::Sweep(const Setup& setup) : setup_(setup) {
  intervals_ = FirstIntervals(setup);
  step_ = (setup.highest - setup.lowest) / intervals_;
  PlanPass(setup.lowest, setup.highest, intervals_, Ends::Included);
}

/// Positions that divide from..to into intervals, in the direction that takes up the backlash; inside the range.
void Sweep::PlanPass(double from, double to, int intervals, Ends ends) {
  std::vector<double> positions;
  const int left_out = ends == Ends::Included ? 0 : 1;
  for (int i = left_out; i <= intervals - left_out; ++i) {
    const double position = std::lerp(from, to, static_cast<double>(i) / intervals);
    if (position >= setup_.lowest && position <= setup_.highest) positions.push_back(position);
  }
  if (!setup_.ascending) std::ranges::reverse(positions);
  to_visit_.assign(positions.begin(), positions.end());
}

int Sweep::FramesExpected() const {
  int later = 0;
  const double last = LastStep(setup_);
  const double end = last > 0 ? last : step_ / (kDivision * kDivision);
  for (double step = step_; step > end * kDivision / 2; step /= kDivision) later += 2 * (kDivision - 1);
  return 1 + static_cast<int>(curve_.size() + to_visit_.size()) + later;
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
    return Ask();
  }
  curve_.Add(look);
  // In a small window nothing tells a faint texture from the side lobe of a grating.
  if (std::min(look.window.width, look.window.height) <= kSmallSide && look.frame != nullptr) intervals_ = 0;
  if (!to_visit_.empty()) return Ask();

  return Conclude();
}

/// Where a pass over the whole range shows no top: another one between its frames, until they are so near to each other
/// that the faintest texture that can be found would show.
bool Sweep::LooksBetween() {
  if (intervals_ == 0 || !setup_.blur_px) return false;
  const double half = 0.5 * step_;
  if (step_ <= kFaintBlurPx * *setup_.blur_px * (1.0 + kRounding) || half < setup_.resolution) return false;
  if (curve_.size() + static_cast<std::size_t>(intervals_) > kMostFrames) return false;
  PlanPass(setup_.lowest + half, setup_.highest - half, intervals_ - 1, Ends::Included);
  intervals_ *= 2;
  step_ = half;
  return true;
}

/// After a pass: the next one, or the end.
Advice Sweep::Conclude() {
  const std::vector<CurvePoint> points = curve_.Points();
  const auto top = TopOf(points);
  if (!top && curve_.Overexposed()) return Refuse(kTooBright);
  if (!top) return LooksBetween() ? Ask() : Refuse(kNoPeak);
  intervals_ = 0;
  if (FineEnough(setup_, step_, points, top->index))
    return JudgePeak(setup_, curve_, points, *top, kFitSteps * step_, step_);
  const double place = points[top->index].position;
  const int division = DivisionOf(setup_, step_);
  PlanPass(place - step_, place, division, Ends::LeftOut);
  std::deque<double> below;
  below.swap(to_visit_);
  PlanPass(place, place + step_, division, Ends::LeftOut);
  if (setup_.ascending)
    below.insert(below.end(), to_visit_.begin(), to_visit_.end());
  else
    below.insert(below.begin(), to_visit_.begin(), to_visit_.end());
  to_visit_ = std::move(below);
  step_ /= division;
  return to_visit_.empty() ? Conclude() : Ask();
}

}  // namespace lensd::autofocus
