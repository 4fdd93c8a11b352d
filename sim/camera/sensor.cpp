// Light to samples: photon and read noise from one draw a sample, full well, black level, gamma, bits.
#include "sim/camera/sensor.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/camera/noise.h"

namespace lensd::sim {
namespace {

// Worked on in blocks that stay in the first-level cache.
constexpr std::size_t kBlock = 1024;
using Block = std::array<float, kBlock>;

constexpr float kFewElectrons = 16.0f;

/// One continuous draw from one normal; see sensor.h.
float Drawn(float mean, float read_variance, float z) {
  const float variance = std::max(mean + read_variance, 1e-6f);
  const float skew = mean / variance * (1.0f / 6.0f);
  return mean + std::sqrt(std::max(variance - 2.0f * skew * skew, 0.0f)) * z + skew * (z * z - 1.0f);
}

/// Turns mean electrons into drawn electrons.
void AddNoise(std::span<float> electrons, float read_noise_e, std::uint64_t key) {
  Block normals;
  FillNormals(key, {normals.data(), electrons.size()});
  Block drawn;
  const float read_variance = read_noise_e * read_noise_e;
  int few = 0;
  for (std::size_t i = 0; i < electrons.size(); ++i) {
    few |= electrons[i] < kFewElectrons ? 1 : 0;
    drawn[i] = Drawn(electrons[i], read_variance, normals[i]);
  }
  for (std::size_t i = 0; few != 0 && i < electrons.size(); ++i) {
    if (electrons[i] >= kFewElectrons) continue;
    const auto uniform = static_cast<std::uint32_t>(Mix(~key + i));
    drawn[i] = static_cast<float>(SmallPoisson(electrons[i], uniform)) + read_noise_e * normals[i];
  }
  std::copy_n(drawn.begin(), electrons.size(), electrons.begin());
}

void ApplyGamma(std::span<float> signal, double gamma) {
  const auto exponent = static_cast<float>(1.0 / gamma);
  for (float& value : signal) value = std::pow(std::max(value, 0.0f), exponent);
}

}  // namespace

std::vector<std::uint16_t> Expose(const CameraSettings& camera, std::span<const float> light, float gain,
                                  std::uint64_t key, float amplification) {
  std::vector<std::uint16_t> samples(light.size());
  const auto top = static_cast<float>((1 << camera.bits) - 1);
  const auto black = static_cast<float>(camera.black_level);
  const auto well = static_cast<float>(camera.full_well_e.value_or(1.0));
  for (std::size_t begin = 0; begin < light.size(); begin += kBlock) {
    const std::size_t count = std::min(kBlock, light.size() - begin);
    Block buffer;
    const std::span<float> signal(buffer.data(), count);
    for (std::size_t i = 0; i < count; ++i) signal[i] = light[begin + i] * gain * well;
    if (camera.full_well_e) AddNoise(signal, static_cast<float>(camera.read_noise_e), key + begin);
    for (float& value : signal) value = std::min(value, well) / well * amplification + black;
    if (camera.gamma != 1.0) ApplyGamma(signal, camera.gamma);
    for (std::size_t i = 0; i < count; ++i) {
      const float level = std::clamp(signal[i], 0.0f, 1.0f) * top + 0.5f;
      samples[begin + i] = static_cast<std::uint16_t>(static_cast<std::int32_t>(level));
    }
  }
  return samples;
}

std::vector<std::uint16_t> LuminanceOf(const CameraSettings& camera,
                                       const std::array<std::vector<std::uint16_t>, 3>& channels) {
  const auto top = static_cast<float>((1 << camera.bits) - 1);
  std::vector<float> light;  // of each sample
  for (float sample = 0.0f; sample <= top; ++sample) light.push_back(sample / top);
  if (camera.gamma != 1.0) ApplyGamma(light, 1.0 / camera.gamma);
  std::vector<float> luminance;
  luminance.reserve(channels.front().size());
  for (std::size_t i = 0; i < channels.front().size(); ++i) {
    luminance.push_back(0.2126f * light[channels[0][i]] + 0.7152f * light[channels[1][i]] +
                        0.0722f * light[channels[2][i]]);
  }
  if (camera.gamma != 1.0) ApplyGamma(luminance, camera.gamma);
  std::vector<std::uint16_t> samples;
  samples.reserve(luminance.size());
  // NOLINTNEXTLINE(bugprone-incorrect-roundings): never negative, and lround() calls a function for each.
  for (const float value : luminance) samples.push_back(static_cast<std::uint16_t>(std::min(value, 1.0f) * top + 0.5f));
  return samples;
}

}  // namespace lensd::sim
