// Noise from counters: the value at a place depends on seed, frame and place alone, never on what was drawn before.
#pragma once

#include <cstdint>
#include <span>

namespace lensd::sim {

/// A well-mixed 64-bit value (the finaliser of SplitMix64, Steele, Lea and Flood 2014).
constexpr std::uint64_t Mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Fills `out` with draws of mean 0 and variance 1. Each is the sum of two entries of a table of 4,096 normal quantiles
/// over sqrt(2): normal but for a resolution of about 2^-12 and a largest value of 5.2. Same key, same bits,
/// everywhere.
void FillNormals(std::uint64_t key, std::span<float> out);

/// A Poisson draw by inversion for 0 <= mean <= 16, from 32 uniform bits. Values whose probability is below 2^-33 are
/// left out.
int SmallPoisson(float mean, std::uint32_t uniform);

}  // namespace lensd::sim
