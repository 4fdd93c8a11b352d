// Frames are cut into blocks, the blocks are sorted by brightness, and of each brightness the quieter ones count: they
// have no texture, or it is blurred. Photon noise grows with the light, so each brightness has a floor of its own.
#include "noise_floor.h"

#include <algorithm>

namespace lensd::merge {
namespace {

constexpr int kBlock = 8;
constexpr double kQuantile = 0.2;
/// The mean of white noise over its quantile in blocks of this size (measured, tests/merge).
constexpr float kMeanOverQuantile = 1.2f;
constexpr std::size_t kFewestBlocks = 30;
/// What is finer than this share of the brightest is no texture, however quiet the frames are: squared.
constexpr float kLeastShare = 1e-6f;

}  // namespace

NoiseFloor::NoiseFloor(float brightest)
    : per_light_(kBins / std::max(brightest, 1e-20f)), least_(std::max(kLeastShare * brightest * brightest, 1e-30f)) {
  quiet_.fill(-1.0f);
}

void NoiseFloor::Learn(const Sharpness& frame, int width, int height) {
  std::array<std::vector<float>, kBins> blocks;
  for (int y = 0; y + kBlock <= height; y += kBlock) {
    for (int x = 0; x + kBlock <= width; x += kBlock) {
      float detail = 0.0f, light = 0.0f;
      for (int row = y; row < y + kBlock; ++row) {
        const std::size_t at =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
        for (std::size_t i = at; i < at + kBlock; ++i) {
          detail += frame.detail[i];
          light += frame.light[i];
        }
      }
      constexpr float kPart = 1.0f / (kBlock * kBlock);
      if (detail <= 0.0f) continue;  // clipped
      const int bin = std::clamp(static_cast<int>(light * kPart * per_light_), 0, kBins - 1);
      blocks[static_cast<std::size_t>(bin)].push_back(detail * kPart);
    }
  }
  for (std::size_t bin = 0; bin < blocks.size(); ++bin) {
    auto& found = blocks[bin];
    if (found.size() < kFewestBlocks) continue;
    const auto middle = found.begin() + static_cast<std::ptrdiff_t>(kQuantile * static_cast<double>(found.size()));
    std::nth_element(found.begin(), middle, found.end());
    const float quiet = *middle * kMeanOverQuantile;
    if (quiet_[bin] < 0.0f || quiet < quiet_[bin]) quiet_[bin] = quiet;
  }
}

void NoiseFloor::Settle() {
  // Where no light of that kind was seen the nearest brightness stands for it.
  const auto known = quiet_;
  for (int bin = 0; bin < kBins; ++bin) {
    for (int away = 0; away < kBins && quiet_[static_cast<std::size_t>(bin)] < 0.0f; ++away) {
      for (const int from : {bin - away, bin + away}) {
        if (from >= 0 && from < kBins) {
          quiet_[static_cast<std::size_t>(bin)] =
              std::max(quiet_[static_cast<std::size_t>(bin)], known[static_cast<std::size_t>(from)]);
        }
      }
    }
  }
}

float NoiseFloor::At(float light) const {
  const float bin = std::clamp(light * per_light_ - 0.5f, 0.0f, static_cast<float>(kBins - 1));
  const int low = std::min(static_cast<int>(bin), kBins - 2);
  const float part = bin - static_cast<float>(low);
  const float below = quiet_[static_cast<std::size_t>(low)], above = quiet_[static_cast<std::size_t>(low) + 1];
  return std::max(least_, below + part * (above - below));
}

}  // namespace lensd::merge
