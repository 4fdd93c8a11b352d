// Weights by least squares over the band; the closest parabola from the wave's first three Legendre coefficients, which
// are spherical Bessel functions.
#include "sim/render/band_filter.h"

#include <cmath>
#include <numbers>

#include "sim/render/disk_kernel.h"
#include "sim/render/least_squares.h"

namespace lensd::sim {

std::vector<double> FilterWith(const std::function<std::complex<double>(double)>& response) {
  constexpr int kFrequencies = 200;  // from 0 to half a cycle a sample
  constexpr double kBand = 2.0 * std::numbers::pi * (1.0 / kShortestPeriod + 0.01);
  constexpr double kBeyond = 0.003, kConstant = 1e6;
  LeastSquares fit(2 * kBandReach + 1);
  for (int i = 0; i <= kFrequencies; ++i) {
    const double w = std::numbers::pi * i / kFrequencies;
    std::vector<double> real, imaginary;
    for (int k = -kBandReach; k <= kBandReach; ++k) {
      real.push_back(std::cos(w * k));
      imaginary.push_back(std::sin(w * k));
    }
    const double importance = i == 0 ? kConstant : w <= kBand ? 1.0 : kBeyond;
    fit.Add(real, response(w).real(), importance);
    fit.Add(imaginary, response(w).imag(), importance);
  }
  return std::move(fit).Solve();
}

double PixelMeanOf(double w) {
  return std::sph_bessel(0, 0.5 * w);
}

WaveParabola ParabolaOf(double w) {
  const double x = 0.5 * w;
  return {std::sph_bessel(0, x), {0.0, 6.0 * std::sph_bessel(1, x)}, -30.0 * std::sph_bessel(2, x)};
}

}  // namespace lensd::sim
