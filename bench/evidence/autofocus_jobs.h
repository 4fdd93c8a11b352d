// Jobs of autofocus: every method on the scoring scenes, on the regimes in which methods fail, on recorded stacks, and
// over each difficulty until it fails.
#pragma once

#include <vector>

#include "bench/evidence/jobs.h"

namespace lensd::bench {

std::vector<EvidenceJob> AutofocusJobs(Counts counts, const EvidenceSources& sources);

}  // namespace lensd::bench
