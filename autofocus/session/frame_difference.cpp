// The rules are those of the header; none needs the level of the noise.
#include "autofocus/session/frame_difference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace lensd::autofocus {
namespace {

constexpr std::size_t kEnoughPixels = 256, kManyPixels = 65536;
constexpr double kWhite = 0.05;       ///< correlation of neighbours below which a difference is noise ...
constexpr double kWhiteSigmas = 3.0;  ///< ... or within so many standard deviations of none
constexpr double kTexture = 1.15;     ///< slopes hold so many times the energy that noise alone would give
constexpr int kCell = 4;              ///< px: noise is averaged over so many each way
constexpr int kParts = 4;             ///< of the window each way, which are to agree on which frame is sharper
constexpr double kChangeSigmas = 5.0, kLeastExcess = 0.25;

using Row = std::span<const std::uint16_t>;

double MeanOf(const drivers::Frame& frame, const Window& window) {
  double sum = 0.0;
  for (int y = 0; y < window.height; ++y) {
    for (const std::uint16_t sample : RowOf(frame, window, y)) sum += sample;
  }
  return sum / (static_cast<double>(window.width) * window.height);
}

/// The difference of two frames, and of the power of their slopes, over a window, or over bands of its rows.
struct Differences {
  Differences(const drivers::Frame& one, const drivers::Frame& other, const Window& window) : width(window.width) {
    const double mean = MeanOf(one, window), other_mean = MeanOf(other, window);
    const double gain = mean > 0.0 && other_mean > 0.0 ? std::clamp(mean / other_mean, 0.5, 2.0) : 1.0;
    const auto pixels = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
    const int every = static_cast<int>(1 + pixels / kManyPixels);
    for (int y = 0; y < window.height; ++y) {
      if (y / kCell % every == 0) AddRow(RowOf(one, window, y), RowOf(other, window, y), gain);
    }
  }
  void AddRow(Row a, Row b, double gain) {
    for (std::size_t x = 0; x < a.size(); ++x) {
      const double slope = x < 2 ? 0.0 : static_cast<double>(a[x]) - a[x - 2];
      const double other_slope = x < 2 ? 0.0 : gain * (static_cast<double>(b[x]) - b[x - 2]);
      sharper.push_back(slope * slope - other_slope * other_slope);
      value.push_back(a[x] - gain * b[x]);
    }
    ++height;
  }
  double At(const std::vector<double>& of, int x, int y) const {
    return of[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  double SumOf(const std::vector<double>& of, const Window& part) const {
    double sum = 0.0;
    for (int y = part.y; y < part.y + part.height; ++y) {
      for (int x = part.x; x < part.x + part.width; ++x) sum += At(of, x, y);
    }
    return sum;
  }
  int width, height = 0;
  std::vector<double> value, sharper;
};

/// Means over cells scatter more than those of noise would, whose neighbours know nothing of each other.
bool IsSmooth(const Differences& all, double variance) {
  double square = 0.0, sum = 0.0;
  int count = 0;
  for (int y = 0; y + kCell <= all.height; y += kCell) {
    for (int x = 0; x + kCell <= all.width; x += kCell) {
      const double mean = all.SumOf(all.value, {x, y, kCell, kCell}) / (kCell * kCell);
      sum += mean;
      square += mean * mean;
      ++count;
    }
  }
  const double of_means = square / count - sum / count * sum / count;
  const double excess = of_means * kCell * kCell / variance - 1.0;
  return excess > kLeastExcess + kChangeSigmas * std::sqrt(2.0 / count);
}

/// The parts of the window agree on it.
bool IsSharper(const Differences& all) {
  double sum = 0.0, square = 0.0;
  for (int i = 0; i < kParts * kParts; ++i) {
    const int width = all.width / kParts, height = all.height / kParts;
    const double part = all.SumOf(all.sharper, {i % kParts * width, i / kParts * height, width, height});
    sum += part;
    square += part * part;
  }
  const double n = kParts * kParts, mean = sum / n;
  const double scatter = std::sqrt(std::max(square / n - mean * mean, 0.0) / (n - 1.0));
  return std::abs(mean) > kChangeSigmas * scatter;
}

}  // namespace

std::span<const std::uint16_t> RowOf(const drivers::Frame& frame, const Window& window, int y) {
  const auto from = static_cast<std::size_t>(window.y + y) * static_cast<std::size_t>(frame.width) +
                    static_cast<std::size_t>(window.x);
  return Row(*frame.samples).subspan(from, static_cast<std::size_t>(window.width));
}

Difference DifferenceOf(const drivers::Frame& one, const drivers::Frame& other, const Window& window) {
  const auto pixels = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
  const int every = static_cast<int>(std::max<std::size_t>(1, pixels / kManyPixels));
  double sum = 0.0, square = 0.0, next = 0.0, after_next = 0.0, slopes = 0.0, sharper = 0.0;
  std::size_t count = 0;
  std::vector<double> difference(static_cast<std::size_t>(window.width));
  for (int y = 0; y < window.height; y += every) {
    const Row a = RowOf(one, window, y), b = RowOf(other, window, y);
    for (std::size_t x = 0; x < a.size(); ++x) difference[x] = static_cast<double>(a[x]) - b[x];
    for (std::size_t x = 0; x + 2 < a.size(); ++x) {
      sum += difference[x];
      square += difference[x] * difference[x];
      next += difference[x] * difference[x + 1];
      after_next += difference[x] * difference[x + 2];
      const double slope = static_cast<double>(a[x + 2]) - a[x], other_slope = static_cast<double>(b[x + 2]) - b[x];
      slopes += slope * slope;
      sharper += slope * slope - other_slope * other_slope;
      ++count;
    }
  }
  if (count < kEnoughPixels) return {};
  const auto n = static_cast<double>(count);
  const double offset = sum / n * sum / n, variance = square / n - offset;  // of a difference: twice that of a frame
  if (!(variance > 0.0)) return {.is_noise = true, .texture_shows = false};
  const double white = std::max(kWhite, kWhiteSigmas / std::sqrt(n));
  const bool is_noise =
      std::abs(next / n - offset) < white * variance && std::abs(after_next / n - offset) < white * variance;
  // Slopes two pixels apart share a pixel's noise with the next ones: half as much again as if they did not.
  const double texture = std::max(slopes / n - variance, 0.0);
  const double scatter = std::sqrt(1.5 * n * (8.0 * variance * texture + 4.0 * variance * variance));
  return {is_noise && std::abs(sharper) < kWhiteSigmas * scatter, slopes / n > kTexture * variance};
}

Change ChangeBetween(const drivers::Frame& one, const drivers::Frame& other, const Window& window) {
  const Differences all(one, other, window);
  const auto n = static_cast<double>(all.value.size());
  double sum = 0.0, square = 0.0;
  for (const double value : all.value) {
    sum += value;
    square += value * value;
  }
  const double variance = square / n - sum / n * sum / n;
  if (!(variance > 0.0)) return {};
  const bool sharper = IsSharper(all);
  return {sharper || IsSmooth(all, variance), sharper, variance};
}

}  // namespace lensd::autofocus
