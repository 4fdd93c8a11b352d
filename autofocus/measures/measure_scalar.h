// The sums behind the focus measures, one sample at a time: what the vector kernels must equal, and what they leave at
// the right edge is summed with.
#pragma once

#include <algorithm>
#include <cstdlib>

#include "autofocus/measures.h"

namespace lensd::autofocus::scalar {

/// The 3 x 3 neighbourhood of a sample.
template <class Sample>
struct Patch {
  const Sample* above;
  const Sample* here;
  const Sample* below;

  std::int64_t SobelX() const {
    return (std::int64_t{above[1]} - above[-1]) + 2 * (std::int64_t{here[1]} - here[-1]) + below[1] - below[-1];
  }
  std::int64_t SobelY() const {
    return (std::int64_t{below[-1]} - above[-1]) + 2 * (std::int64_t{below[0]} - above[0]) + below[1] - above[1];
  }
  std::int64_t Laplacian() const {
    return std::int64_t{above[0]} + below[0] + here[-1] + here[1] - 4 * std::int64_t{here[0]};
  }
  std::int64_t SecondDifference() const {
    return (std::int64_t{above[-1]} - 2 * above[0] + above[1]) - 2 * (std::int64_t{here[-1]} - 2 * here[0] + here[1]) +
           (std::int64_t{below[-1]} - 2 * below[0] + below[1]);
  }
};

template <class Sample, class Visit>
void ForInner(GreyView<Sample> view, Visit visit) {
  for (int y = 1; y + 1 < view.height; ++y) {
    const Sample* row = view.samples + y * view.stride;
    for (int x = 1; x + 1 < view.width; ++x)
      visit(Patch<Sample>{row + x - view.stride, row + x, row + x + view.stride});
  }
}

inline std::uint64_t Square(std::int64_t value) {
  return static_cast<std::uint64_t>(value * value);
}

inline std::uint64_t BrennerOf(GreyView<std::uint8_t> view) {
  std::uint64_t sum = 0;
  for (int y = 0; y < view.height; ++y) {
    const std::uint8_t* row = view.samples + y * view.stride;
    for (int x = 0; x + 2 < view.width; ++x) sum += Square(std::int64_t{row[x + 2]} - row[x]);
  }
  return sum;
}

inline LaplacianSums LaplacianOf(GreyView<std::uint8_t> view) {
  LaplacianSums sums;
  ForInner(view, [&](Patch<std::uint8_t> at) {
    const std::int64_t value = at.Laplacian();
    sums.value += value;
    sums.square += Square(value);
  });
  return sums;
}

enum class Noise { LeftOut, Summed };

/// FocusSums::gradient, and ::noise if asked.
template <class Sample>
FocusSums SlopesOf(GreyView<Sample> view, Noise noise) {
  FocusSums sums;
  ForInner(view, [&](Patch<Sample> at) {
    sums.gradient += Square(at.SobelX()) + Square(at.SobelY());
    if (noise == Noise::Summed) sums.noise += static_cast<std::uint64_t>(std::abs(at.SecondDifference()));
  });
  return sums;
}

/// Adds FocusSums::saturated and ::light of a row's samples.
template <class Sample>
void AddLevels(const Sample* row, int width, Sample full_scale, FocusSums& sums) {
  for (int x = 0; x < width; ++x) {
    sums.saturated += row[x] >= full_scale;
    sums.light += row[x];
  }
}

/// FocusSums of a view, band by band: `slopes(band, noise)` while its rows are in the cache, then `levels(row, sums)`
/// for each of them. Beyond some tens of thousands of pixels the noise is known to a percent from every fourth band.
template <class Sample, class Slopes, class Levels>
FocusSums ByBands(GreyView<Sample> view, const Slopes& slopes, const Levels& levels) {
  constexpr int kRows = 16;
  constexpr long kEnoughNoise = 1L << 16;
  const int every = static_cast<long>(view.width) * view.height > kEnoughNoise ? 4 : 1;
  FocusSums sums;
  for (int top = 0, band = 0; top < view.height; top += kRows, ++band) {
    const int first = top == 0 ? 0 : top - 1;
    const int last = std::min(top + kRows + 1, view.height);
    if (last - first >= 3) {
      const Noise noise = band % every == 0 ? Noise::Summed : Noise::LeftOut;
      const GreyView<Sample> part{view.samples + first * view.stride, view.width, last - first, view.stride};
      const FocusSums more = slopes(part, noise);
      sums.gradient += more.gradient;
      sums.noise += more.noise;
      if (noise == Noise::Summed)
        sums.noise_pixels += static_cast<std::uint64_t>(part.width - 2) * static_cast<std::uint64_t>(part.height - 2);
    }
    for (int y = top; y < std::min(top + kRows, view.height); ++y) levels(view.samples + y * view.stride, sums);
  }
  return sums;
}

}  // namespace lensd::autofocus::scalar
