// Least and greatest of many samples in one pass at memory speed.
#include <algorithm>
#include <array>
#include <limits>

#include "optics/planner_columns.h"

namespace lensd::optics {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Two = double __attribute__((vector_size(16)));

Two Load(const double* from) {
  Two v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}

template <int sign>
Two Beyond(Two a, Two b) {
  return sign > 0 ? (a < b ? a : b) : (a > b ? a : b);
}

}  // namespace

Extremes ExtremesOf(std::span<const double> values) {
  std::array<Two, 4> least, greatest;
  least.fill(Two{kInfinity, kInfinity});
  greatest.fill(Two{-kInfinity, -kInfinity});
  std::size_t i = 0;
  for (; i + 8 <= values.size(); i += 8) {
    for (std::size_t lane = 0; lane < 4; ++lane) {
      const Two v = Load(values.data() + i + 2 * lane);
      least[lane] = Beyond<1>(v, least[lane]);
      greatest[lane] = Beyond<-1>(v, greatest[lane]);
    }
  }
  Extremes extremes{kInfinity, -kInfinity};
  for (std::size_t lane = 0; lane < 4; ++lane) {
    extremes.least = std::min({extremes.least, least[lane][0], least[lane][1]});
    extremes.greatest = std::max({extremes.greatest, greatest[lane][0], greatest[lane][1]});
  }
  for (; i < values.size(); ++i) {
    extremes.least = std::min(extremes.least, values[i]);
    extremes.greatest = std::max(extremes.greatest, values[i]);
  }
  return extremes;
}

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
