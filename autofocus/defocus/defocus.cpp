#include "defocus/defocus.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <sstream>
#include <utility>

#include "autofocus/sharpness.h"
#include "defocus/disc.h"

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
constexpr double kPastFocus = 1.25;     // the same where it is to lie behind the focus
constexpr double kShortestStep = 8.0;
constexpr double kLongestStep = 80.0;
constexpr double kClearlyOneSide = 0.65;
constexpr double kClearlyBack = 0.5;  // for a loose frame
constexpr double kMassNeeded = 0.99;
constexpr double kMostMisfit = 0.6;
constexpr int kLeastRings = 4;
constexpr double kLeastCount = 8.0;
constexpr int kLeastFrames = 3;
constexpr int kFrameBudget = 6;
constexpr int kFramesWithoutTexture = 4;
constexpr double kMostSaturated = 0.003;
constexpr double kClearMotion = 1.5;    // px sideways
constexpr double kWorthNaming = 0.1;    // of all probability: a distance that cannot be told from the others
constexpr double kPartReach = 40.0;     // px of blur around the focus where a part may have its own
constexpr double kBlurredAlike = 12.0;  // px of blur between two frames that must look alike
constexpr const char* kMoved = "the subject or the camera moved between the frames";
constexpr const char* kRestless =
    "the picture changes while the lens is said to stand: it still moves, or the subject does";
constexpr double kOddMisfit = 0.2;
constexpr double kOddSlope =
    0.04;  // of blur against position, off the nominal one: the lens, or it was not where it said
constexpr double kBeyond = 12.0;  // px beyond the range where the focus is looked for, to tell that it is there

Verdict Refuse(std::string reason) {
  Verdict verdict;
  verdict.reason = std::move(reason);
  return verdict;
}

/// Where no search for the sharpest place could do better.
Verdict RefuseForGood(std::string reason) {
  Verdict verdict = Refuse(std::move(reason));
  verdict.final = true;
  return verdict;
}

bool HasTexture(const RingStack& stack) {
  double count = 0.0;
  for (const defocus::Ring& ring : stack.rings) count += ring.count;
  return stack.rings.size() >= kLeastRings && count >= kLeastCount;
}

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

Advice Defocus::Next(const Look& look) {
  if (!setup_.blur_px) return Refuse("depth from defocus needs a calibrated lens: blur per step is not known");
  if (taken_.empty()) {
    asked_ = look.window;
    analysed_ = defocus::AnalysisWindow(look.window, look.frame->width, look.frame->height, kLeastSide, kMostSide);
  }
  taken_.push_back({look.position,
                    look.position / *setup_.blur_px,
                    std::exchange(asked_loose_, false),
                    look.score,
                    *look.frame,
                    defocus::SpectrumOf(*look.frame, analysed_),
                    {}});
  if (auto reason = Unusable()) return RefuseForGood(*std::move(reason));
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
  focus_ = posterior.focus();
  const bool enough = HasTexture(stack) && posterior.misfit() <= kMostMisfit;
  if (taken_.size() >= kLeastFrames && enough) {
    const Taken* proof = FrameInFocus(posterior);
    if (proof != nullptr && (alike_ || unlike_ || !doubtful_)) {
      if (unlike_) return RefuseForGood(kMoved);
      // A picture that moves cannot tell a lens that does: then there is nothing to look for.
      const bool odd = std::abs(posterior.relative_slope() - 1.0) > kOddSlope || posterior.misfit() > kOddMisfit;
      if (odd && !(moved_ > 0) && taken_.size() < kFrameBudget) {
        if (proof == &taken_.back() || look.position != proof->position) return GoAndLook{proof->position};
        if (Changed(*proof, taken_.back())) return RefuseForGood(kRestless);
      }
      const auto parts = Parts(frames, proof->at, posterior.slope(), kPartReach);
      if (std::ranges::none_of(parts, &defocus::PartFocus::elsewhere)) return Accept(*proof, posterior);
      return RefuseDepths();
    }
  }
  if (taken_.size() >= kLeastFrames && Beyond(posterior)) {
    return Refuse("the subject lies beyond what this lens reaches");
  }
  const std::size_t most = HasTexture(stack) ? kFrameBudget : kFramesWithoutTexture;
  if (taken_.size() >= most) return WhyNot(stack, posterior);
  if (taken_.size() == 1) return GoToSecond(posterior);
  return GoTo(taken_.size() == 2 ? posterior.focus() : NextPlace(posterior.focus()));
}

