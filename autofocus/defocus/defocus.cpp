#include "defocus/defocus.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "defocus/parts.h"

namespace lensd::autofocus {
namespace {

using defocus::Posterior;
using defocus::RingStack;

constexpr int kLeastSide = 192;  // px of the window analysed
constexpr int kMostSide = 256;
constexpr double kHalfDepthOfFieldPx = 2.0;
constexpr double kStandsInFocus = 1.1;  // px of blur between the estimate and the frame that proves it
constexpr double kSamePlace = 0.3;      // px of blur
constexpr double kPartOfBlur = 0.6;     // of the first frame: how far away the second is taken
constexpr double kShortestStep = 8.0;
constexpr double kLongestStep = 80.0;
constexpr double kClearlyOneSide = 0.65;
constexpr double kMassNeeded = 0.99;
constexpr double kMostMisfit = 0.6;
constexpr int kLeastRings = 4;
constexpr double kLeastCount = 8.0;
constexpr int kLeastFrames = 3;
constexpr int kFrameBudget = 6;
constexpr int kFramesWithoutTexture = 4;
constexpr double kMostSaturated = 0.003;
constexpr double kBeyond = 12.0;  // px beyond the range where the focus is looked for, to tell that it is there

Verdict Refuse(std::string reason) {
  Verdict verdict;
  verdict.reason = std::move(reason);
  return verdict;
}

bool HasTexture(const RingStack& stack) {
  double count = 0.0;
  for (const defocus::Ring& ring : stack.rings) count += ring.count;
  return stack.rings.size() >= kLeastRings && count >= kLeastCount;
}

}  // namespace

Advice Defocus::Next(const Look& look) {
  if (!setup_.blur_px) return Refuse("depth from defocus needs a calibrated lens: blur per step is not known");
  if (taken_.empty()) {
    asked_ = look.window;
    analysed_ = defocus::AnalysisWindow(look.window, look.frame->width, look.frame->height, kLeastSide, kMostSide);
  }
  taken_.push_back({look.position / *setup_.blur_px, *look.frame, defocus::SpectrumOf(*look.frame, analysed_)});
  if (auto reason = Unusable()) return Refuse(*std::move(reason));

  const std::vector<const Taken*> frames = Nearest(focus_);
  std::vector<const defocus::Spectrum*> spectra;
  for (const Taken* frame : frames) spectra.push_back(&frame->spectrum);
  const RingStack stack = defocus::StackRings(spectra);
  const Posterior posterior = PosteriorOf(stack, frames);
  focus_ = posterior.focus();
  const bool enough = HasTexture(stack) && posterior.misfit() <= kMostMisfit;
  if (taken_.size() >= kLeastFrames && enough) {
    if (const Taken* proof = FrameInFocus(posterior); proof != nullptr) {
      if (PartsAgree(frames, posterior, proof->at)) return Accept(*proof, posterior);
      return Refuse("parts of the region are in focus at different distances");
    }
  }
  if (taken_.size() >= kLeastFrames && Beyond(posterior)) {
    return Refuse("the subject lies beyond what this lens reaches");
  }
  const std::size_t most = HasTexture(stack) ? kFrameBudget : kFramesWithoutTexture;
  if (taken_.size() >= most) return Refuse(WhyNot(stack, posterior));
  if (taken_.size() == 1) return GoTo(SecondPlace(posterior));
  return GoTo(taken_.size() == 2 ? posterior.focus() : NextPlace(posterior.focus()));
}

int Defocus::FramesExpected() const {
  return std::max<int>(kLeastFrames - 1, static_cast<int>(taken_.size()));
}

std::optional<std::string> Defocus::Unusable() const {
  if (taken_.back().spectrum.saturated > kMostSaturated) return "parts of the region are too bright for the sensor";
  return std::nullopt;
}

/// The frames to take together: the newest, and those nearest to where the focus seems to be.
std::vector<const Defocus::Taken*> Defocus::Nearest(double focus) const {
  std::vector<const Taken*> sorted;
  for (const Taken& taken : taken_) sorted.push_back(&taken);
  std::ranges::sort(sorted, {},
                    [&](const Taken* frame) { return frame == &taken_.back() ? 0.0 : std::abs(frame->at - focus); });
  // A second frame of one place says nothing about blur: it comes after those of other places.
  std::vector<const Taken*> frames;
  std::vector<const Taken*> again;
  for (const Taken* frame : sorted) {
    const bool seen =
        std::ranges::any_of(frames, [&](const Taken* other) { return std::abs(other->at - frame->at) < kSamePlace; });
    (seen ? again : frames).push_back(frame);
  }
  frames.insert(frames.end(), again.begin(), again.end());
  if (frames.size() > defocus::kMostFrames) frames.resize(defocus::kMostFrames);
  return frames;
}

Posterior Defocus::PosteriorOf(const RingStack& stack, const std::vector<const Taken*>& frames) const {
  std::vector<double> positions;
  for (const Taken* frame : frames) positions.push_back(frame->at);
  const defocus::Range range{setup_.lowest / *setup_.blur_px - kBeyond, setup_.highest / *setup_.blur_px + kBeyond};
  return Posterior(defocus::Likelihood(stack, positions), range);
}

Advice Defocus::GoTo(double at) {
  return GoAndLook{std::clamp(at * *setup_.blur_px, setup_.lowest, setup_.highest)};
}

/// A good part of the first frame's blur away, to the side where the focus is. One frame seldom tells the side: then
/// the way that leaves no backlash behind costs one motion less.
double Defocus::SecondPlace(const Posterior& posterior) const {
  const double at = taken_.front().at;
  const double step = std::clamp(kPartOfBlur * posterior.TypicalDistance(at), kShortestStep, kLongestStep);
  const double below = posterior.MassBelow(at);
  const double lowest = setup_.lowest / *setup_.blur_px;
  const double highest = setup_.highest / *setup_.blur_px;
  bool down = setup_.ascending ? below > kClearlyOneSide : below > 1.0 - kClearlyOneSide;
  if ((down ? at - lowest : highest - at) < kShortestStep) down = !down;
  return down ? at - step : at + step;
}

/// The estimate; beside it where a frame has been taken there already.
double Defocus::NextPlace(double focus) const {
  constexpr double kBeside = 6.0;
  const auto free = [&](double place) {
    const double at = place * *setup_.blur_px;
    return at >= setup_.lowest && at <= setup_.highest && std::ranges::none_of(taken_, [&](const Taken& taken) {
             return std::abs(taken.at - place) < kStandsInFocus;
           });
  };
  for (const double place : {focus, focus + kBeside, focus - kBeside}) {
    if (free(place)) return place;
  }
  return focus + 2 * kBeside;
}

const Defocus::Taken* Defocus::FrameInFocus(const Posterior& posterior) const {
  const Taken* nearest = &taken_.front();
  for (const Taken& taken : taken_) {
    if (std::abs(taken.at - posterior.focus()) < std::abs(nearest->at - posterior.focus())) nearest = &taken;
  }
  if (std::abs(nearest->at - posterior.focus()) > kStandsInFocus) return nullptr;
  return posterior.MassNear(nearest->at, kHalfDepthOfFieldPx) >= kMassNeeded ? nearest : nullptr;
}

/// Quarters of the window analysed, and the window asked for, each on its own.
bool Defocus::PartsAgree(const std::vector<const Taken*>& frames, const Posterior& posterior, double at) const {
  std::vector<defocus::PartFrame> seen;
  for (const Taken* frame : frames) seen.push_back({frame->at, &frame->frame});
  std::vector<Window> parts;
  const int width = analysed_.width / 2;
  const int height = analysed_.height / 2;
  for (const int x : {0, width}) {
    for (const int y : {0, height}) parts.push_back({analysed_.x + x, analysed_.y + y, width, height});
  }
  if (asked_ != analysed_ && asked_.width <= analysed_.width && asked_.height <= analysed_.height) {
    parts.push_back(asked_);
  }
  return std::ranges::all_of(
      parts, [&](const Window& part) { return defocus::PartAgrees(seen, part, at, posterior.slope()); });
}

Verdict Defocus::Accept(const Taken& frame, const Posterior& posterior) const {
  Verdict verdict;
  verdict.focused = true;
  verdict.position = frame.at * *setup_.blur_px;
  const double off = frame.at - posterior.focus();
  verdict.sigma = std::max(std::hypot(posterior.sigma(), off) * *setup_.blur_px, setup_.resolution / std::sqrt(12.0));
  verdict.confidence = posterior.MassNear(frame.at, kHalfDepthOfFieldPx);
  std::ostringstream reason;
  reason.precision(2);
  reason << "the blur of " << taken_.size() << " frames agrees on one distance to " << posterior.sigma()
         << " px of blur, and one of them stands there";
  verdict.reason = reason.str();
  return verdict;
}

/// Nearly all probability lies where the lens cannot go.
bool Defocus::Beyond(const Posterior& posterior) const {
  const double below = posterior.MassBelow(setup_.lowest / *setup_.blur_px - kHalfDepthOfFieldPx);
  const double inside = posterior.MassBelow(setup_.highest / *setup_.blur_px + kHalfDepthOfFieldPx) - below;
  return inside < 1.0 - kMassNeeded;
}

std::string Defocus::WhyNot(const RingStack& stack, const Posterior& posterior) const {
  if (!HasTexture(stack)) return "too little texture to tell blur from shading";
  if (posterior.misfit() > kMostMisfit) {
    return "blur alone does not explain the frames: several depths, motion, or light that changed";
  }
  return "the frames leave the distance open: repeating or too little texture, or too little light";
}

}  // namespace lensd::autofocus
