// The rules are those of the header.
#include "autofocus/picture_lag.h"

#include <algorithm>
#include <utility>

#include "autofocus/session/frame_difference.h"

namespace lensd::autofocus {
namespace {

constexpr double kAgain = 0.25;   ///< of the power of a change: what differs by less is the picture that it led to
constexpr double kAlike = 0.5;    ///< changes whose powers differ by less than this may all be noise
constexpr int kNoiseChanges = 2;  ///< so many of them are
constexpr int kEnoughMoves = 2;   ///< that show the lag anew

}  // namespace

std::optional<int> PictureLag::Learned() const {
  if (known_ && *known_ > 0 && tells_ >= kEnoughMoves) return std::min(*known_, most_);
  return known_;
}

bool PictureLag::ThrowsAway(const drivers::Frame& frame) {
  if (static_cast<int>(thrown_.size()) >= known_.value_or(0)) return false;
  thrown_.push_back(frame);
  return true;
}

void PictureLag::MeasureAnew(const drivers::Frame* before, const drivers::Frame& now, const Window& window) {
  std::vector<drivers::Frame> here = std::exchange(thrown_, {});
  if (before == nullptr) return;
  here.push_back(now);
  std::optional<int> lag;
  for (std::size_t i = 0; i < here.size(); ++i) {
    if (ChangeBetween(i == 0 ? *before : here[i - 1], here[i], window).shows) lag = static_cast<int>(i);
  }
  if (!lag) return;
  ++tells_;
  most_ = std::max(most_, *lag);
}

void PictureLag::BeginAtRest(const drivers::Frame& first, int changes) {
  rest_ = {first};
  first_changes_ = changes_ = changes;
  power_ = 0.0;
  is_noise_ = true;
}

PictureLag::AtRest PictureLag::Rested(AtRest how) {
  rest_.clear();
  given_up_ = given_up_ || how == AtRest::OddOne || how == AtRest::Restless;
  return how;
}

PictureLag::AtRest PictureLag::LateBy(int changes) {
  if (changes == 0) return Rested(AtRest::Agrees);
  const int all = known_.value_or(0) + changes;
  if (all > kMostLagFrames) return Rested(AtRest::TooLate);
  known_ = all;
  tells_ = most_ = 0;
  return Rested(AtRest::Late);
}

PictureLag::AtRest PictureLag::Next(const drivers::Frame& frame, const Window& window) {
  const Change change = ChangeBetween(frame, rest_.back(), window);
  if (!change.shows || (power_ > 0.0 && change.power <= kAgain * power_)) {
    return LateBy(changes_);
  }
  const auto agrees = [&](const drivers::Frame& earlier) {
    const Change back = ChangeBetween(frame, earlier, window);
    return !back.shows || back.power <= kAgain * change.power;
  };
  if (std::any_of(rest_.begin(), rest_.end() - 1, agrees)) return Rested(AtRest::OddOne);
  is_noise_ = is_noise_ && !change.is_sharper && (power_ == 0.0 || change.power > kAlike * power_) &&
              (power_ == 0.0 || power_ > kAlike * change.power);
  power_ = std::max(power_, change.power);
  ++changes_;
  rest_.push_back(frame);
  // Noise that a camera smooths, or packs away, is no change, and differs from each frame to each other one alike.
  if (is_noise_ && static_cast<int>(rest_.size()) > kNoiseChanges) return LateBy(first_changes_);
  return changes_ > kMostLagFrames ? Rested(AtRest::Restless) : AtRest::Changed;
}

}  // namespace lensd::autofocus
