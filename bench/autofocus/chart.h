// The charts of lens-bench autofocus as one SVG document.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bench/autofocus/floor.h"
#include "bench/autofocus/runs.h"

namespace lensd::bench {

using MethodRuns = std::pair<std::string, std::vector<AutofocusRunResult>>;

/// The runs of every method on one scene.
struct SceneRuns {
  std::string name;
  std::vector<MethodRuns> methods;           ///< the same ones in the same order on every scene
  std::vector<double> cpu_ms_per_vga_frame;  ///< of each method, where it looks at all of a 640 x 480 px frame
  std::optional<FocusFloor> floor;           ///< none: several subjects
};

/// Frames and time against the blur that is left, with the front of what nothing beats and the floors; success against
/// how far off the run began, and over several scenes against signal to noise and contrast; refusals against false
/// focus; how the runs ended.
std::string AutofocusChart(const std::vector<SceneRuns>& scenes);

}  // namespace lensd::bench
