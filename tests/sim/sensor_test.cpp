// The sensor's noise has the moments and probabilities that physics asks for, and the same bits in every build.
#include "sim/camera/sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/camera/noise.h"

namespace lensd::sim {
namespace {

/// Moments of a sample with their standard errors, from the sample itself.
struct Moments {
  double mean = 0.0;
  double mean_error = 0.0;
  double variance = 0.0;
  double variance_error = 0.0;
  double third = 0.0;  ///< third central moment
  double third_error = 0.0;
};

Moments MomentsOf(const std::vector<double>& sample) {
  const auto n = static_cast<double>(sample.size());
  Moments moments;
  for (const double x : sample) moments.mean += x / n;
  double m4 = 0.0;
  double m6 = 0.0;
  for (const double x : sample) {
    const double d = x - moments.mean;
    moments.variance += d * d / n;
    moments.third += d * d * d / n;
    m4 += d * d * d * d / n;
    m6 += d * d * d * d * d * d / n;
  }
  const double v = moments.variance;
  moments.mean_error = std::sqrt(v / n);
  moments.variance_error = std::sqrt(std::max(0.0, m4 - v * v) / n);
  moments.third_error =
      std::sqrt(std::max(0.0, m6 - moments.third * moments.third - 6.0 * m4 * v + 9.0 * v * v * v) / n);
  return moments;
}

constexpr double kSigmas = 4.5;  // a false alarm in some 10^5 checks

CameraSettings DeepCamera(double full_well_e, double read_noise_e) {
  CameraSettings camera;
  camera.bits = 16;
  camera.full_well_e = full_well_e;
  camera.read_noise_e = read_noise_e;
  camera.black_level = 19660.0 / 65535.0;  // so that read noise below zero is not clipped
  return camera;
}

std::vector<double> ElectronsAt(const CameraSettings& camera, double light, std::uint64_t key) {
  const std::vector<float> flat(1000000, static_cast<float>(light));
  std::vector<double> electrons;
  for (const std::uint16_t sample : Expose(camera, flat, 1.0f, key)) {
    electrons.push_back((sample / 65535.0 - camera.black_level) * *camera.full_well_e);
  }
  return electrons;
}

TEST(Noise, NormalsHaveTheMomentsOfANormal) {
  std::vector<float> draws(4000001);
  FillNormals(99, draws);
  const Moments moments = MomentsOf({draws.begin(), draws.end()});
  EXPECT_NEAR(moments.mean, 0.0, kSigmas * moments.mean_error);
  EXPECT_NEAR(moments.variance, 1.0, kSigmas * moments.variance_error);
  EXPECT_NEAR(moments.third, 0.0, kSigmas * moments.third_error);
  double beyond_3 = 0.0;
  double neighbours = 0.0;
  for (std::size_t i = 0; i + 1 < draws.size(); ++i) {
    beyond_3 += std::abs(draws[i]) > 3.0f ? 1.0 : 0.0;
    neighbours += static_cast<double>(draws[i]) * static_cast<double>(draws[i + 1]);
  }
  const auto n = static_cast<double>(draws.size());
  const double tail = std::erfc(3.0 / std::sqrt(2.0));
  EXPECT_NEAR(beyond_3 / n, tail, 0.02 * tail + kSigmas * std::sqrt(tail / n));
  EXPECT_NEAR(neighbours / n, 0.0, kSigmas / std::sqrt(n));
}

TEST(Noise, DifferentKeysAreIndependent) {
  std::vector<float> a(1000000);
  std::vector<float> b(1000000);
  FillNormals(1, a);
  FillNormals(2, b);
  double product = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) product += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  EXPECT_NEAR(product / 1e6, 0.0, kSigmas / 1e3);
}

TEST(Noise, SmallPoissonHasItsProbabilities) {
  constexpr int kDraws = 400000;
  for (const double mean : {0.0, 0.3, 2.0, 7.5, 15.9}) {
    std::vector<double> seen(64, 0.0);
    for (int i = 0; i < kDraws; ++i) {
      const auto uniform = static_cast<std::uint32_t>(Mix(static_cast<std::uint64_t>(i) + 1000));
      seen[static_cast<std::size_t>(SmallPoisson(static_cast<float>(mean), uniform))] += 1.0;
    }
    for (int k = 0; k < 40; ++k) {
      const double chance =
          mean == 0.0 ? (k == 0 ? 1.0 : 0.0) : std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0));
      EXPECT_NEAR(seen[static_cast<std::size_t>(k)] / kDraws, chance,
                  kSigmas * std::sqrt(chance / kDraws) + 1.0 / kDraws)
          << "mean " << mean << ", " << k << " electrons";
    }
  }
}

