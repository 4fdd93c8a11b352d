// The published amplitudes and times. Parts add up to 1, the first at time 0.
#include "rig/motion/shaping.h"

#include <cmath>
#include <numbers>

namespace lensd::rig {
namespace {

constexpr int kRampParts = 16;

Duration Seconds(double seconds) {
  return std::chrono::round<Duration>(std::chrono::duration<double>(seconds));
}

std::vector<Impulse> EvenParts(Duration whole, int parts) {
  std::vector<Impulse> even;
  for (int i = 0; i < parts; ++i) even.push_back({i * whole / parts, 1.0 / parts});
  return even;
}

}  // namespace

std::vector<Impulse> ImpulsesOf(Shaper shaper, double ring_hz, double damping) {
  if (shaper == Shaper::None) return {};
  const double period_s = 1.0 / ring_hz;
  const double k = std::exp(-damping * std::numbers::pi / std::sqrt(1.0 - damping * damping));
  const double sum = 1.0 + k;
  switch (shaper) {
    case Shaper::Split:
      return {{Duration{}, 0.5}, {Seconds(0.5 * period_s), 0.5}};
    case Shaper::Zv:
      return {{Duration{}, 1.0 / sum}, {Seconds(0.5 * period_s), k / sum}};
    case Shaper::Zvd:
      return {{Duration{}, 1.0 / (sum * sum)},
              {Seconds(0.5 * period_s), 2.0 * k / (sum * sum)},
              {Seconds(period_s), k * k / (sum * sum)}};
    default:
      break;
  }
  return EvenParts(Seconds(period_s), kRampParts);
}

std::vector<Impulse> PacedParts(Duration whole, Duration each) {
  const auto parts = static_cast<int>((whole + each - Duration(1)) / each);
  return parts > 1 ? EvenParts(whole, parts) : std::vector<Impulse>{};
}

}  // namespace lensd::rig
