// The power of a picture over frequency, taken as that of a sharp one, tells its sharpness under any blur: a few
// frequencies leave the side lobes of the disk's response to be seen, many level them out.
#include "autofocus/defocus/repeats.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "autofocus/defocus/disk_response.h"

namespace lensd::autofocus::defocus {
namespace {

constexpr double kFirstBin = 3.5;     // below, the window's own shape shows, and shading
constexpr double kHighest = 0.45;     // cycles per px
constexpr double kBandsPerBin = 2.0;  // frequencies that are taken as one
constexpr double kVisible = 3.0;      // standard deviations over the noise
constexpr double kMostBlur = 0.6;     // of the side: farther, what is between the bands would show
constexpr double kLineBins = 1.6;     // a grating reaches so far in a window's spectrum

struct Band {
  double power = 0.0;
  double noise = 0.0;
  double square = 0.0;  ///< variance of that
};

/// Gradient energy by frequency, as far as it stands out of the noise.
std::vector<double> EnergyByFrequency(const Tiles& tiles, double side) {
  std::vector<Band> bands(static_cast<std::size_t>(kHighest * side * kBandsPerBin) + 1);
  for (const Spectrum& tile : tiles) {
    for (int j = 0; j < tile.height; ++j) {
      const double fy = (j <= tile.height / 2 ? j : j - tile.height) / static_cast<double>(tile.height);
      for (int i = 0; i < tile.columns(); ++i) {
        const double f = std::hypot(static_cast<double>(i) / tile.width, fy);
        if (f > kHighest || f * side < kFirstBin || (i == 0 && fy < 0)) continue;
        Band& band = bands[static_cast<std::size_t>(f * side * kBandsPerBin)];
        band.power += std::norm(tile.modes[static_cast<std::size_t>(j * tile.columns() + i)]);
        band.noise += tile.noise;
        band.square += tile.noise * tile.noise;
      }
    }
  }
  std::vector<double> energy;
  for (std::size_t i = 0; i < bands.size(); ++i) {
    const double f = (static_cast<double>(i) + 0.5) / (kBandsPerBin * side);
    const double more = bands[i].power - bands[i].noise;
    energy.push_back(more > kVisible * std::sqrt(bands[i].square) ? f * f * more : 0.0);
  }
  return energy;
}

/// Gradient energy of one mode.
struct Mode {
  double across = 0.0;  ///< bins
  double down = 0.0;    ///< bins
  double energy = 0.0;
};

/// Of half of the plane, without the mean.
std::vector<Mode> ModesOf(const Spectrum& picture) {
  std::vector<Mode> modes;
  for (int j = 0; j < picture.height; ++j) {
    const int down = j <= picture.height / 2 ? j : j - picture.height;
    for (int i = 0; i < picture.columns(); ++i) {
      if (i == 0 && down <= 0) continue;
      const double f = std::hypot(static_cast<double>(i) / picture.width, static_cast<double>(down) / picture.height);
      if (f > kHighest) continue;
      const double power = std::norm(picture.modes[static_cast<std::size_t>(j * picture.columns() + i)]);
      modes.push_back(
          {static_cast<double>(i), static_cast<double>(down), f * f * std::max(power - picture.noise, 0.0)});
    }
  }
  return modes;
}

/// Takes the strongest mode and those about it out of `modes`; their energy.
double TakeStrongest(std::vector<Mode>& modes) {
  const Mode top = *std::ranges::max_element(modes, {}, &Mode::energy);
  double energy = 0.0;
  for (Mode& mode : modes) {
    const double there = std::hypot(mode.across - top.across, mode.down - top.down);
    const double mirrored = std::hypot(mode.across + top.across, mode.down + top.down);
    if (std::min(there, mirrored) <= kLineBins) energy += std::exchange(mode.energy, 0.0);
  }
  return energy;
}

}  // namespace

double ShareOfTwoGratings(const Spectrum& picture) {
  std::vector<Mode> modes = ModesOf(picture);
  double all = 0.0;
  for (const Mode& mode : modes) all += mode.energy;
  if (!(all > 0.0)) return 0.0;
  const double first = TakeStrongest(modes);
  return (first + TakeStrongest(modes)) / all;
}

std::vector<double> SharpnessUnderBlur(const Tiles& tiles, double most_px) {
  const double side = std::min(tiles.front().width, tiles.front().height);
  const auto energy = EnergyByFrequency(tiles, side);
  std::vector<double> sharpness;
  for (double blur = 0.0; blur <= std::min(most_px, kMostBlur * side); blur += kBlurStep) {
    double sum = 0.0;
    for (std::size_t i = 0; i < energy.size(); ++i) {
      const double left = DiskResponse(blur * (static_cast<double>(i) + 0.5) / (kBandsPerBin * side));
      sum += energy[i] * left * left;
    }
    sharpness.push_back(sum);
  }
  const double sharp = sharpness.front();
  if (!(sharp > 0)) return {};
  for (double& value : sharpness) value /= sharp;
  return sharpness;
}

double RiseWithBlur(const Tiles& tiles, double most_px) {
  constexpr double kUnseen = 0.002;  // of the sharpness in focus: less rises and falls unseen
  double least = 1.0, rise = 1.0;
  for (const double sharpness : SharpnessUnderBlur(tiles, most_px)) {
    const double now = sharpness + kUnseen;
    least = std::min(least, now);
    rise = std::max(rise, now / least);
  }
  return rise;
}

}  // namespace lensd::autofocus::defocus
