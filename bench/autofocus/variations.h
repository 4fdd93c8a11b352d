// One difficulty at a time, from none to more than any method can bear: what scenes and runs are changed by. A new
// difficulty is a row of the table in variations.cpp.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bench/autofocus/runs.h"
#include "sim/scene.h"

namespace lensd::bench {

struct Variation {
  std::string_view name;       ///< as the command line has it
  std::string_view axis;       ///< for charts, with the unit
  std::vector<double> values;  ///< from easy to hard
  /// Changes what is rendered or how it is run; the scene is one of a single wall.
  void (*apply)(sim::Scene& scene, AutofocusRuns& runs, double value);
  int most_runs = 1'000'000;  ///< evidence runs no more: a frame takes long to draw
};

std::span<const Variation> Variations();

/// The row of that name; null: there is none.
const Variation* VariationNamed(std::string_view name);

/// Changes scene and runs by "NAME=NUMBER". InvalidArgument: it is no such thing; the message lists the names.
Result<void> Vary(const std::string& asked, sim::Scene& scene, AutofocusRuns& runs);

}  // namespace lensd::bench
