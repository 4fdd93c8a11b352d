// Depth maps are reduced in one pass: many samples at a time, two chains of them, no branch.
#include "optics/depth_extremes.h"

#include <algorithm>
#include <array>

namespace lensd::optics {

namespace {

/// Samples that do not count become 65535 for the nearest and 0 for the farthest: no branch. One subtraction turns the
/// unknown depth 0 into 65535, so that one comparison serves for the nearest.
template <bool masked>
DepthExtremes ExtremesWhere(std::span<const std::uint16_t> depths, std::span<const std::uint16_t> classes,
                            std::uint16_t wanted) {
  using Samples = std::uint16_t __attribute__((vector_size(16)));
  constexpr std::size_t kLanes = sizeof(Samples) / sizeof(std::uint16_t), kChains = 2;
  const auto load = [](std::span<const std::uint16_t> from, std::size_t i) {
    Samples samples;
    __builtin_memcpy(&samples, from.data() + i, sizeof samples);
    return samples;
  };
  std::array<Samples, kChains> least, greatest;
  least.fill(~Samples{});
  greatest.fill(Samples{});
  std::size_t i = 0;
  for (; i + kChains * kLanes <= depths.size(); i += kChains * kLanes) {
    for (std::size_t chain = 0; chain < kChains; ++chain) {
      const std::size_t at = i + chain * kLanes;
      Samples depth = load(depths, at);
      if constexpr (masked) depth &= (Samples)(load(classes, at) == wanted);
      const Samples known = depth - 1;
      least[chain] = known < least[chain] ? known : least[chain];
      greatest[chain] = depth > greatest[chain] ? depth : greatest[chain];
    }
  }
  std::uint16_t nearest = 65535, farthest = 0;
  const auto take = [&](std::uint16_t below, std::uint16_t depth) {
    nearest = std::min(nearest, below);
    farthest = std::max(farthest, depth);
  };
  for (std::size_t chain = 0; chain < kChains; ++chain) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) take(least[chain][lane], greatest[chain][lane]);
  }
  for (; i < depths.size(); ++i) {
    const std::uint16_t depth = !masked || classes[i] == wanted ? depths[i] : std::uint16_t{0};
    take(static_cast<std::uint16_t>(depth - 1), depth);
  }
  if (farthest == 0) return {};
  return {static_cast<std::uint16_t>(nearest + 1), farthest};
}

}  // namespace

DepthExtremes ExtremesOfClass(std::span<const std::uint16_t> depths, std::span<const std::uint16_t> classes,
                              std::uint16_t wanted) {
  return ExtremesWhere<true>(depths, classes, wanted);
}

DepthExtremes ExtremesOfDepths(std::span<const std::uint16_t> depths) {
  return ExtremesWhere<false>(depths, {}, 0);
}

}  // namespace lensd::optics
