// Frames written down in closed form: a sum of sinusoids, each weakened by a blur disk by exactly 2 J1(x)/x.
#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "drivers/api/camera.h"

namespace lensd::autofocus::testing {

struct Wave {
  double fx = 0.0;  ///< cycles per px
  double fy = 0.0;
  double phase = 0.0;
  double amplitude = 0.0;
};

/// Waves in all directions whose power per unit of frequency area falls like frequency^-slope.
inline std::vector<Wave> NaturalWaves(unsigned seed, double slope = 2.3, int count = 500, double contrast = 0.25) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Wave> waves;
  double power = 0.0;
  for (int i = 0; i < count; ++i) {
    // Even in the logarithm of frequency, so that each wave stands for an area that grows with its square.
    const double f = 0.004 * std::pow(0.45 / 0.004, uniform(random));
    const double direction = 2.0 * std::numbers::pi * uniform(random);
    const double amplitude = std::pow(f, 1.0 - slope / 2);
    waves.push_back(
        {f * std::cos(direction), f * std::sin(direction), 2.0 * std::numbers::pi * uniform(random), amplitude});
    power += 0.5 * amplitude * amplitude;
  }
  for (Wave& wave : waves) wave.amplitude *= contrast / std::sqrt(power);
  return waves;
}

/// Their picture under a blur disk of `diameter` px, with white noise of standard deviation `noise` of full scale.
inline drivers::Frame Picture(const std::vector<Wave>& waves, double diameter, double noise, unsigned seed,
                              int side = 192, int bits = 12) {
  std::vector<double> light(static_cast<std::size_t>(side * side), 0.5);
  for (const Wave& wave : waves) {
    const double x = std::numbers::pi * std::abs(diameter) * std::hypot(wave.fx, wave.fy);
    const double left = x > 1e-6 ? 2.0 * std::cyl_bessel_j(1.0, x) / x : 1.0;
    const double amplitude = 0.5 * wave.amplitude * left;
    // cos(a + b) from products of tables by row and column.
    std::vector<double> cos_x, sin_x;
    for (int i = 0; i < side; ++i) {
      cos_x.push_back(std::cos(2.0 * std::numbers::pi * wave.fx * i));
      sin_x.push_back(std::sin(2.0 * std::numbers::pi * wave.fx * i));
    }
    for (int j = 0; j < side; ++j) {
      const double phase = 2.0 * std::numbers::pi * wave.fy * j + wave.phase;
      const double c = amplitude * std::cos(phase);
      const double s = amplitude * std::sin(phase);
      for (int i = 0; i < side; ++i) {
        const auto at = static_cast<std::size_t>(i);
        light[static_cast<std::size_t>(j * side + i)] += c * cos_x[at] - s * sin_x[at];
      }
    }
  }
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, noise > 0 ? noise : 1.0);
  const double full = std::exp2(bits) - 1.0;
  std::vector<std::uint16_t> samples;
  for (const double value : light) {
    const double noisy = value + (noise > 0 ? normal(random) : 0.0);
    samples.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(noisy, 0.0, 1.0) * full)));
  }
  drivers::Frame frame;
  frame.width = frame.height = side;
  frame.bits = bits;
  frame.samples = std::make_shared<const std::vector<std::uint16_t>>(std::move(samples));
  return frame;
}

}  // namespace lensd::autofocus::testing
