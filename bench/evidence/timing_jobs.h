// Jobs of the families that are timed, and of moves.
#pragma once

#include <vector>

#include "bench/evidence/jobs.h"

namespace lensd::bench {

std::vector<EvidenceJob> TimingJobs(Counts counts);

}  // namespace lensd::bench
