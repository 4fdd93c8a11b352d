// Three frames make the reference, three in a row outside of the dead zone make a change. It sees frames of a lens at
// rest only.
#include "autofocus/tracker.h"

#include <algorithm>
#include <cmath>

namespace lensd::autofocus {
namespace {

constexpr std::size_t kReferenceFrames = 3;
constexpr int kFramesToBelieve = 3;  // in a row: one alone may be a passing shadow
constexpr double kSigmas = 6.0;      // of the noise
constexpr double kClearLight = 0.3;  // relative change of brightness

}  // namespace

void Tracker::SearchEnded(bool focused, Instant now) {
  focused_ = focused;
  ended_at_ = now;
  reference_.clear();
  outside_in_a_row_ = 0;
  pause_ = focused ? settings_.shortest_pause
                   : std::clamp(2 * pause_, 2 * settings_.shortest_pause, settings_.longest_pause);
}

bool Tracker::OutsideDeadZone(const FocusScore& score, int bits, int pixels) {
  std::vector<FocusScore> all = reference_;
  all.push_back(score);
  const double noise = NoiseVariance(all, bits);
  double value = 0.0, variance = 0.0, light = 0.0;
  for (const FocusScore& before : reference_) {
    const Sharpness sharpness = SharpnessOf(before, noise, pixels);
    value += sharpness.value / kReferenceFrames;
    variance += sharpness.sigma * sharpness.sigma / kReferenceFrames / kReferenceFrames;
    light += before.mean / kReferenceFrames;
  }
  const Sharpness now = SharpnessOf(score, noise, pixels);
  const double allowed = std::max(settings_.dead_zone * value, kSigmas * std::sqrt(variance + now.sigma * now.sigma));
  const bool other_light = std::abs(score.mean - light) > kClearLight * light;
  if (settings_.watches == TrackerSettings::Watches::AnyChange) {
    return std::abs(now.value - value) > allowed || other_light;
  }
  if (other_light) reference_.clear();
  return !other_light && value - now.value > allowed;
}

bool Tracker::Changed(const FocusScore& score, int bits, int pixels, Instant now) {
  if (reference_.size() < kReferenceFrames) {
    reference_.push_back(score);
    return false;
  }
  outside_in_a_row_ = OutsideDeadZone(score, bits, pixels) ? outside_in_a_row_ + 1 : 0;
  const bool changed = outside_in_a_row_ >= kFramesToBelieve;
  if (now < ended_at_ + pause_) return false;
  // Where the subject was not found, another try costs nothing that is in focus.
  return changed || !focused_;
}

}  // namespace lensd::autofocus