int Defocus::FramesExpected() const {
  return std::max<int>(kLeastFrames - 1, static_cast<int>(taken_.size()));
}

/// The least error that frames at the first one's blur, at a part of it and in focus allow on the texture that shows
/// through the blur now; as many times that as the estimate is known to scatter must stay within half a depth of field.
Forecast Defocus::Predict(const Look& first) const {
  constexpr double kScatter = 3.0;         // of the estimate, over the floor
  constexpr double kChanceUnseen = 0.4;    // where nothing shows through the first blur, or nearly so
  constexpr double kStep = 0.1;            // px, of the derivative
  constexpr double kLeastResponse = 0.05;  // power: less is a zero of the disc, which says nothing of the texture
  if (!setup_.blur_px || first.frame == nullptr) return {.frames = 1.0, .chance = 1e-3};
  const Window window =
      defocus::AnalysisWindow(first.window, first.frame->width, first.frame->height, kLeastSide, kMostSide);
  const std::vector<Taken> taken = {{first.position,
                                     first.position / *setup_.blur_px,
                                     false,
                                     first.score,
                                     *first.frame,
                                     defocus::SpectrumOf(*first.frame, window),
                                     {}}};
  const std::vector<const Taken*> frames = {&taken.front()};
  const RingStack stack = StackOf(frames);
  if (!HasTexture(stack)) return {.frames = kFramesWithoutTexture, .chance = kChanceUnseen};
  const double blur = PosteriorOf(stack, frames).TypicalDistance(taken.front().at);
  double information = 0.0;
  for (const defocus::Ring& ring : stack.rings) {
    double value2 = 0.0, change2 = 0.0, product = 0.0;
    for (const double diameter : {blur, (1.0 - kPartOfBlur) * blur, 0.0}) {
      const double value = defocus::DiscResponse(diameter * ring.frequency);
      const double change = (defocus::DiscResponse((diameter + kStep) * ring.frequency) - value) / kStep;
      value2 += value * value;
      change2 += change * change;
      product += value * change;
    }
    const double left = defocus::DiscResponse(blur * ring.frequency);
    const double texture = std::max(ring.power[0] - stack.noise[0], 0.0) / std::max(left * left, kLeastResponse);
    information += 2.0 * ring.count * texture / stack.noise[0] * std::max(change2 - product * product / value2, 0.0);
  }
  // The next frame is taken where less is blurred and more shows, so that little information is no reason for despair.
  const double chance =
      std::max(std::erf(kHalfDepthOfFieldPx * std::sqrt(0.5 * information) / kScatter), kChanceUnseen);
  return {.frames = kLeastFrames + (1.0 - chance) * (kFrameBudget - kLeastFrames), .chance = chance};
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
  const double bend = setup_.focal_length > 0 ? *setup_.blur_px / setup_.focal_length : 0.0;
  Posterior posterior(defocus::Likelihood(stack, positions), range, bend);
  // What is left of a sideways motion would be taken for blur at this precision.
  if (!(moved_ > 0)) posterior.Refine(defocus::Likelihood(stack, positions), range);
  return posterior;
}

Advice Defocus::GoTo(double at, bool loose) {
  asked_loose_ = loose;
  return GoAndLook{.position = std::clamp(at * *setup_.blur_px, setup_.lowest, setup_.highest), .loose = loose};
}