TEST(Sensor, PhotonAndReadNoiseHaveTheirMeanVarianceAndSkewness) {
  std::uint64_t key = 5;
  for (const double read_noise_e : {0.0, 3.0}) {
    for (const double electrons : {0.0, 4.0, 15.0, 17.0, 60.0, 1000.0, 7000.0}) {
      const double full_well_e = 100.0 + 2.0 * electrons;
      const double rounding = full_well_e / 65535.0;
      const CameraSettings camera = DeepCamera(full_well_e, read_noise_e);
      const Moments moments = MomentsOf(ElectronsAt(camera, electrons / full_well_e, ++key));
      const double variance = electrons + read_noise_e * read_noise_e;
      const double spread = std::sqrt(variance);
      EXPECT_NEAR(moments.mean, electrons, kSigmas * moments.mean_error + 0.5 * rounding) << electrons;
      EXPECT_NEAR(moments.variance, variance, kSigmas * moments.variance_error + rounding * (spread + rounding))
          << electrons << " electrons, read noise " << read_noise_e;
      EXPECT_NEAR(moments.third, electrons,
                  kSigmas * moments.third_error + 0.01 * electrons + 3.0 * rounding * (variance + rounding))
          << electrons << " electrons, read noise " << read_noise_e;
    }
  }
}

CameraSettings CleanCamera(int bits) {
  CameraSettings camera;
  camera.bits = bits;
  return camera;
}

TEST(Sensor, RoundsToTheNearestLevelAtEveryDepth) {
  std::vector<float> ramp;
  for (int i = 0; i <= 5000; ++i) ramp.push_back(static_cast<float>(i / 5000.0));
  for (const int bits : {8, 10, 12, 16}) {
    const auto samples = Expose(CleanCamera(bits), ramp, 1.0f, 0);
    const double top = std::ldexp(1.0, bits) - 1.0;
    for (std::size_t i = 0; i < ramp.size(); ++i) {
      // Ties aside, the nearest level; floats leave 2^-7 of a level at 16 bits.
      EXPECT_LE(std::abs(samples[i] - static_cast<double>(ramp[i]) * top), 0.51) << bits << " bits, light " << ramp[i];
    }
    EXPECT_EQ(samples.front(), 0);
    EXPECT_EQ(samples.back(), top);
  }
}

TEST(Sensor, ClipsAtTheFullWell) {
  const std::vector<float> light = {0.999f, 1.0f, 1.5f, 40.0f};
  const auto clean = Expose(CleanCamera(8), light, 1.0f, 0);
  EXPECT_EQ(clean, (std::vector<std::uint16_t>{255, 255, 255, 255}));
  CameraSettings noisy = CleanCamera(12);
  noisy.full_well_e = 10000.0;
  noisy.read_noise_e = 3.0;
  const auto samples = Expose(noisy, std::vector<float>(10000, 1.2f), 1.0f, 0);
  for (const auto sample : samples) ASSERT_EQ(sample, 4095);
}

TEST(Sensor, AddsTheBlackLevelAndScalesByGain) {
  CameraSettings camera = CleanCamera(8);
  camera.black_level = 0.1;
  EXPECT_EQ(Expose(camera, std::vector<float>{0.0f, 0.4f}, 0.5f, 0), (std::vector<std::uint16_t>{26, 77}));
}

TEST(Sensor, AppliesGamma) {
  CameraSettings camera = CleanCamera(8);
  camera.gamma = 2.2;
  std::vector<float> ramp;
  for (int i = 0; i <= 100; ++i) ramp.push_back(static_cast<float>(i) / 100.0f);
  const auto samples = Expose(camera, ramp, 1.0f, 0);
  for (std::size_t i = 0; i < ramp.size(); ++i) {
    EXPECT_NEAR(samples[i], 255.0 * std::pow(static_cast<double>(ramp[i]), 1.0 / 2.2), 0.501);
  }
}

/// FNV-1a, over the samples of a noisy ramp: the same in every build.
TEST(Sensor, GivesTheSameBitsInEveryBuild) {
  CameraSettings camera = CleanCamera(12);
  camera.full_well_e = 4000.0;
  camera.read_noise_e = 2.5;
  std::vector<float> ramp;
  for (int i = 0; i < 100003; ++i) ramp.push_back(static_cast<float>(i) / 100003.0f);
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const std::uint16_t sample : Expose(camera, ramp, 0.97f, 12345)) {
    for (const int byte : {sample & 255, sample >> 8})
      hash = (hash ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3u;
  }
  EXPECT_EQ(hash, 6493067648643249708u);
}

}  // namespace
}  // namespace lensd::sim
