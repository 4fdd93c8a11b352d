// Which camera model a plan needs: what the planner chose, held to the fullest model over all that may be planned.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace lensd::bench {

/// One kind of plan, from trivial to hard.
struct ModelNeed {
  std::string plan;
  int problems = 0;
  int simpler = 0;     ///< the next simpler model is within the tolerance too
  int beyond = 0;      ///< what was chosen is off by more than the tolerance, or than it states
  std::string models;  ///< how often each was chosen: "thin 12, diffraction 88"
  double error_um = 0.0, bound_um = 0.0, tolerance_um = 0.0;  ///< medians: true, stated, allowed
  double chosen_us = 0.0,
         heaviest_us = 0.0;  ///< medians over the problems of a plan with only what the model has, and with all
};

std::vector<ModelNeed> MeasureNeeds(int problems, std::uint64_t seed);

}  // namespace lensd::bench
