// What many runs of one method amount to.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/autofocus/floor.h"
#include "bench/autofocus/runs.h"

namespace lensd::bench {

/// Shares are of all runs; errors are over the focused ones, absent where there is none. Depths of field are whole
/// ones, so that `within` means an error of at most 0.5.
struct AutofocusSummary {
  std::string method;
  int runs = 0;
  double within = 0.0;       ///< focused within half a depth of field
  double within_low = 0.0;   ///< lower end of its 95 % Wilson interval
  double false_focus = 0.0;  ///< focused, and beyond twice that
  double refused = 0.0;
  double frames_p50 = 0.0, frames_p95 = 0.0;
  double moves_p50 = 0.0, moves_p95 = 0.0;
  double waited_ms_p50 = 0.0, waited_ms_p95 = 0.0;  ///< on the simulated clock, the time of computing added
  double known_ms_p50 = 0.0;                        ///< what one who knew the answer takes from the same starts
  double times_known_p50 = 0.0;                     ///< of the ratios of the two, run by run
  std::optional<double> error_dof_p50, error_dof_p95, error_dof_max;
  double cpu_ms_per_frame = 0.0;
  double cpu_ms_per_whole_frame = 0.0;  ///< a frame of 640 x 480 px that is the region as a whole; 0: not measured
  std::optional<double>
      rms_error_px;  ///< of the estimate, px of blur, over the focused runs within half a depth of field
  std::optional<double> claim_holds;   ///< share of the answers with a sigma whose 95 % interval holds the truth
  std::optional<double> rms_floor_px;  ///< what the light of those runs' frames and the motor's step allow
};

AutofocusSummary Summarise(const std::string& method, const std::vector<AutofocusRunResult>& results,
                           const FocusFloor* floor = nullptr);

/// Processor time of the method per frame of these runs.
double CpuMsPerFrame(const std::vector<AutofocusRunResult>& results);

/// Lower end of the 95 % Wilson score interval of `hits` out of `runs` > 0.
double WilsonLow(int hits, int runs);

/// The smallest value that at least the share `part` of the values does not exceed. `values` must not be empty.
double Percentile(std::vector<double> values, double part);

}  // namespace lensd::bench
