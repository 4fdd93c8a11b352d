// The one table that all evidence is kept in: a row is one measure of one method on one scene, with every single value
// it was made of and with what it takes to make it again. A folder holds it as FAMILY/SCENE.csv.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "bench/evidence/statistics.h"

namespace lensd::bench {

/// Where a figure was made.
struct Provenance {
  std::string commit;
  std::string machine;
  std::string compiler;
  std::string date;  ///< YYYY-MM-DD
};

/// Of this program, on this machine, today.
Provenance ProvenanceHere();

struct EvidenceRow {
  std::string family;  ///< "plan", "render", "measure", "autofocus", "move", "rpc"
  std::string scene;   ///< what all methods were given
  std::string method;
  std::string role;               ///< "ours", "peer" or "floor"
  std::string sweep{};            ///< what was varied, with its unit; empty: nothing was
  std::optional<double> value{};  ///< its value
  std::string measure;            ///< "time", "error", "within" ...
  std::string unit;               ///< "share" where hits of n runs are counted
  int n = 0;                      ///< runs, problems or repeats
  Estimate estimate{};
  std::vector<double>
      samples{};       ///< the values whose median this is, in the order in which they were measured; a share has none
  std::string note{};  ///< what the method chose
  std::string settings;  ///< the command, and how often it ran
  std::string seed{};
  Provenance made{};
};

/// A row of `hits` out of `runs`, or of the median of `samples`; everything else as in `like`.
EvidenceRow ShareRow(EvidenceRow like, std::string measure, int hits, int runs);
EvidenceRow MedianRow(EvidenceRow like, std::string measure, std::string unit, std::vector<double> samples);

/// The rows as CSV with a line of names, and back. BadData: a line that is no row, by its number.
std::string CsvOf(const std::vector<EvidenceRow>& rows);
Result<std::vector<EvidenceRow>> RowsFromCsv(const std::string& text, const std::string& path);

/// The rows as one JSON array, one object a row.
std::string JsonOf(const std::vector<EvidenceRow>& rows);

/// Every FAMILY/*.csv below the folder, in the order of their names. Io, BadData.
Result<std::vector<EvidenceRow>> LoadEvidence(const std::string& directory);

/// A name that may stand in a path: small letters, digits and hyphens.
std::string FileNameOf(std::string_view scene);

}  // namespace lensd::bench
