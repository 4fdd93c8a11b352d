// What evidence is made of: which lens-bench commands run how often, and how their answers become rows.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/evidence/rows.h"

namespace lensd::bench {

/// How much is run. Quick: what a guard in CI can afford. Small: enough to see, in minutes. Long: what the committed
/// figures should come from, on a quiet machine, in hours.
enum class Counts { Quick, Small, Long };

struct EvidenceJob {
  std::string family;
  std::string scene;  ///< names the file
  std::string sweep{};
  std::optional<double> value{};
  std::vector<std::string> arguments;  ///< of lens-bench FAMILY, before --json
  int repeats = 1;     ///< processes; what they print is the same table again and again, with other times
  bool pinned = true;  ///< to one processor
  std::string seed{};
  /// The rows of the answers, one JSON text of each process. `like` has everything filled in that is known beforehand.
  std::function<std::vector<EvidenceRow>(const EvidenceRow& like, const std::vector<nlohmann::json>& answers)> rows;

  /// The command with its count, as rows keep it: what was run with the same settings is not run again.
  std::string Settings() const;
};

/// Where scenes and stacks are, and how often autofocus searches each scene (0: as the counts say).
struct EvidenceSources {
  std::string scenes = "scenes";
  std::string stacks = "tests/bench/stacks";
  int runs = 0;
};

/// Every job at these counts, the quick ones first.
std::vector<EvidenceJob> EvidenceJobs(Counts counts, const EvidenceSources& sources);

}  // namespace lensd::bench
