// What depth from defocus makes of its frames: spectra of what is not too bright, laid on each other where the picture
// moved sideways, and the distances that their blur allows. It decides nothing.
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "autofocus/defocus/defocus.h"
#include "autofocus/defocus/disk_response.h"
#include "autofocus/defocus/repeats.h"

namespace lensd::autofocus {

using defocus::Posterior;
using defocus::RingStack;

namespace {

constexpr int kMostSide = 256;  // px of a tile
constexpr std::size_t kMostTiles = 32;
constexpr double kBeyond = 12.0;        // px beyond the range where the focus is looked for, to tell that it is there
constexpr double kBlurredAlike = 12.0;  // px of blur between two frames that must look alike

}  // namespace

void Defocus::Take(const Look& look) {
  if (taken_.empty()) {
    window_ = look.window;
    tiles_ = defocus::TilesOf(window_, kMostSide);
    if (tiles_.size() > kMostTiles) {
      // As many as there is time for, spread over the window.
      std::vector<Window> some;
      for (std::size_t i = 0; i < kMostTiles; ++i) some.push_back(tiles_[i * tiles_.size() / kMostTiles]);
      tiles_ = std::move(some);
    }
  }
  const defocus::Mask before = mask_;
  defocus::MaskClipped(*look.frame, window_, mask_);
  taken_.push_back({look.position,
                    look.position / *setup_.blur_px,
                    std::exchange(asked_open_, false),
                    look.score,
                    *look.frame,
                    {},
                    MidExposure(*look.frame),
                    false,
                    {}});
  const bool again = !before.empty() && before != mask_;
  for (Taken& taken : taken_) {
    if (again || taken.spectra.empty()) taken.spectra = SpectraOf(taken.frame);
  }
  curve_.Add(look);
}

defocus::Tiles Defocus::SpectraOf(const drivers::Frame& frame) const {
  const bool clean = std::ranges::count(mask_, 0) == std::ssize(mask_);
  defocus::Tiles spectra;
  for (const Window& tile : tiles_) {
    spectra.push_back(defocus::SpectrumOf(frame, tile, window_, clean ? defocus::Mask{} : mask_));
  }
  return spectra;
}

double Defocus::LeftOut() const {
  const auto out = std::ssize(mask_) - std::ranges::count(mask_, 0);
  return static_cast<double>(out) / static_cast<double>(mask_.size());
}

/// The least error that frames at the first one's blur, at a part of it and in focus allow on the texture that shows
/// through the blur now; as many times that as the estimate is known to scatter must stay within half a depth of field.
Forecast Defocus::Predict(const Look& first) const {
  constexpr double kScatter = 3.0;         // of the estimate, over the floor
  constexpr double kChanceUnseen = 0.4;    // where nothing shows through the first blur, or nearly so
  constexpr double kStep = 0.1;            // px, of the derivative
  constexpr double kLeastResponse = 0.05;  // power: less is a zero of the disk, which says nothing of the texture
  if (!setup_.blur_px || first.frame == nullptr) return {.frames = 1.0, .chance = 1e-3};
  Defocus alone(setup_);
  alone.Take(first);
  const auto& taken = alone.taken_;
  const std::vector<const Taken*> frames = {&taken.front()};
  const RingStack stack = alone.StackOf(frames);
  if (!defocus::HasTexture(stack)) return {.frames = kFramesWithoutTexture, .chance = kChanceUnseen};
  const double blur = PosteriorOf(stack, frames).TypicalDistance(taken.front().at);
  double information = 0.0;
  for (const defocus::Ring& ring : stack.rings) {
    double value2 = 0.0, change2 = 0.0, product = 0.0;
    for (const double diameter : {blur, (1.0 - kPartOfBlur) * blur, 0.0}) {
      const double value = defocus::DiskResponse(diameter * ring.frequency);
      const double change = (defocus::DiskResponse((diameter + kStep) * ring.frequency) - value) / kStep;
      value2 += value * value;
      change2 += change * change;
      product += value * change;
    }
    const double left = defocus::DiskResponse(blur * ring.frequency);
    const double texture = std::max(ring.power[0] - stack.noise[0], 0.0) / std::max(left * left, kLeastResponse);
    information += 2.0 * ring.count * texture / stack.noise[0] * std::max(change2 - product * product / value2, 0.0);
  }
  // The next frame is taken where less is blurred and more shows, so that little information is no reason for despair.
  const double chance =
      std::max(std::erf(kHalfDepthOfFieldPx * std::sqrt(0.5 * information) / kScatter), kChanceUnseen);
  constexpr double kUsual = 5.0;
  return {.frames = kUsual + (1.0 - chance) * kUsual, .chance = chance};
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
  Posterior posterior(defocus::Likelihood(stack, positions), range, bend, setup_.slope_sigma);
  // What is left of a sideways motion would be taken for blur at this precision.
  if (!(moved_ > 0)) posterior.Refine(defocus::Likelihood(stack, positions), range);
  return posterior;
}

const CurvePoint* Defocus::NearestTo(const std::vector<CurvePoint>& points, double position) const {
  const CurvePoint* nearest = nullptr;
  for (const CurvePoint& point : points) {
    const bool open = std::ranges::any_of(
        taken_, [&](const Taken& taken) { return taken.backlash_open && taken.position == point.position; });
    if (open) continue;
    if (nearest == nullptr || std::abs(point.position - position) < std::abs(nearest->position - position)) {
      nearest = &point;
    }
  }
  return nearest != nullptr ? nearest : &points.front();
}

/// Logarithm of the slope of blur that the frames show about a place that was proved.
double Defocus::ShownSlope(const RingStack& stack, const Posterior& posterior, double focus) const {
  std::vector<double> positions;
  for (const Taken* frame : Nearest(focus_)) positions.push_back(frame->at);
  return posterior.LogSlopeAt(defocus::Likelihood(stack, positions), focus / *setup_.blur_px);
}

/// The picture taken at a top repeats: its contrast comes again far out of focus, with less sharp places on both sides.
/// Even blur may agree there by chance, where one frequency outshines what else there is. `slope`: as Posterior has it.
bool Defocus::MayBeASideTop(const CurvePoint& top, bool agrees, double slope) const {
  constexpr double kRepeats = 1.2, kClearlyRepeats = 1.4;  // RiseWithBlur()
  constexpr double kGratings = 0.7;                        // ShareOfTwoGratings() of a small picture
  const Taken& there =
      *std::ranges::min_element(taken_, {}, [&](const Taken& one) { return std::abs(one.position - top.position); });
  if (std::min(window_.width, window_.height) <= defocus::kSmallSide)
    return defocus::ShareOfTwoGratings(there.spectra.front()) > kGratings;
  const double travel_px = (setup_.highest - setup_.lowest) / *setup_.blur_px * std::max(slope, 1.0);
  return defocus::RiseWithBlur(there.spectra, travel_px) > (agrees ? kClearlyRepeats : kRepeats);
}

/// The slope of blur that the frames near `centre` come to alone, where there are others as well: one lens has one.
std::optional<double> Defocus::SlopeNear(const CurvePoint& centre) const {
  const double most = ReachOfSides(setup_).most;
  std::vector<const Taken*> near = Nearest(focus_);
  const std::size_t all = near.size();
  std::erase_if(near, [&](const Taken* taken) { return std::abs(taken->position - centre.position) > most; });
  if (near.size() < 3 || near.size() == all) return std::nullopt;
  return PosteriorOf(StackOf(near), near).relative_slope();
}

RingStack Defocus::StackOf(const std::vector<const Taken*>& frames) const {
  std::vector<defocus::Tiles> moved;
  moved.reserve(frames.size());
  std::vector<const defocus::Tiles*> spectra;
  for (const Taken* frame : frames) {
    spectra.push_back(&frame->spectra);
    if (!registered_ || !frame->shift.clear) continue;
    moved.push_back(frame->spectra);
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
  defocus::Shift shift = defocus::ShiftBetween(nearest.spectra, newest.spectra);
  if (nearest.shift.clear) {
    shift.x += nearest.shift.x;
    shift.y += nearest.shift.y;
    shift.clear = true;
  }
  if (shift.lost) moving_ = true;
  // Far apart in focus even one scene may look like another: a coarse pattern changes its sign.
  const bool near = std::abs(nearest.at - newest.at) <= kBlurredAlike;
  if (shift.unlike && near) unlike_ = true;
  if (!shift.clear || shift.lost) return;
  taken_.back().shift = shift;
  moved_ = std::max(moved_, std::hypot(shift.x, shift.y));
}

}  // namespace lensd::autofocus
