// JSON has no infinity and no NaN: both become null, which says that there is no such figure.
#include "bench/autofocus/run_json.h"

#include <cmath>
#include <limits>

namespace lensd::bench {

using nlohmann::ordered_json;

ordered_json JsonOf(const AutofocusSummary& summary) {
  const auto number = [](const std::optional<double>& value) { return value ? ordered_json(*value) : ordered_json(); };
  return {{"method", summary.method},
          {"runs", summary.runs},
          {"within", summary.within},
          {"withinLow", summary.within_low},
          {"falseFocus", summary.false_focus},
          {"refused", summary.refused},
          {"framesP50", summary.frames_p50},
          {"framesP95", summary.frames_p95},
          {"movesP50", summary.moves_p50},
          {"movesP95", summary.moves_p95},
          {"waitedMsP50", summary.waited_ms_p50},
          {"waitedMsP95", summary.waited_ms_p95},
          {"knownMsP50", summary.known_ms_p50},
          {"timesKnownP50", summary.times_known_p50},
          {"errorDofP50", number(summary.error_dof_p50)},
          {"errorDofP95", number(summary.error_dof_p95)},
          {"errorDofMax", number(summary.error_dof_max)},
          {"cpuMsPerFrame", summary.cpu_ms_per_frame},
          {"cpuMsPerVgaFrame", summary.cpu_ms_per_whole_frame},
          {"claimHolds", number(summary.claim_holds)},
          {"rmsErrorPx", number(summary.rms_error_px)},
          {"rmsFloorPx", number(summary.rms_floor_px)}};
}

ordered_json EachOf(const std::vector<AutofocusRunResult>& runs, const FocusFloor* floor) {
  ordered_json each{{"outcome", {}}, {"frames", {}},   {"moves", {}},   {"elapsedMs", {}}, {"cpuMs", {}},
                    {"knownMs", {}}, {"errorDof", {}}, {"errorPx", {}}, {"boundPx", {}}};
  const auto ms = [](Duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); };
  for (const AutofocusRunResult& run : runs) {
    each["outcome"].push_back(!run.focused ? "refused" : run.within() ? "within" : run.false_focus() ? "false" : "off");
    each["frames"].push_back(run.frames);
    each["moves"].push_back(run.moves);
    each["elapsedMs"].push_back(ms(run.elapsed));
    each["cpuMs"].push_back(ms(run.cpu));
    each["knownMs"].push_back(ms(run.known));
    each["offSigmas"].push_back(run.off_sigmas.value_or(std::numeric_limits<double>::quiet_NaN()));
    each["errorDof"].push_back(run.error_dof());
    each["errorPx"].push_back(run.subject_px ? std::abs(*run.subject_px) : run.error_px());
    each["boundPx"].push_back(floor != nullptr ? std::hypot(floor->BoundPx(run.blurs_px), floor->quantisation_px())
                                               : std::numeric_limits<double>::infinity());
  }
  return each;
}

}  // namespace lensd::bench
