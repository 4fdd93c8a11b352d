// Runs and what they amount to as JSON, for programs that read the tables.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "bench/autofocus/floor.h"
#include "bench/autofocus/summary.h"

namespace lensd::bench {

nlohmann::ordered_json JsonOf(const AutofocusSummary& summary);

/// Every run as lists in the same order; what a run has no figure of is null, an error of one that found nothing too.
nlohmann::ordered_json EachOf(const std::vector<AutofocusRunResult>& runs, const FocusFloor* floor);

}  // namespace lensd::bench