/// A good part of the first frame's blur away, to the side where the focus is. One frame seldom tells the side: then
/// the way that leaves no backlash behind costs one motion less. Where the backlash is known, so does a loose frame
/// beyond the focus: from there the way to the focus takes the backlash up.
Advice Defocus::GoToSecond(const Posterior& posterior) {
  const double at = taken_.front().at;
  const double distance = posterior.TypicalDistance(at);
  const double step = std::clamp(kPartOfBlur * distance, kShortestStep, kLongestStep);
  const double below = posterior.MassBelow(at);
  const double lowest = setup_.lowest / *setup_.blur_px;
  const double highest = setup_.highest / *setup_.blur_px;
  const double slack = setup_.backlash / *setup_.blur_px;
  const double back = setup_.ascending ? below : 1.0 - below;
  if (slack > 0 && back > kClearlyBack) {
    const double past = std::clamp(kPastFocus * distance, kShortestStep + slack, kLongestStep);
    const double room = setup_.ascending ? at - lowest : highest - at;
    if (room > kShortestStep + slack) return GoTo(setup_.ascending ? at - past : at + past, true);
  }
  bool down = setup_.ascending ? below > kClearlyOneSide : below > 1.0 - kClearlyOneSide;
  if ((down ? at - lowest : highest - at) < kShortestStep) down = !down;
  return GoTo(down ? at - step : at + step);
}

