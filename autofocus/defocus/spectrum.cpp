#include "defocus/spectrum.h"

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

/// A lone px at full scale is noise on a bright picture; one among others is a light too bright for the sensor.
double SaturatedFraction(const std::vector<float>& light, int width, int height) {
  const auto full = [&](int x, int y) { return light[static_cast<std::size_t>(y * width + x)] >= 1.0f ? 1 : 0; };
  int count = 0;
  for (int y = 1; y + 1 < height; ++y) {
    for (int x = 1; x + 1 < width; ++x) {
      if (full(x, y) && full(x - 1, y) + full(x + 1, y) + full(x, y - 1) + full(x, y + 1) >= 3) ++count;
    }
  }
  return count / (static_cast<double>(width) * height);
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
  constexpr int kSides[] = {256, 240, 216, 192, 180, 160, 144, 128, 120, 108, 96, 90, 80, 72, 64, 60, 54, 48, 40, 36};
  for (const int side : kSides) {
    if (side <= limit) return side;
  }
  return limit / 2 * 2;
}

}  // namespace

Window AnalysisWindow(const Window& asked, int frame_width, int frame_height, int least, int most) {
  const auto place = [&](int from, int size, int frame) {
    const int side = FastSide(std::min(std::clamp(size, least, most), frame));
    return std::pair(std::clamp(from + (size - side) / 2, 0, frame - side), side);
  };
  Window window;
  std::tie(window.x, window.width) = place(asked.x, asked.width, frame_width);
  std::tie(window.y, window.height) = place(asked.y, asked.height, frame_height);
  return window;
}

Spectrum SpectrumOf(const drivers::Frame& frame, const Window& window) {
  Spectrum spectrum;
  spectrum.width = window.width;
  spectrum.height = window.height;
  std::vector<float> light = LightOf(frame, window);
  spectrum.saturated = SaturatedFraction(light, window.width, window.height);
  const std::vector<float> across = Hann(window.width);
  const std::vector<float> down = Hann(window.height);
  double weights = 0.0;
  double squares = 0.0;
  double sum = 0.0;
  for (int y = 0; y < window.height; ++y) {
    for (int x = 0; x < window.width; ++x) {
      const double weight = double{across[static_cast<std::size_t>(x)]} * down[static_cast<std::size_t>(y)];
      weights += weight;
      squares += weight * weight;
      sum += weight * light[static_cast<std::size_t>(y * window.width + x)];
    }
  }
  spectrum.mean = std::max(sum / weights, 1e-6);
  const double scale = 1.0 / std::sqrt(squares);
  for (int y = 0; y < window.height; ++y) {
    for (int x = 0; x < window.width; ++x) {
      float& value = light[static_cast<std::size_t>(y * window.width + x)];
      const double weight = double{across[static_cast<std::size_t>(x)]} * down[static_cast<std::size_t>(y)] * scale;
      value = static_cast<float>((value / spectrum.mean - 1.0) * weight);
    }
  }
  spectrum.modes = Transform(light, window.width, window.height);
  spectrum.noise = std::max(NoisePower(spectrum), 1e-12);
  return spectrum;
}

}  // namespace lensd::autofocus::defocus
