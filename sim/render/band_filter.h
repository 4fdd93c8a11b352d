// Filters that say what a band-limited picture does between its samples.
#pragma once

#include <complex>
#include <functional>
#include <vector>

namespace lensd::sim {

/// A filter's weights look so many samples to either side.
inline constexpr int kBandReach = 5;

/// The weights by which samples -kBandReach .. kBandReach of a wave exp(i w x), w in radians a sample, add up best to
/// `response(w)` times its value in the middle, for periods from kShortestPeriod (disk_kernel.h) up.
std::vector<double> FilterWith(const std::function<std::complex<double>(double)>& response);

/// What a wave of w radians a pixel keeps of its amplitude in its means over pixels: sin(w/2)/(w/2).
double PixelMeanOf(double w);

/// The parabola that comes closest to a wave of amplitude 1 over the pixel around its middle: its mean, its slope in
/// the middle and the factor of x² - 1/12.
struct WaveParabola {
  std::complex<double> mean, slope, bend;
};
WaveParabola ParabolaOf(double w);

}  // namespace lensd::sim
