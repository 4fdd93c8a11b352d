// Where a table of figures goes: a CSV file, a chart, one line of JSON, or a table for people.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace lensd::bench {

/// What the user asked for; empty paths: no such file.
struct Outputs {
  std::string csv;
  std::string svg;
  bool as_json = false;
};

/// Writes `rows` (flat objects with the same keys; null where a figure is missing) as asked, then `chart()` as the SVG.
/// Peers the build lacks are named on stderr. Returns the exit status: 0, or EX_IOERR after a line on stderr.
int WriteOutputs(const std::string& command, const std::vector<nlohmann::ordered_json>& rows,
                 const std::vector<std::string>& missing, const Outputs& outputs,
                 const std::function<std::string()>& chart);

}  // namespace lensd::bench
