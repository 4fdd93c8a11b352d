// Frames come one by one; of each pixel only the sharpest frame and its two neighbours are kept. When all have come a
// curve through the three says where between the frames the pixel is sharp, if it rises above the noise at all.
#include "merge/depth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "noise_floor.h"
#include "peak.h"
#include "sharpness.h"
#include "smooth.h"

namespace lensd::merge {
namespace {

/// Texture is what is sharper than this many times the noise: noise alone is once in 30,000 windows.
constexpr float kTexture = 3.5f;
/// ... and than this many times the least sharp frame: the rest is not of this place.
constexpr float kAboveLeast = 1.5f;
/// A second maximum counts from this share of the first on.
constexpr float kSecond = 0.25f;
/// So far (px) beyond its rim a near thing is seen in the window of sharpness, and so many steps it is before the rest.
constexpr int kRim = 3;
constexpr float kRimSteps = 1.5f;

}  // namespace

struct DepthFinder::Learned {
  explicit Learned(float brightest) : noise(brightest) {}
  NoiseFloor noise;
};

DepthFinder::DepthFinder(std::vector<Station> stations, Prefer prefer)
    : stations_(std::move(stations)), prefer_(prefer) {}
DepthFinder::DepthFinder(DepthFinder&&) noexcept = default;
DepthFinder& DepthFinder::operator=(DepthFinder&&) noexcept = default;
DepthFinder::~DepthFinder() = default;

Result<DepthFinder> DepthFinder::Create(std::vector<Station> stations, Prefer prefer) {
  if (stations.size() < 2) return Fail(Code::InvalidArgument, "a stack to merge has at least two frames");
  if (stations.size() > std::numeric_limits<std::uint16_t>::max())
    return Fail(Code::InvalidArgument, "too many frames");
  const bool rises = stations.back().place > stations.front().place;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    if (!(stations[i].scale > 0.0)) return Fail(Code::InvalidArgument, "the scale of a frame must be above 0");
    if (i == 0) continue;
    const double step = stations[i].place - stations[i - 1].place;
    if (!(rises ? step > 0.0 : step < 0.0)) {
      return Fail(Code::InvalidArgument, "frames of a stack must be in the order of their places, each another one");
    }
  }
  return DepthFinder(std::move(stations), prefer);
}

Result<void> DepthFinder::Add(const Picture& picture) {
  if (added_ >= stations_.size()) return Fail(Code::InvalidArgument, "more frames than stations");
  if (picture.samples.size() != picture.pixels() * static_cast<std::size_t>(picture.channels) || picture.width < 1) {
    return Fail(Code::InvalidArgument, "a picture without all its samples");
  }
  if (added_ > 0 && (picture.width != width_ || picture.height != height_)) {
    return Fail(Code::InvalidArgument, "frames of different sizes");
  }
  width_ = picture.width;
  height_ = picture.height;
  Plane luminance = LuminanceOf(picture);
  const double ratio = stations_[added_].scale / MergedScale(stations_);
  const double light = SharedLight(luminance, width_, height_, ratio);
  if (added_ == 0) {
    light_of_first_ = light;
    learned_ = std::make_unique<Learned>(*std::ranges::max_element(luminance));
  }
  const auto gain = static_cast<float>(light > 0.0 ? light_of_first_ / light : 1.0);
  for (float& sample : luminance) sample *= gain;
  Sharpness sharpness = SharpnessOf(luminance, width_, height_);
  learned_->noise.Learn(sharpness, width_, height_);
  Follow(Magnified(std::move(sharpness.mean), width_, height_, ratio),
         Magnified(std::move(sharpness.light), width_, height_, ratio));
  ++added_;
  return {};
}

void DepthFinder::Follow(Plane sharpness, const Plane& light) {
  if (added_ == 0) {
    const auto begin = [&](Peaks& peaks) {
      peaks.before.assign(sharpness.size(), -1.0f);
      peaks.after = peaks.before;
      peaks.at = sharpness;
      peaks.index.assign(sharpness.size(), 0);
    };
    begin(best_);
    if (prefer_ == Prefer::Later) begin(later_);
    least_ = sharpness;
    light_ = light;
    last_ = std::move(sharpness);
    return;
  }
  for (std::size_t i = 0; i < sharpness.size(); ++i) {
    const float here = sharpness[i];
    if (best_.index[i] + 1 == added_) best_.after[i] = here;
    if (here > best_.at[i]) {
      best_.before[i] = last_[i];
      best_.at[i] = here;
      best_.after[i] = -1.0f;
      best_.index[i] = added_;
      light_[i] = light[i];
    }
    least_[i] = std::min(least_[i], here);
  }
  if (prefer_ == Prefer::Later) FollowLater(sharpness);
  last_ = std::move(sharpness);
}

