// Noise from counters: a sample's draw depends on seed, frame and place alone. Only additions and multiplications, so
// every build gives the same bits.
#include "sim/camera/noise.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace lensd::sim {
namespace {

constexpr std::size_t kQuantiles = 4096;
constexpr double kTableUnit = 4096.0;  // table entries for one standard deviation

/// e^-x for 0 <= x <= 20 by additions and multiplications alone, whose rounding is the same in every build.
double ExpOfMinus(double x) {
  constexpr int kHalvings = 7;
  const double part = -x / (1 << kHalvings);
  double term = 1.0;
  double sum = 1.0;
  for (int n = 1; n <= 14; ++n) {
    term *= part / n;
    sum += term;
  }
  for (int n = 0; n < kHalvings; ++n) sum *= sum;
  return sum;
}

double NormalDensity(double x) {
  return ExpOfMinus(0.5 * x * x) * (std::numbers::inv_sqrtpi / std::numbers::sqrt2);
}

/// The part of a normal distribution between 0 and x, by its power series.
double NormalFromZero(double x) {
  double term = x;
  double sum = x;
  for (int n = 3; term > 1e-18 * sum; n += 2) {
    term *= x * x / n;
    sum += term;
  }
  return sum * NormalDensity(x);
}

struct Table {
  std::array<std::int16_t, kQuantiles> entries;
  float scale;  ///< makes the sum of two entries one of variance 1
};

/// Quantiles at the middles of equal shares, by Newton's method from the neighbour.
Table MakeTable() {
  Table table{};
  double x = 0.0;
  double variance = 0.0;
  for (std::size_t i = 0; i < kQuantiles / 2; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / kQuantiles;
    for (int step = 0; step < 8; ++step) x -= (NormalFromZero(x) - share) / NormalDensity(x);
    const auto entry = static_cast<std::int16_t>(std::lround(x * kTableUnit));
    table.entries[kQuantiles / 2 + i] = entry;
    table.entries[kQuantiles / 2 - 1 - i] = static_cast<std::int16_t>(-entry);
    variance += 2.0 * entry * entry / kQuantiles;
  }
  table.scale = static_cast<float>(1.0 / std::sqrt(2.0 * variance));
  return table;
}

}  // namespace

void FillNormals(std::uint64_t key, std::span<float> out) {
  static const Table table = MakeTable();
  constexpr std::uint64_t kMask = kQuantiles - 1;
  const auto pick = [](std::uint64_t bits) {
    return static_cast<float>(table.entries[bits & kMask] + table.entries[(bits >> 12) & kMask]) * table.scale;
  };
  std::uint64_t counter = Mix(key);
  std::size_t i = 0;
  for (; i + 1 < out.size(); i += 2) {
    const std::uint64_t bits = Mix(counter++);
    out[i] = pick(bits);
    out[i + 1] = pick(bits >> 32);
  }
  if (i < out.size()) out[i] = pick(Mix(counter));
}

int SmallPoisson(float mean, std::uint32_t uniform) {
  const double level = (static_cast<double>(uniform) + 0.5) / 4294967296.0;
  double chance = ExpOfMinus(mean);
  double sum = chance;
  int count = 0;
  while (level > sum && count < 128) {
    ++count;
    chance *= static_cast<double>(mean) / count;
    sum += chance;
  }
  return count;
}

}  // namespace lensd::sim
