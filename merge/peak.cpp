// Blur takes fine detail away nearly as a bell curve of the distance from focus, so the logarithm of sharpness is
// nearly a parabola. Its bend is much the same all over a stack, since it comes from aperture and spacing: where a
// pixel's own is uncertain it is kept near the usual one, and at the ends of the stack, where two points are all there
// is, it is taken.
#include "peak.h"

#include <algorithm>
#include <cmath>

namespace lensd::merge {
namespace {

/// Of the largest sharpness: what stays of it far from focus, and keeps logarithms of noise small.
constexpr double kPedestal = 0.02;
/// Independent squares in the window of a sharpness.
constexpr double kSquares = 12.0;
/// Of a step between frames: what the curve is not a parabola by.
constexpr double kModelError = 0.08;
/// How far beyond an end of the stack a top is believed, in steps.
constexpr double kBeyond = 0.75;
constexpr double kBendDoubt = 0.4;

double LogOf(const PeakSamples& s, double value) {
  const double top = std::max(s.at - s.noise, 0.0);
  return std::log(std::max(value - s.noise, 0.0) + kPedestal * top + 1e-300);
}

/// Standard deviation of that.
double SpreadOf(const PeakSamples& s, double value) {
  const double top = std::max(s.at - s.noise, 0.0), signal = std::max(value - s.noise, 0.0);
  const double variance = (2.0 * s.noise * s.noise + 4.0 * s.noise * signal) / kSquares;
  return std::sqrt(variance) / (signal + kPedestal * top + 1e-300);
}

}  // namespace

std::optional<double> BendOf(const PeakSamples& s) {
  if (s.before < 0.0 || s.after < 0.0) return std::nullopt;
  const double left = (LogOf(s, s.at) - LogOf(s, s.before)) / (s.place - s.place_before);
  const double right = (LogOf(s, s.after) - LogOf(s, s.at)) / (s.place_after - s.place);
  const double bend = (left - right) / (s.place_after - s.place_before);
  return bend > 0.0 ? std::optional(bend) : std::nullopt;
}

std::optional<Peak> FitPeak(const PeakSamples& s, double usual_bend) {
  const bool first = s.before < 0.0, last = s.after < 0.0;
  if (first && last) return std::nullopt;
  const double low = first ? s.place : s.place_before, high = last ? s.place : s.place_after;
  const double y_low = LogOf(s, first ? s.at : s.before), y_high = LogOf(s, last ? s.at : s.after);
  const double noise = std::hypot(SpreadOf(s, first ? s.at : s.before), SpreadOf(s, last ? s.at : s.after));
  const double width = high - low;
  double bend = usual_bend;
  if (!first && !last) {
    // Where the frames are unevenly spaced the slope of the parabola between the outer two is still that at their
    // middle.
    bend = std::clamp(BendOf(s).value_or(usual_bend), usual_bend / 2.0, usual_bend * 2.0);
  }
  const double shift = (y_high - y_low) / (2.0 * bend * width);
  const double step = first || last ? width : width / 2.0;
  Peak peak{.place = 0.5 * (low + high) + shift, .sigma = std::hypot(noise / (2.0 * bend * width), kModelError * step)};
  if (first || last) {
    if (std::abs(peak.place - s.place) > kBeyond * step) return std::nullopt;
    peak.sigma = std::hypot(peak.sigma, kBendDoubt * shift);
  } else {
    peak.place = std::clamp(peak.place, 0.5 * (s.place_before + s.place), 0.5 * (s.place + s.place_after));
  }
  return peak;
}

}  // namespace lensd::merge
