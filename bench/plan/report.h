// What lens-bench plan prints and writes.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "base/result.h"
#include "bench/plan/measure.h"

namespace lensd::bench {

void PrintTable(const std::vector<Measured>& rows, std::ostream& out);
/// One line of JSON: an array of objects.
std::string PlanJson(const std::vector<Measured>& rows);
Result<void> WritePlanCsv(const std::vector<Measured>& rows, const std::string& path);
/// Time against error, one chart a set, both axes logarithmic.
Result<void> WritePlanSvg(const std::vector<Measured>& rows, const std::string& path);

}  // namespace lensd::bench
