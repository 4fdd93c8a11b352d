// Runs jobs and keeps their rows in a folder.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "bench/evidence/jobs.h"

namespace lensd::bench {

struct GatherOptions {
  std::string directory;
  std::vector<std::string> families{};  ///< only these; empty: all
  std::vector<std::string> scenes{};    ///< only jobs whose scene begins with one of these; empty: all
  std::chrono::seconds patience{3600};  ///< the longest time for one process
};

/// Runs every job whose rows are not in the folder yet with the same settings, one after the other, each process on one
/// processor where the job says so; writes a job's rows as soon as it has ended. `say` hears a line for each job. The
/// first job that fails ends it: what was done stays.
Result<void> Gather(const std::vector<EvidenceJob>& jobs, const GatherOptions& options,
                    const std::function<void(const std::string&)>& say);

}  // namespace lensd::bench
