// What the page shows: charts as plain data, and how each becomes charts of the kit in io/.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bench/evidence/statistics.h"
#include "io/svg.h"

namespace lensd::bench {

struct ChartAxis {
  std::string label;  ///< with the unit
  bool log = false;
  std::optional<double> low{}, high{};
  std::vector<std::pair<double, std::string>> ticks{};  ///< own ones; empty: chosen
};

/// A method's place with its intervals. Series 0 is ours, 1 and up peers and others.
struct ChartMark {
  double x = 0.0, y = 0.0;
  std::optional<Estimate> x_range{}, y_range{};
  int series = 0;
  std::string label{};
  std::string tip{};  ///< count and interval in words
};

/// Marks joined by a line, labelled at its end.
struct ChartLine {
  std::vector<ChartMark> marks;
  int series = 0;
  std::string label{};
  bool dashed = false;
  bool steps = false;  ///< a front: along the axes from mark to mark, without marks of its own
};

/// A floor or a goal: a line across the frame.
struct ChartRule {
  std::optional<double> x{}, y{};
  std::string label;
};

struct ScatterChart {
  ChartAxis x, y;
  std::vector<ChartMark> marks{};
  std::vector<ChartLine> lines{};
  std::vector<ChartRule> rules{};
  bool diagonal = false;  ///< a line where y equals x
  double height = 330.0;  ///< px of the frame, more where labels need it
};

struct DotMark {
  Estimate estimate{};
  int series = 0;
  std::string tip{};
};
/// One line of a chart of dots: a name, marks with their intervals, and a figure in words behind them.
struct DotRow {
  std::string name;
  std::vector<DotMark> marks;
  std::string figure{};
};
struct DotGroup {
  std::string name;  ///< empty: no heading
  std::vector<DotRow> rows;
  std::optional<double> floor{};  ///< a line through the group
};
struct DotChart {
  ChartAxis x;
  std::vector<DotGroup> groups;
  std::string floor_label{};
};

/// How runs of one method ended in one regime, as counts.
struct Outcomes {
  int within = 0, off = 0, refused = 0, wrong = 0;
  bool right_is_refusal = false;  ///< nothing could be found here
  int runs() const { return within + off + refused + wrong; }
};
/// A table of bars: regimes down, methods across.
struct OutcomeChart {
  std::vector<std::string> methods;
  std::vector<std::pair<std::string, std::vector<std::optional<Outcomes>>>> regimes;
};

/// A series and its name in the legend.
using ChartKey = std::vector<std::pair<int, std::string>>;

/// What is drawn for a page so wide, px: one chart, or several below each other where a table of bars does not fit.
std::vector<io::Chart> Drawn(const ScatterChart& chart, const std::string& title, const ChartKey& key, int width);
std::vector<io::Chart> Drawn(const DotChart& chart, const std::string& title, const ChartKey& key, int width);
std::vector<io::Chart> Drawn(const OutcomeChart& chart, const std::string& title, const ChartKey& key, int width);

/// The marks as CSV: a line for each, with its figures and intervals under the names of the axes.
std::string MarksCsv(const ScatterChart& chart);
std::string MarksCsv(const DotChart& chart);
std::string MarksCsv(const OutcomeChart& chart);

}  // namespace lensd::bench
