// The power of a picture over frequency, taken as that of a sharp one, tells its sharpness under any blur: a few
// frequencies leave the side lobes of the disk's response to be seen, many level them out.
#include "autofocus/defocus/repeats.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "autofocus/defocus/disk_response.h"

namespace lensd::autofocus::defocus {
namespace {

constexpr double kFirstBin = 3.5;     // below, the window's own shape shows, and shading
constexpr double kHighest = 0.45;     // cycles per px
constexpr double kBandsPerBin = 2.0;  // frequencies that are taken as one
constexpr double kVisible = 3.0;      // standard deviations over the noise
constexpr double kMostBlur = 0.6;     // of the side: farther, what is between the bands would show

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

}  // namespace

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
