// Tone and sharpening on floats; JPEG as the loss that its quantisation is, without the entropy coding that loses
// nothing.
#include "sim/camera/finish.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lensd::sim {
namespace {

constexpr int kBlock = 8;
using Block = std::array<double, kBlock * kBlock>;

/// ITU-T T.81, table K.1.
constexpr std::array<int, kBlock * kBlock> kLuminance = {
    16, 11, 10, 16, 24,  40,  51,  61,  12, 12, 14, 19, 26,  58,  60,  55,  //
    14, 13, 16, 24, 40,  57,  69,  56,  14, 17, 22, 29, 51,  87,  80,  62,  //
    18, 22, 37, 56, 68,  109, 103, 77,  24, 35, 55, 64, 81,  104, 113, 92,  //
    49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99};

int StepOf(int base, int quality) {
  const int scale = quality < 50 ? 5000 / quality : 200 - 2 * quality;
  return std::clamp((base * scale + 50) / 100, 1, 255);
}

/// Of the transform along one side: row k is the wave of k half periods a block.
std::array<std::array<double, kBlock>, kBlock> Waves() {
  std::array<std::array<double, kBlock>, kBlock> waves{};
  for (int k = 0; k < kBlock; ++k) {
    for (int i = 0; i < kBlock; ++i) {
      waves[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)] =
          (k == 0 ? std::sqrt(0.125) : 0.5) * std::cos((2 * i + 1) * k * std::numbers::pi / (2 * kBlock));
    }
  }
  return waves;
}

enum class Way { There, Back };

/// Both sides of a block, one after the other.
void Transform(Block& block, Way way) {
  static const auto kWaves = Waves();
  for (int side = 0; side < 2; ++side) {
    Block turned{};
    for (std::size_t line = 0; line < kBlock; ++line) {
      for (std::size_t k = 0; k < kBlock; ++k) {
        double sum = 0.0;
        for (std::size_t i = 0; i < kBlock; ++i) {
          sum += block[line * kBlock + i] * (way == Way::There ? kWaves[k][i] : kWaves[i][k]);
        }
        turned[k * kBlock + line] = sum;
      }
    }
    block = turned;
  }
}

void Quantise(Block& block, int quality) {
  Transform(block, Way::There);
  for (std::size_t i = 0; i < block.size(); ++i) {
    const double step = StepOf(kLuminance[i], quality);
    block[i] = std::round(block[i] / step) * step;
  }
  Transform(block, Way::Back);
}

/// One row or column's value and its neighbours', 1 2 1 over 4; beyond the border the border goes on.
std::vector<float> BinomialMean(const CameraSettings& camera, const std::vector<float>& values) {
  const int width = camera.width, height = camera.height;
  std::vector<float> along(values.size()), mean(values.size());
  for (int y = 0; y < height; ++y) {
    const float* row = values.data() + static_cast<std::ptrdiff_t>(y) * width;
    float* to = along.data() + static_cast<std::ptrdiff_t>(y) * width;
    for (int x = 0; x < width; ++x) {
      to[x] = 0.25f * (row[std::max(x - 1, 0)] + 2.0f * row[x] + row[std::min(x + 1, width - 1)]);
    }
  }
  for (int y = 0; y < height; ++y) {
    const auto row = [&](int at) {
      return along.data() + static_cast<std::ptrdiff_t>(std::clamp(at, 0, height - 1)) * width;
    };
    float* to = mean.data() + static_cast<std::ptrdiff_t>(y) * width;
    for (int x = 0; x < width; ++x) to[x] = 0.25f * (row(y - 1)[x] + 2.0f * row(y)[x] + row(y + 1)[x]);
  }
  return mean;
}

}  // namespace

std::vector<std::uint16_t> ThroughJpeg(int width, int height, const std::vector<std::uint16_t>& samples, int quality) {
  std::vector<std::uint16_t> kept(samples.size());
  const auto at = [&](int x, int y) {
    return static_cast<std::size_t>(std::min(y, height - 1)) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(std::min(x, width - 1));
  };
  for (int top = 0; top < height; top += kBlock) {
    for (int left = 0; left < width; left += kBlock) {
      Block block{};
      for (int i = 0; i < kBlock * kBlock; ++i) {
        block[static_cast<std::size_t>(i)] = samples[at(left + i % kBlock, top + i / kBlock)] - 128.0;
      }
      Quantise(block, quality);
      for (int i = 0; i < kBlock * kBlock; ++i) {
        if (left + i % kBlock >= width || top + i / kBlock >= height) continue;
        const double value = std::clamp(std::round(block[static_cast<std::size_t>(i)] + 128.0), 0.0, 255.0);
        kept[at(left + i % kBlock, top + i / kBlock)] = static_cast<std::uint16_t>(value);
      }
    }
  }
  return kept;
}

std::vector<std::uint16_t> Finished(const CameraSettings& camera, const std::vector<std::uint16_t>& deep) {
  const Finish& finish = camera.finish;
  std::vector<float> values;
  values.reserve(deep.size());
  const auto tone = static_cast<float>(finish.tone);
  for (const std::uint16_t sample : deep) {
    const float x = static_cast<float>(sample) / 65535.0f;
    values.push_back(x + tone * (x * x * (3.0f - 2.0f * x) - x));
  }
  if (finish.sharpening > 0.0) {
    const std::vector<float> mean = BinomialMean(camera, values);
    const auto amount = static_cast<float>(finish.sharpening);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] += amount * (values[i] - mean[i]);
  }
  const auto top = static_cast<float>((1 << camera.bits) - 1);
  std::vector<std::uint16_t> samples;
  samples.reserve(values.size());
  for (const float value : values) {
    // NOLINTNEXTLINE(bugprone-incorrect-roundings): never negative, and lround() calls a function for each.
    samples.push_back(static_cast<std::uint16_t>(std::clamp(value, 0.0f, 1.0f) * top + 0.5f));
  }
  if (finish.jpeg_quality == 0) return samples;
  return ThroughJpeg(camera.width, camera.height, samples, finish.jpeg_quality);
}

}  // namespace lensd::sim