/// The estimate; beside it where a frame has been taken there already.
double Defocus::NextPlace(double focus) const {
  constexpr double kBeside = 6.0;
  const auto free = [&](double place) {
    const double at = place * *setup_.blur_px;
    return at >= setup_.lowest && at <= setup_.highest && std::ranges::none_of(taken_, [&](const Taken& taken) {
             return !taken.loose && std::abs(taken.at - place) < kStandsInFocus;
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
    if (!taken.loose && std::abs(taken.at - posterior.focus()) < std::abs(nearest->at - posterior.focus()))
      nearest = &taken;
  }
  if (std::abs(nearest->at - posterior.focus()) > kStandsInFocus) return nullptr;
  return posterior.MassNear(nearest->at, kHalfDepthOfFieldPx) >= kMassNeeded ? nearest : nullptr;
}

/// What its quarters and the window asked for say, each on its own.
std::vector<defocus::PartFocus> Defocus::Parts(const std::vector<const Taken*>& frames, double at, double slope,
                                               double reach) const {
  std::vector<defocus::PartFrame> seen;
  for (const Taken* frame : frames)
    seen.push_back({frame->at, &frame->frame, registered_ ? frame->shift : defocus::Shift{}});
  std::vector<Window> windows;
  const int width = analysed_.width / 2;
  const int height = analysed_.height / 2;
  for (const int x : {0, width}) {
    for (const int y : {0, height}) windows.push_back({analysed_.x + x, analysed_.y + y, width, height});
  }
  if (asked_ != analysed_ && asked_.width <= analysed_.width && asked_.height <= analysed_.height) {
    windows.push_back(asked_);
  }
  std::vector<defocus::PartFocus> parts;
  for (const Window& window : windows) {
    parts.push_back(defocus::FocusOfPart(seen, window, at, slope, at - reach, at + reach));
  }
  return parts;
}

/// Names what each part says of itself; depths nearer to each other than a depth of field count as one.
Verdict Defocus::RefuseDepths() const {
  Verdict verdict = Refuse("parts of the region are in focus at different distances: choose a smaller region");
  // The first frames are the ones spread most widely: those taken later crowd around a place that may mean nothing.
  std::vector<const Taken*> frames;
  for (const Taken& taken : taken_) {
    if (frames.size() < defocus::kMostFrames) frames.push_back(&taken);
  }
  const double middle = 0.5 * (setup_.lowest + setup_.highest) / *setup_.blur_px;
  const double reach = 0.5 * (setup_.highest - setup_.lowest) / *setup_.blur_px;
  std::vector<double> depths;
  for (const defocus::PartFocus& part : Parts(frames, middle, 1.0, reach)) {
    if (part.textured) depths.push_back(part.focus);
  }
  std::ranges::sort(depths);
  std::vector<double> apart;
  for (const double depth : depths) {
    if (apart.empty() || depth - apart.back() > 2.0 * kHalfDepthOfFieldPx) apart.push_back(depth);
  }
  for (const double depth : apart) {
    if (apart.size() > 1) verdict.candidates.push_back({depth * *setup_.blur_px, 0.0, 0});
  }
  // Whatever looks for the sharpest place would take one of them without a word.
  verdict.final = !verdict.candidates.empty();
  return verdict;
}

RingStack Defocus::StackOf(const std::vector<const Taken*>& frames) const {
  std::vector<defocus::Spectrum> moved;
  moved.reserve(frames.size());
  std::vector<const defocus::Spectrum*> spectra;
  for (const Taken* frame : frames) {
    spectra.push_back(&frame->spectrum);
    if (!registered_ || !frame->shift.clear) continue;
    moved.push_back(frame->spectrum);
    defocus::Move(moved.back(), frame->shift);
    spectra.back() = &moved.back();
  }
  return defocus::StackRings(spectra);
}

/// Finds how far the newest frame's picture has moved sideways from the others'. The frame taken nearest to it is
/// blurred most like it; its own shift counts as well.
void Defocus::Register() {
  if (taken_.size() < 2) return;
  const Taken& newest = taken_.back();
  const auto others = std::span(taken_).first(taken_.size() - 1);
  const Taken& nearest =
      *std::ranges::min_element(others, {}, [&](const Taken& other) { return std::abs(other.at - newest.at); });
  defocus::Shift shift = defocus::ShiftBetween(nearest.spectrum, newest.spectrum);
  if (nearest.shift.clear) {
    shift.x += nearest.shift.x;
    shift.y += nearest.shift.y;
    shift.clear = true;
  }
  if (shift.lost) moving_ = true;
  // Far apart in focus even one scene may look like another: a coarse pattern changes its sign.
  const bool near = std::abs(nearest.at - newest.at) <= kBlurredAlike;
  if (shift.unlike) (near ? unlike_ : doubtful_) = true;
  if (near && !shift.unlike) alike_ = true;
  if (!shift.clear || shift.lost) return;
  taken_.back().shift = shift;
  moved_ = std::max(moved_, std::hypot(shift.x, shift.y));
}

/// Whether two frames of one place differ in sharpness by more than noise explains.
bool Defocus::Changed(const Taken& one, const Taken& other) const {
  constexpr double kSigmas = 4.0;
  constexpr double kClearly = 0.03;  // of the sharpness
  const int pixels = asked_.width * asked_.height;
  const double noise = NoiseVariance({one.score, other.score}, one.frame.bits);
  const Sharpness a = SharpnessOf(one.score, noise, pixels);
  const Sharpness b = SharpnessOf(other.score, noise, pixels);
  const double allowed = kSigmas * std::hypot(a.sigma, b.sigma) + kClearly * std::max(a.value, b.value);
  return std::abs(a.value - b.value) > allowed;
}

Verdict Defocus::Accept(const Taken& frame, const Posterior& posterior) const {
  Verdict verdict;
  verdict.focused = true;
  verdict.position = frame.position;
  const double off = frame.at - posterior.focus();
  verdict.sigma = std::max(std::hypot(posterior.sigma(), off) * *setup_.blur_px, setup_.resolution / std::sqrt(12.0));
  verdict.subject = {.position = posterior.focus() * *setup_.blur_px, .sigma = posterior.sigma() * *setup_.blur_px};
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

Verdict Defocus::WhyNot(const RingStack& stack, const Posterior& posterior) const {
  if (!HasTexture(stack)) {
    if (!Repeats(stack)) return Refuse("too little texture to tell blur from shading");
    return RefuseOpen("the texture repeats: several distances leave the same contrast", posterior);
  }
  if (unlike_) return RefuseForGood(kMoved);
  if (posterior.misfit() <= kMostMisfit) {
    return RefuseOpen("the frames leave the distance open: repeating or too little texture, or too little light",
                      posterior);
  }
  if (moving_ || moved_ > kClearMotion) return Refuse(kMoved);
  Verdict several = RefuseDepths();
  if (!several.candidates.empty()) return several;
  return Refuse("blur alone does not explain the frames: several depths, motion, or light that changed");
}

/// Names the distances that the frames cannot tell apart.
Verdict Defocus::RefuseOpen(std::string reason, const Posterior& posterior) const {
  Verdict verdict = Refuse(std::move(reason));
  for (const double place : posterior.Places(kWorthNaming)) {
    const double position = place * *setup_.blur_px;
    if (position >= setup_.lowest && position <= setup_.highest) verdict.candidates.push_back({position, 0.0, 0});
  }
  if (verdict.candidates.size() < 2) verdict.candidates.clear();
  return verdict;
}

}  // namespace lensd::autofocus
