// From rows of evidence to charts with their words.
#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "bench/evidence/rows.h"
#include "bench/report/chart.h"

namespace lensd::bench {

using Evidence = std::vector<EvidenceRow>;

/// One chart of the page: a title that says what is seen, how to read it, what it means.
struct Figure {
  std::string id;
  std::string title;
  std::string read;
  std::string means;
  std::variant<ScatterChart, DotChart, OutcomeChart> chart;
  /// What the marks are, where colours and shapes need saying: series and its name.
  ChartKey key{};
};

std::vector<Figure> SpeedFigures(const Evidence& rows);
std::vector<Figure> FailureFigures(const Evidence& rows);
std::vector<Figure> NeedFigures(const Evidence& rows);

/// A goal or a regime of the project, with what came of it.
struct Verdict {
  std::string work;
  std::string ours;
  std::string floor{};
  std::string peer{};
  std::string goal;
  enum class Kind { Met, Missed, Open } kind = Kind::Open;
  std::string words{};  ///< why not, where it is missed or open
};
std::vector<Verdict> GoalVerdicts(const Evidence& rows);
std::vector<Verdict> RegimeVerdicts(const Evidence& rows);

/// A number with so many digits at most, without a needless exponent.
std::string Short(double value, int digits = 3);

/// The first row of these; null: there is none.
const EvidenceRow* RowOf(const Evidence& rows, std::string_view family, std::string_view scene, std::string_view method,
                         std::string_view measure, std::optional<double> value = {});

Evidence Selected(const Evidence& rows, const std::function<bool(const EvidenceRow&)>& wanted);

/// Different values in the order of their first row.
std::vector<std::string> Names(const Evidence& rows, std::string EvidenceRow::* column);

/// All samples of the rows in one: a median of everything.
Estimate Pooled(const Evidence& rows, int* count = nullptr);
/// Hits and runs of rows of shares.
std::pair<int, int> Counted(const Evidence& rows);

/// "3 (2 to 4, n = 12)" of medians, "98.5 % (96.2 to 99.5, n = 240)" of shares; says so where the spread is too wide.
std::string InWords(const EvidenceRow& row);
std::string ShareInWords(int hits, int runs);

/// Ratio of two rows' samples, one by one in their order: of times that were taken by turns.
Estimate RatioOf(const EvidenceRow& over, const EvidenceRow& under);

/// 0 ours, 1 peer; a floor is drawn as a line.
int SeriesOf(const EvidenceRow& row);

/// The marks that no other beats in both: to the left and below.
ChartLine FrontOf(const std::vector<ChartMark>& marks);

/// Renderers: time against error, and cost over the disk's diameter.
void AddRenderSpeed(const Evidence& rows, std::vector<Figure>& figures);
std::vector<Figure> RenderFailures(const Evidence& rows);
std::vector<Figure> RenderNeeds(const Evidence& rows);

/// Drivers: calls and moves against floors, and moves on a bad wire.
void AddDriverSpeed(const Evidence& rows, std::vector<Figure>& figures);
std::vector<Figure> DriverFailures(const Evidence& rows);

}  // namespace lensd::bench
