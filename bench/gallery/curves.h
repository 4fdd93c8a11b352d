// Curves sampled from formulas, and the least value of one.
#pragma once

#include <cmath>
#include <functional>
#include <string>

#include "io/svg.h"

namespace lensd::bench {

using Formula = std::function<double(double)>;

inline constexpr int kSamples = 160;

/// A line over [low, high], even in value or in ratio.
inline io::ChartLine CurveOf(const Formula& formula, double low, double high, io::Scale scale = io::Scale::Linear) {
  io::ChartLine line;
  for (int i = 0; i <= kSamples; ++i) {
    const double part = static_cast<double>(i) / kSamples;
    const double x = scale == io::Scale::Log ? low * std::pow(high / low, part) : low + part * (high - low);
    line.points.push_back({x, formula(x)});
  }
  return line;
}

/// Where in [low, high], both above 0, a formula with one dip is least: golden section over the logarithm.
inline double LeastOf(const Formula& formula, double low, double high) {
  constexpr double kGolden = 0.6180339887498949;
  double a = std::log(low), b = std::log(high);
  for (int i = 0; i < 100; ++i) {
    const double left = b - kGolden * (b - a), right = a + kGolden * (b - a);
    if (formula(std::exp(left)) < formula(std::exp(right)))
      b = right;
    else
      a = left;
  }
  return std::exp(0.5 * (a + b));
}

}  // namespace lensd::bench
