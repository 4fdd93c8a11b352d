// Drivers: what calls and moves cost beside a bare exchange and the mechanism's travel, and how moves end on a bad
// wire.
#include <algorithm>
#include <cmath>

#include "bench/report/figures.h"

namespace lensd::bench {
namespace {

constexpr double kLeastSteps = 1e-4;  // an error of nothing is drawn there

Evidence DriverRows(const Evidence& rows, const std::function<bool(const EvidenceRow&)>& wanted) {
  return Selected(rows, [&](const EvidenceRow& row) { return row.family == "drivers" && wanted(row); });
}

void AddCalls(const Evidence& rows, std::vector<Figure>& figures) {
  const Evidence calls = DriverRows(rows, [](const EvidenceRow& row) { return row.sweep.empty() && row.unit == "ms"; });
  DotChart chart{.x = {.label = "time [ms] (median)", .log = true}, .groups = {}, .floor_label = "one bare exchange"};
  double most = 0.0;
  std::string costliest;
  for (const std::string& driver : Names(calls, &EvidenceRow::method)) {
    const EvidenceRow* bare = RowOf(calls, "drivers", "calls and moves", driver, "bare exchange");
    if (bare == nullptr) continue;
    DotGroup group{.name = driver, .rows = {}, .floor = bare->estimate.middle};
    for (const char* measure : {"bare exchange", "reading", "command", "stop"}) {
      const EvidenceRow* row = RowOf(calls, "drivers", "calls and moves", driver, measure);
      if (row == nullptr) continue;
      const double factor = row->estimate.middle / bare->estimate.middle;
      group.rows.push_back(
          {.name = measure,
           .marks = {{row->estimate, row == bare ? 2 : 0, driver + ", " + measure + ": " + InWords(*row)}},
           .figure = Short(row->estimate.middle) + " ms" + (row == bare ? "" : ", " + Short(factor) + "x") +
                     (TooWide(row->estimate, row->n) ? " ?" : "")});
      if (row->measure == "stop" && factor > most) {
        most = factor;
        costliest = driver;
      }
    }
    chart.groups.push_back(std::move(group));
  }
  if (chart.groups.empty()) return;
  figures.push_back(
      {.id = "drivers-calls",
       .title = "Drivers: what one reading, one command and one stop cost",
       .read =
           "Left is faster; the factor is that to one bare exchange over the same wire. Modbus and GenICam are timed "
           "on sockets and terminals of the machine, LensConnect and UVC in transfers of 250 us that no processor "
           "slows. A question mark: too few processes or too wide a spread to judge.",
       .means = "What is right of the line are exchanges that the protocol asks for (a status beside a position, 4 ms "
                "of silence "
                "on a serial line) and the driver's own work; a stop costs most on " +
                costliest + ", " + Short(most) + " exchanges.",
       .chart = std::move(chart),
       .key = {{2, "bare exchange, the floor"}, {0, "lensd's driver"}}});
}

void AddMoves(const Evidence& rows, std::vector<Figure>& figures) {
  ScatterChart chart{
      .x = {.label = "time from the mechanism's arrival until it is told reached [ms] (median)", .log = true},
      .y = {.label = "error of the position told [steps] (95 % are within; nothing: drawn at 1e-4)", .log = true},
      .rules = {{.y = 1.0, .label = "one step"}}};
  double worst = 0.0;
  for (const EvidenceRow& row :
       DriverRows(rows, [](const EvidenceRow& r) { return r.measure == "beyond the travel"; })) {
    const EvidenceRow* error = RowOf(rows, "drivers", row.scene, row.method, "error");
    const EvidenceRow* travel = RowOf(rows, "drivers", row.scene, row.method, "travel");
    if (error == nullptr || travel == nullptr || row.estimate.middle <= 0.0) continue;
    worst = std::max(worst, error->estimate.middle);
    const std::string text = row.method;
    chart.marks.push_back({.x = row.estimate.middle,
                           .y = std::max(error->estimate.middle, kLeastSteps),
                           .x_range = row.estimate,
                           .series = 0,
                           .label = text,
                           .tip = row.method + ": " + InWords(row) + " beyond a travel of " + InWords(*travel) +
                                  ", told " + Short(error->estimate.middle) + " steps off"});
  }
  if (chart.marks.empty()) return;
  chart.lines.push_back(FrontOf(chart.marks));
  figures.push_back(
      {.id = "drivers-moves",
       .title = "Drivers: how long after the mechanism arrived a move is told as reached, and how true that is",
       .read =
           "Left is sooner, down is truer; a mark is a driver on its simulated device. The mechanism's own travel is "
           "taken off each move; the truth is the device's own position. Lines are 95 % intervals of the median.",
       .means =
           "What a move takes beyond the travel is the look that finds the motor standing, and the time that it must "
           "have stood; no driver tells a position that is off by more than " +
           Short(worst) + " steps.",
       .chart = std::move(chart)});
}

/// Of a sweep's name with its unit, "answers lost [%]".
std::string UnitOf(const std::string& sweep) {
  const std::size_t begin = sweep.find('[') + 1;
  return sweep.substr(begin, sweep.find(']') - begin);
}
std::string ShortNameOf(const std::string& sweep) {
  return sweep.starts_with("answers lost") ? "lost" : sweep.starts_with("one answer in five") ? "late" : "not obeyed";
}

}  // namespace

void AddDriverSpeed(const Evidence& rows, std::vector<Figure>& figures) {
  AddCalls(rows, figures);
  AddMoves(rows, figures);
}

std::vector<Figure> DriverFailures(const Evidence& rows) {
  const Evidence swept =
      DriverRows(rows, [](const EvidenceRow& row) { return !row.sweep.empty() && row.measure == "within"; });
  if (swept.empty()) return {};
  OutcomeChart chart{.methods = Names(swept, &EvidenceRow::method), .regimes = {}};
  int lies = 0, moves = 0;
  for (const std::string& sweep : Names(swept, &EvidenceRow::sweep)) {
    std::vector<double> values;
    for (const EvidenceRow& row : swept) {
      if (row.sweep == sweep && std::ranges::find(values, *row.value) == values.end()) values.push_back(*row.value);
    }
    for (const double value : values) {
      std::vector<std::optional<Outcomes>> cells;
      for (const std::string& driver : chart.methods) {
        const auto count = [&](const char* how) {
          const auto found = std::ranges::find_if(rows, [&](const EvidenceRow& row) {
            return row.family == "drivers" && row.sweep == sweep && row.value == value && row.method == driver &&
                   row.measure == how;
          });
          return found == rows.end() ? 0 : static_cast<int>(std::lround(found->estimate.middle * found->n));
        };
        const Outcomes outcomes{.within = count("within"), .refused = count("refused"), .wrong = count("false")};
        lies += outcomes.wrong;
        moves += outcomes.runs();
        cells.push_back(outcomes.runs() > 0 ? std::optional(outcomes) : std::nullopt);
      }
      chart.regimes.emplace_back(ShortNameOf(sweep) + " " + Short(value) + " " + UnitOf(sweep), std::move(cells));
    }
  }
  return {{.id = "drivers-weather",
           .title = "Drivers: how moves end when the wire goes wrong",
           .read =
               "So many answers are lost; one answer in five is late by so much; so many commands are acknowledged "
               "and not obeyed. Each bar is all moves of one driver: told reached and there, refused with a reason, "
               "told reached and elsewhere (false); the line below is the 95 % interval of the first share. Modbus "
               "waits 30 ms for an answer, LensConnect 500, UVC 1000.",
           .means = "A move is told reached where it was not in " + ShareInWords(lies, moves) +
                    " of all moves; where too much is lost, drivers refuse.",
           .chart = std::move(chart)}};
}

}  // namespace lensd::bench
