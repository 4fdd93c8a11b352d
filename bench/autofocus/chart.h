// The two charts of lens-bench autofocus as one SVG document.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "bench/autofocus/runs.h"

namespace lensd::bench {

using MethodRuns = std::pair<std::string, std::vector<AutofocusRunResult>>;

/// Final error against frames spent, one mark a run, and how the runs of each method ended.
std::string AutofocusChart(const std::string& scene, const std::vector<MethodRuns>& methods);

}  // namespace lensd::bench