void DepthFinder::FollowLater(const Plane& sharpness) {
  // A rise begins a new maximum where the last one has been left behind: the frame after it was less sharp.
  for (std::size_t i = 0; i < sharpness.size(); ++i) {
    const float here = sharpness[i];
    const bool next = later_.index[i] + 1 == added_;
    if (next && here <= later_.at[i]) {
      later_.after[i] = here;
    } else if (here > last_[i] && (next || here > kSecond * best_.at[i])) {
      later_.before[i] = last_[i];
      later_.at[i] = here;
      later_.after[i] = -1.0f;
      later_.index[i] = added_;
    }
  }
}

PeakSamples DepthFinder::SamplesOf(const Peaks& peaks, std::size_t pixel) const {
  const std::size_t index = peaks.index[pixel];
  PeakSamples samples{.before = static_cast<double>(peaks.before[pixel]),
                      .at = static_cast<double>(peaks.at[pixel]),
                      .after = static_cast<double>(peaks.after[pixel]),
                      .noise = static_cast<double>(learned_->noise.At(light_[pixel])),
                      .place = stations_[index].place};
  if (index > 0) samples.place_before = stations_[index - 1].place;
  if (index + 1 < stations_.size()) samples.place_after = stations_[index + 1].place;
  return samples;
}

double DepthFinder::UsualBend() const {
  std::vector<double> bends;
  const std::size_t stride = 1 + best_.at.size() / 100'000;
  for (std::size_t i = 0; i < best_.at.size(); i += stride) {
    const PeakSamples samples = SamplesOf(best_, i);
    if (samples.at < 5.0 * static_cast<double>(kTexture) * samples.noise) continue;
    if (const auto bend = BendOf(samples)) bends.push_back(*bend);
  }
  if (bends.empty()) {
    const double step = (stations_.back().place - stations_.front().place) / static_cast<double>(stations_.size() - 1);
    return 1.0 / (step * step);
  }
  const auto middle = bends.begin() + static_cast<std::ptrdiff_t>(bends.size() / 2);
  std::nth_element(bends.begin(), middle, bends.end());
  return *middle;
}

void DepthFinder::Locate(DepthMap& map) const {
  const double bend = UsualBend();
  for (std::size_t i = 0; i < best_.at.size(); ++i) {
    const Peaks* peaks = &best_;
    if (prefer_ == Prefer::Later && later_.at[i] >= kSecond * best_.at[i]) peaks = &later_;
    const PeakSamples samples = SamplesOf(*peaks, i);
    const double floor = std::max(samples.noise, static_cast<double>(least_[i]));
    if (samples.at < static_cast<double>(kTexture) * samples.noise) continue;
    if (samples.at < static_cast<double>(kAboveLeast * least_[i])) continue;
    const auto peak = FitPeak(samples, bend);
    if (!peak) continue;
    map.place[i] = static_cast<float>(peak->place);
    map.sigma[i] = static_cast<float>(peak->sigma);
    map.confidence[i] = static_cast<float>(1.0 - floor / samples.at);
  }
}

Result<DepthMap> DepthFinder::Finish() {
  if (added_ != stations_.size()) {
    return Fail(Code::InvalidArgument, "the stack has " + std::to_string(stations_.size()) + " frames, only " +
                                           std::to_string(added_) + " came");
  }
  learned_->noise.Settle();
  last_ = {};
  DepthMap map;
  map.width = width_;
  map.height = height_;
  map.place.assign(best_.at.size(), kUnknown);
  map.sigma = map.place;
  map.confidence.assign(best_.at.size(), 0.0f);
  Locate(map);
  best_ = later_ = {};
  const auto steps = static_cast<double>(stations_.size() - 1);
  const auto step = static_cast<float>(std::abs(stations_.back().place - stations_.front().place) / steps);
  SmoothPlaces(map.place, map.sigma, width_, height_, 3, step);
  map.everywhere =
      FilledPlaces(map.place, map.sigma, width_, height_, static_cast<float>(stations_[stations_.size() / 2].place));
  LeaveRims(map.place, map.sigma, width_, height_, kRim, kRimSteps * step);
  std::size_t known = 0;
  for (std::size_t i = 0; i < map.place.size(); ++i) {
    if (std::isnan(map.place[i])) map.confidence[i] = 0.0f;
    known += std::isnan(map.place[i]) ? 0 : 1;
  }
  map.known = static_cast<double>(known) / static_cast<double>(map.place.size());
  return map;
}

}  // namespace lensd::merge
