// From a window's samples to its spectrum: gamma undone, clipped samples filled in, Hann window, transform. Its noise
// is read off the highest frequencies, where a lens leaves least.
#include "autofocus/defocus/spectrum.h"

#include <kissfft/kiss_fft.h>
#include <kissfft/kiss_fftr.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace lensd::autofocus::defocus {
namespace {

static_assert(sizeof(kiss_fft_cpx) == sizeof(std::complex<float>));

struct Free {
  void operator()(void* plan) const { kiss_fft_free(plan); }
};

kiss_fft_cpx* Raw(std::complex<float>* values) {
  return reinterpret_cast<kiss_fft_cpx*>(values);
}

/// Forward transform of a real picture: rows, then columns.
std::vector<std::complex<float>> Transform(const std::vector<float>& picture, int width, int height) {
  const std::unique_ptr<kiss_fftr_state, Free> rows(kiss_fftr_alloc(width, 0, nullptr, nullptr));
  const std::unique_ptr<kiss_fft_state, Free> columns(kiss_fft_alloc(height, 0, nullptr, nullptr));
  const int half = width / 2 + 1;
  std::vector<std::complex<float>> modes(static_cast<std::size_t>(half) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) kiss_fftr(rows.get(), picture.data() + y * width, Raw(modes.data() + y * half));
  std::vector<std::complex<float>> column(static_cast<std::size_t>(height));
  for (int x = 0; x < half; ++x) {
    kiss_fft_stride(columns.get(), Raw(modes.data() + x), Raw(column.data()), half);
    for (int y = 0; y < height; ++y)
      modes[static_cast<std::size_t>(y * half + x)] = column[static_cast<std::size_t>(y)];
  }
  return modes;
}

std::vector<float> Hann(int size) {
  std::vector<float> weights(static_cast<std::size_t>(size));
  for (int i = 0; i < size; ++i) {
    const double phase = 2.0 * std::numbers::pi * (i + 0.5) / size;
    weights[static_cast<std::size_t>(i)] = static_cast<float>(0.5 - 0.5 * std::cos(phase));
  }
  return weights;
}

/// The window's light, full scale is 1, gamma undone.
std::vector<float> LightOf(const drivers::Frame& frame, const Window& window) {
  const double full = std::exp2(frame.bits) - 1.0;
  std::vector<float> light;
  light.reserve(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height));
  for (int y = window.y; y < window.y + window.height; ++y) {
    const auto* row = frame.samples->data() + static_cast<std::ptrdiff_t>(y) * frame.width + window.x;
    for (int x = 0; x < window.width; ++x) light.push_back(static_cast<float>(row[x] / full));
  }
  if (frame.gamma != 1.0) {
    for (float& value : light) value = std::pow(value, static_cast<float>(frame.gamma));
  }
  return light;
}

/// Fills what is left out with the mean of what is not, in squares around it; under a window that fades it hardly
/// matters with what, as long as no edge is drawn.
void Fill(std::vector<float>& light, const Window& tile, const Window& window, const Mask& mask) {
  constexpr int kReach = 12;  // px
  const auto left_out = [&](int x, int y) {
    return mask[static_cast<std::size_t>((tile.y + y - window.y) * window.width + tile.x + x - window.x)] != 0;
  };
  const std::vector<float> seen = light;
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y * tile.width + x); };
  double all = 0.0, counted = 0.0;
  for (int y = 0; y < tile.height; ++y) {
    for (int x = 0; x < tile.width; ++x) {
      if (left_out(x, y)) continue;
      all += seen[at(x, y)];
      counted += 1.0;
    }
  }
  for (int y = 0; y < tile.height; ++y) {
    for (int x = 0; x < tile.width; ++x) {
      if (!left_out(x, y)) continue;
      double sum = counted > 0 ? all / counted : 0.0, weight = 1.0;
      for (int v = std::max(y - kReach, 0); v <= std::min(y + kReach, tile.height - 1); v += 2) {
        for (int u = std::max(x - kReach, 0); u <= std::min(x + kReach, tile.width - 1); u += 2) {
          if (left_out(u, v)) continue;
          sum += seen[at(u, v)];
          weight += 1.0;
        }
      }
      light[at(x, y)] = static_cast<float>(sum / weight);
    }
  }
}

