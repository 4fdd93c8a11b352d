// The lowest and the highest of many lines at one f-number, a vector of lines at a time, for whatever vectors the
// processor has. Every one of them finds the same line.
#pragma once

#include <cstddef>
#include <span>

namespace lensd::optics {

/// From so many lines on it is quicker than one by one.
inline constexpr std::size_t kWorthScanning = 16;

/// One line and its value; `index` is -1 where there are no lines.
struct ScannedLine {
  int index = -1;
  double value = 0.0;
};

/// Of the lines p + q t (the first `sharp` of them) and p + q u (the others) the one of least value, of equals the one
/// of least q, of equals the first. No NaN.
ScannedLine LowestLine(std::span<const double> p, std::span<const double> q, std::size_t sharp, double t, double u);
/// The one of greatest value, then of greatest q.
ScannedLine HighestLine(std::span<const double> p, std::span<const double> q, std::size_t sharp, double t, double u);

}  // namespace lensd::optics
