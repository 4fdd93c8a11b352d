// The figures of `plan` as a chart, a table, CSV and JSON.
#include "bench/plan/report.h"

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <nlohmann/json.hpp>

#include "io/svg.h"

namespace lensd::bench {
namespace {

constexpr double kLeastError = 1e-16;  // where an error of nothing is drawn

io::Chart ChartOf(const std::string& set, const std::vector<Measured>& rows) {
  io::Chart chart;
  chart.title = set;
  chart.subtitle = "down and left is better; a cross: breaks limits or calls possible plans impossible";
  chart.x = {.label = "time for one plan", .unit = "us", .scale = io::Scale::Log};
  chart.y = {.label = "largest relative error of the f-number", .scale = io::Scale::Log, .low = kLeastError / 2};
  for (const Measured& row : rows) {
    if (row.set != set) continue;
    if (!row.plans) {
      chart.rules.push_back({.x = row.time_us, .label = row.method});
      continue;
    }
    chart.points.push_back({.name = row.method,
                            .points = {{{row.time_us, std::max(row.error_max, kLeastError)}, row.method}},
                            .marker = row.wrong > 0 ? io::Marker::Cross : io::Marker::Dot});
  }
  chart.legend = io::LegendPlace::None;
  return chart;
}

std::vector<std::string> SetsOf(const std::vector<Measured>& rows) {
  std::vector<std::string> sets;
  for (const Measured& row : rows) {
    if (sets.empty() || sets.back() != row.set) sets.push_back(row.set);
  }
  return sets;
}

}  // namespace

void PrintTable(const std::vector<Measured>& rows, std::ostream& out) {
  std::string set;
  for (const Measured& row : rows) {
    if (row.set != set) {
      set = row.set;
      out << "\n"
          << set << ": " << row.problems << (row.problems == 1 ? " problem" : " problems") << "\n  " << std::left
          << std::setw(28) << "method" << std::right << std::setw(13) << "us a plan" << std::setw(10) << "x lensd"
          << std::setw(11) << "error p50" << std::setw(11) << "error max" << std::setw(8) << "wrong" << std::setw(8)
          << "over" << "\n";
    }
    // Superscripts count as two bytes but one column.
    const auto wide = std::count_if(row.method.begin(), row.method.end(), [](char c) { return (c & 0xC0) == 0x80; });
    out << "  " << std::left << std::setw(28 + static_cast<int>(wide)) << row.method << std::right << std::setw(13)
        << std::setprecision(4) << row.time_us << std::setprecision(3) << std::setw(10);
    row.time_to_ours ? out << *row.time_to_ours : out << "-";
    if (row.plans) {
      out << std::setw(11) << row.error_p50 << std::setw(11) << row.error_max << std::setw(8) << row.wrong
          << std::setw(8) << row.over;
    }
    out << "\n";
  }
}

std::string PlanJson(const std::vector<Measured>& rows) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const Measured& row : rows) {
    nlohmann::ordered_json entry{{"set", row.set},
                                 {"method", row.method},
                                 {"limits", row.limits},
                                 {"problems", row.problems},
                                 {"timeUsP50", row.time_us}};
    entry["timeToOurs"] = row.time_to_ours ? nlohmann::ordered_json(*row.time_to_ours) : nlohmann::ordered_json();
    if (row.plans) {
      entry.update({{"errorP50", row.error_p50},
                    {"errorMax", row.error_max},
                    {"wrong", row.wrong},
                    {"over", row.over},
                    {"refused", row.refused}});
    }
    json.push_back(std::move(entry));
  }
  return json.dump();
}

Result<void> WritePlanCsv(const std::vector<Measured>& rows, const std::string& path) {
  std::ofstream file(path);
  file << "set,method,limits,problems,timeUsP50,timeToOurs,errorP50,errorMax,wrong,over\n" << std::setprecision(9);
  for (const Measured& row : rows) {
    file << '"' << row.set << "\",\"" << row.method << "\"," << row.limits << ',' << row.problems << ',' << row.time_us
         << ',';
    if (row.time_to_ours) file << *row.time_to_ours;
    file << ',';
    if (row.plans) {
      file << row.error_p50 << ',' << row.error_max << ',' << row.wrong << ',' << row.over << "\n";
    } else {
      file << ",,,\n";
    }
  }
  file.close();
  if (!file) return Fail(Code::Io, "cannot write " + path);
  return {};
}

Result<void> WritePlanSvg(const std::vector<Measured>& rows, const std::string& path) {
  std::vector<io::Chart> charts;
  for (const std::string& set : SetsOf(rows)) {
    const auto plans = [&](const Measured& row) { return row.set == set && row.plans; };
    if (std::ranges::any_of(rows, plans)) charts.push_back(ChartOf(set, rows));
  }
  return io::WriteSvg(path, io::ChartsSvg(charts, 2));
}

}  // namespace lensd::bench
