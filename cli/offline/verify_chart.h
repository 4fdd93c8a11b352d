// The blur that was measured over distance as a picture, with the limits and what was planned.
#pragma once

#include <span>
#include <vector>

#include "io/svg.h"
#include "verify/limit_verdict.h"

namespace lensd::cli {

/// What the chart shows.
struct VerifyPlot {
  std::span<const verify::Verdict> verdicts;
  std::span<const verify::SliceBlur> slices;
  std::vector<io::ChartPoint> planned;  ///< distance in metres, blur in px; empty: no curve
};

/// A dot with its interval for each slice that tells its blur, a ring where the frames tell only what it is at most;
/// hatched areas for limits.
io::Chart VerifyChart(const VerifyPlot& plot);

}  // namespace lensd::cli
