// A pixel between two frames is mixed of both: with one frame alone there would be steps wherever the sharpest frame
// changes. Only pixels that have a share in a frame are fetched from it, by cubic interpolation.
#include "merge/compose.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sharpness.h"

namespace lensd::merge {
namespace {

/// Catmull-Rom's weights for samples at -1, 0, 1 and 2.
std::array<float, 4> Cubic(float t) {
  return {0.5f * t * (-1.0f + t * (2.0f - t)), 1.0f + 0.5f * t * t * (3.0f * t - 5.0f),
          0.5f * t * (1.0f + t * (4.0f - 3.0f * t)), 0.5f * t * t * (t - 1.0f)};
}

/// Where the pixels of one row or column of the merged picture lie in a frame.
struct Taps {
  std::array<int, 4> from;
  std::array<float, 4> weight;
};

std::vector<Taps> TapsOf(int size, double ratio) {
  std::vector<Taps> taps(static_cast<std::size_t>(size));
  for (int x = 0; x < size; ++x) {
    const double from = 0.5 * (size - 1) + (x - 0.5 * (size - 1)) * ratio;
    const int whole = static_cast<int>(std::floor(from));
    Taps& tap = taps[static_cast<std::size_t>(x)];
    tap.weight = Cubic(static_cast<float>(from - whole));
    for (int k = 0; k < 4; ++k) tap.from[static_cast<std::size_t>(k)] = std::clamp(whole - 1 + k, 0, size - 1);
  }
  return taps;
}

float Fetch(const Picture& picture, const Taps& across, const Taps& down, int channel) {
  float sum = 0.0f;
  for (std::size_t v = 0; v < 4; ++v) {
    const float* row =
        picture.samples.data() +
        static_cast<std::size_t>(down.from[v]) * static_cast<std::size_t>(picture.width * picture.channels) + channel;
    float along = 0.0f;
    for (std::size_t u = 0; u < 4; ++u) along += across.weight[u] * row[across.from[u] * picture.channels];
    sum += down.weight[v] * along;
  }
  return sum;
}

/// The share that a frame has in a pixel, by how far the pixel's place is from the frame's on the way to the next
/// one's: 1 to 0, even in the middle and slow at both ends.
float Share(float way) {
  const float t = std::clamp(1.0f - way, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

}  // namespace

Composer::Composer(std::vector<Station> stations, const DepthMap& map) : stations_(std::move(stations)), map_(map) {}

Result<void> Composer::Add(const Picture& picture) {
  if (added_ >= stations_.size()) return Fail(Code::InvalidArgument, "more frames than stations");
  if (picture.width != map_.width || picture.height != map_.height ||
      (added_ > 0 && picture.channels != sum_.channels)) {
    return Fail(Code::InvalidArgument, "frames of different sizes or colours");
  }
  const double ratio = stations_[added_].scale / MergedScale(stations_);
  const double light = SharedLight(LuminanceOf(picture), picture.width, picture.height, ratio);
  if (added_ == 0) {
    light_ = light;
    sum_ = {picture.width, picture.height, picture.channels, std::vector<float>(picture.samples.size())};
  }
  const auto gain = static_cast<float>(light > 0.0 ? light_ / light : 1.0);
  const bool first = added_ == 0, last = added_ + 1 == stations_.size();
  const auto here = static_cast<float>(stations_[added_].place);
  const float to_before = first ? 0.0f : 1.0f / (static_cast<float>(stations_[added_ - 1].place) - here);
  const float to_after = last ? 0.0f : 1.0f / (static_cast<float>(stations_[added_ + 1].place) - here);
  const auto across = TapsOf(picture.width, ratio), down = TapsOf(picture.height, ratio);
  std::size_t i = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x, ++i) {
      // Toward the neighbour on the pixel's own side the way is positive; beyond an end of the stack it is 0.
      const float off = map_.everywhere[i] - here;
      const float share = gain * Share(std::max({off * to_before, off * to_after, 0.0f}));
      if (share <= 0.0f) continue;
      for (int c = 0; c < picture.channels; ++c) {
        sum_.samples[i * static_cast<std::size_t>(picture.channels) + static_cast<std::size_t>(c)] +=
            share * Fetch(picture, across[static_cast<std::size_t>(x)], down[static_cast<std::size_t>(y)], c);
      }
    }
  }
  ++added_;
  return {};
}

Picture Composer::Finish() {
  return std::move(sum_);
}

}  // namespace lensd::merge