/// Median power of the corner of frequency space, where lenses leave the least texture. For noise alone the median of
/// the exponentially distributed powers is ln 2 times their mean.
double NoisePower(const Spectrum& spectrum) {
  constexpr double kCorner = 0.40;  // cycles per px, along both axes
  std::vector<float> powers;
  for (int j = 0; j < spectrum.height; ++j) {
    const double fy = std::min(j, spectrum.height - j) / static_cast<double>(spectrum.height);
    if (fy <= kCorner) continue;
    for (int i = static_cast<int>(kCorner * spectrum.width) + 1; i < spectrum.columns(); ++i)
      powers.push_back(std::norm(spectrum.modes[static_cast<std::size_t>(j * spectrum.columns() + i)]));
  }
  const auto middle = powers.begin() + static_cast<std::ptrdiff_t>(powers.size() / 2);
  std::ranges::nth_element(powers, middle);
  return *middle / std::numbers::ln2;
}

/// The largest side the transform is fast at, at most `limit`.
int FastSide(int limit) {
  constexpr int kSides[] = {256, 240, 216, 192, 180, 160, 144, 128, 120, 108, 96, 90, 80,
                            72,  64,  60,  54,  48,  40,  36,  32,  30,  24,  20, 18, 16};
  for (const int side : kSides) {
    if (side <= limit) return side;
  }
  return limit / 2 * 2;
}

}  // namespace

void MaskClipped(const drivers::Frame& frame, const Window& window, Mask& mask) {
  constexpr int kAround = 4;  // px
  mask.resize(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height), 0);
  const auto full_scale = static_cast<std::uint16_t>(std::exp2(frame.bits) - 1.0);
  const auto full = [&](int x, int y) {
    const auto at = static_cast<std::size_t>(window.y + y) * static_cast<std::size_t>(frame.width) +
                    static_cast<std::size_t>(window.x + x);
    return (*frame.samples)[at] >= full_scale ? 1 : 0;
  };
  for (int y = 1; y + 1 < window.height; ++y) {
    for (int x = 1; x + 1 < window.width; ++x) {
      if (!full(x, y) || full(x - 1, y) + full(x + 1, y) + full(x, y - 1) + full(x, y + 1) < 3) continue;
      for (int v = std::max(y - kAround, 0); v <= std::min(y + kAround, window.height - 1); ++v) {
        const auto row = mask.begin() + static_cast<std::ptrdiff_t>(v) * window.width;
        std::fill(row + std::max(x - kAround, 0), row + std::min(x + kAround + 1, window.width), std::uint8_t{1});
      }
    }
  }
}

std::vector<Window> TilesOf(const Window& window, int most) {
  const auto along = [&](int from, int size) {
    const int count = (size + most - 1) / most;
    const int side = FastSide(std::min(size / count + (count > 1 ? 8 : 0), most));
    std::vector<std::pair<int, int>> places;
    for (int i = 0; i < count; ++i) {
      const int room = size - side;
      places.emplace_back(from + (count > 1 ? room * i / (count - 1) : room / 2), side);
    }
    return places;
  };
  std::vector<Window> tiles;
  for (const auto& [y, height] : along(window.y, window.height)) {
    for (const auto& [x, width] : along(window.x, window.width)) tiles.push_back({x, y, width, height});
  }
  return tiles;
}

Spectrum SpectrumOf(const drivers::Frame& frame, const Window& tile, const Window& window, const Mask& mask) {
  Spectrum spectrum;
  spectrum.width = tile.width;
  spectrum.height = tile.height;
  std::vector<float> light = LightOf(frame, tile);
  if (!mask.empty()) Fill(light, tile, window, mask);
  const std::vector<float> across = Hann(tile.width);
  const std::vector<float> down = Hann(tile.height);
  double weights = 0.0;
  double squares = 0.0;
  double sum = 0.0;
  for (int y = 0; y < tile.height; ++y) {
    for (int x = 0; x < tile.width; ++x) {
      const double weight = double{across[static_cast<std::size_t>(x)]} * down[static_cast<std::size_t>(y)];
      weights += weight;
      squares += weight * weight;
      sum += weight * light[static_cast<std::size_t>(y * tile.width + x)];
    }
  }
  spectrum.mean = std::max(sum / weights, 1e-6);
  const double scale = 1.0 / std::sqrt(squares);
  for (int y = 0; y < tile.height; ++y) {
    for (int x = 0; x < tile.width; ++x) {
      float& value = light[static_cast<std::size_t>(y * tile.width + x)];
      const double weight = double{across[static_cast<std::size_t>(x)]} * down[static_cast<std::size_t>(y)] * scale;
      value = static_cast<float>((value / spectrum.mean - 1.0) * weight);
    }
  }
  spectrum.modes = Transform(light, tile.width, tile.height);
  const double step = frame.gamma * std::pow(spectrum.mean, -1.0 / frame.gamma) / (std::exp2(frame.bits) - 1.0);
  spectrum.rounding = step * step / 12.0;
  spectrum.noise = std::max(NoisePower(spectrum), spectrum.rounding);
  return spectrum;
}

}  // namespace lensd::autofocus::defocus
