// Modes are gathered into rings, and rings in which no frame shows more than noise are dropped. All frames have the
// same tiles.
#include "autofocus/defocus/rings.h"

#include <algorithm>
#include <cmath>

namespace lensd::autofocus::defocus {
namespace {

constexpr double kFirstBin = 2.5;          // below, the window's own shape shows
constexpr double kHighest = 0.33;          // cycles per px: beyond, texture folds back
constexpr double kFolding = 0.22;          // cycles per px: from here on, folding makes rings tell less
constexpr double kOneBinRings = 16.0;      // up to here rings are one bin wide, then a constant part of their radius
constexpr double kHannCorrelation = 3.78;  // modes under a Hann window that are worth one independent mode
constexpr double kVisible = 3.0;           // standard deviations over the noise

int RingOf(double bins) {
  if (bins < kFirstBin) return -1;
  if (bins < kOneBinRings + kFirstBin) return static_cast<int>(bins - kFirstBin);
  return static_cast<int>(kOneBinRings + kOneBinRings * std::log(bins / (kOneBinRings + kFirstBin)));
}

struct Sums {
  double modes = 0.0;
  double frequency = 0.0;
  double light = 0.0;   ///< power over noise, all frames
  double square = 0.0;  ///< of that
  Matrix power{};
};

/// Photon noise relative to the mean goes with 1/mean; the frame that shows least texture tells the noise of all.
std::array<double, kMostFrames> NoiseOf(std::span<const Tiles* const> frames, std::size_t tile) {
  const auto of = [&](const Tiles* frame) { return (*frame)[tile].noise * (*frame)[tile].mean; };
  double least = of(frames[0]);
  for (const Tiles* frame : frames) least = std::min(least, of(frame));
  std::array<double, kMostFrames> noise{};
  for (std::size_t i = 0; i < frames.size(); ++i) noise[i] = least / (*frames[i])[tile].mean;
  return noise;
}

/// Adds one tile's modes. `scale` brings its noise to that of the tile that the stack's noise is of.
void AddRings(std::span<const Tiles* const> frames, std::size_t tile, const std::array<double, kMostFrames>& noise,
              double scale, std::vector<Sums>& rings) {
  const Spectrum& first = (*frames[0])[tile];
  const int n = static_cast<int>(frames.size());
  const double side = std::min(first.width, first.height);
  for (int j = 0; j < first.height; ++j) {
    const double fy = (j <= first.height / 2 ? j : j - first.height) / static_cast<double>(first.height);
    for (int i = 0; i < first.columns(); ++i) {
      if (i == 0 && fy < 0) continue;  // the mirror image of a mode already counted
      const double f = std::hypot(static_cast<double>(i) / first.width, fy);
      if (f > kHighest) continue;
      const int index = RingOf(f * side);
      if (index < 0) continue;
      Sums& ring = rings[static_cast<std::size_t>(index)];
      const auto mode = static_cast<std::size_t>(j * first.columns() + i);
      double light = 0.0;
      for (int a = 0; a < n; ++a) {
        const std::complex<float> ya = (*frames[static_cast<std::size_t>(a)])[tile].modes[mode];
        light += std::norm(ya) / noise[static_cast<std::size_t>(a)];
        for (int b = a; b < n; ++b) {
          const std::complex<float> yb = (*frames[static_cast<std::size_t>(b)])[tile].modes[mode];
          ring.power[static_cast<std::size_t>(a * kMostFrames + b)] +=
              scale * (ya.real() * yb.real() + ya.imag() * yb.imag());
        }
      }
      ring.modes += 1.0;
      ring.frequency += f;
      ring.light += light;
      ring.square += light * light;
    }
  }
}

}  // namespace

RingStack StackRings(std::span<const Tiles* const> frames) {
  RingStack stack;
  stack.frames = static_cast<int>(frames.size());
  stack.noise = NoiseOf(frames, 0);
  const Spectrum& first = frames[0]->front();
  const double side = std::min(first.width, first.height);
  const double bin = 1.0 / side;
  std::vector<Sums> rings(static_cast<std::size_t>(RingOf(std::max(kHighest * side, kFirstBin)) + 1));
  for (std::size_t tile = 0; tile < frames[0]->size(); ++tile) {
    const auto noise = NoiseOf(frames, tile);
    AddRings(frames, tile, noise, stack.noise[0] / noise[0], rings);
  }
  for (const Sums& sums : rings) {
    if (sums.modes < 1) continue;
    Ring ring;
    ring.frequency = sums.frequency / sums.modes;
    ring.spread = bin;
    // Texture along one direction puts all its power into a few modes of a ring: no more than those count.
    ring.count = std::min(sums.modes, 2.0 * sums.light * sums.light / sums.square) / kHannCorrelation;
    ring.count /= 1.0 + std::pow(ring.frequency / kFolding, 4);
    double clearest = 0.0;
    for (std::size_t a = 0; a < frames.size(); ++a) {
      for (std::size_t b = a; b < frames.size(); ++b) {
        const double mean = sums.power[a * kMostFrames + b] / sums.modes;
        ring.power[a * kMostFrames + b] = ring.power[b * kMostFrames + a] = mean;
      }
      clearest = std::max(clearest, ring.power[a * kMostFrames + a] / stack.noise[a] - 1.0);
    }
    if (clearest * std::sqrt(ring.count) >= kVisible) stack.rings.push_back(ring);
  }
  return stack;
}

bool HasTexture(const RingStack& stack) {
  constexpr int kLeastRings = 4;
  constexpr double kLeastCount = 8.0;
  double count = 0.0;
  for (const Ring& ring : stack.rings) count += ring.count;
  return stack.rings.size() >= kLeastRings && count >= kLeastCount;
}

bool IsOneGrating(const RingStack& stack) {
  constexpr double kBins = 3.0;       // as far as the window spreads a frequency
  constexpr double kLeastBins = 6.0;  // coarse light shows near 0 of any texture that is blurred
  constexpr double kNearlyAll = 0.999;
  if (stack.rings.empty()) return false;
  const auto light = [&](const Ring& ring, int frame) {
    const auto at = static_cast<std::size_t>(frame);
    return ring.count * std::max(0.0, ring.power[at * kMostFrames + at] - stack.noise[at]);
  };
  bool one = false;
  for (int frame = 0; frame < stack.frames; ++frame) {
    const auto brighter = [&](const Ring& a, const Ring& b) { return light(a, frame) < light(b, frame); };
    const Ring& brightest = *std::ranges::max_element(stack.rings, brighter);
    if (brightest.frequency < kLeastBins * brightest.spread) return false;
    double all = 0.0, near = 0.0;
    for (const Ring& ring : stack.rings) {
      const double part = light(ring, frame);
      all += part;
      if (std::abs(ring.frequency - brightest.frequency) <= kBins * ring.spread) near += part;
    }
    if (all > 0 && near < kNearlyAll * all) return false;
    one = one || all > 0;
  }
  return one;
}

}  // namespace lensd::autofocus::defocus
