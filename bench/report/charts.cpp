// Marks, rows of dots and tables of bars as charts of the kit.
#include <algorithm>
#include <cmath>

#include "bench/evidence/csv.h"
#include "bench/report/figures.h"

namespace lensd::bench {
namespace {

constexpr const char* kInk = "#222222";
constexpr const char* kSoft = "#777777";
constexpr double kRow = 24.0, kNarrowRow = 38.0;  // px of a row; a narrow one has its name above its dot
constexpr double kNarrowestCell = 46.0;           // px

/// Shape as well as colour tells a series. 0 is ours, 1 peers, 5 what is wrong.
struct SeriesStyle {
  const char* colour;
  io::Marker marker;
};
constexpr SeriesStyle kStyles[] = {{"#0072b2", io::Marker::Dot},      {"#d55e00", io::Marker::Square},
                                   {"#6b6b6b", io::Marker::Ring},     {"#009e73", io::Marker::Diamond},
                                   {"#b0479a", io::Marker::Triangle}, {"#b3003b", io::Marker::Cross}};

const SeriesStyle& StyleOf(int series) {
  return kStyles[static_cast<std::size_t>(series) % std::size(kStyles)];
}

std::string KeyName(const ChartKey& key, int series) {
  const auto found = std::ranges::find(key, series, &std::pair<int, std::string>::first);
  return found == key.end() ? "" : found->second;
}

io::Axis AxisOf(const ChartAxis& axis) {
  return {.label = axis.label,
          .scale = axis.log ? io::Scale::Log : io::Scale::Linear,
          .low = axis.low,
          .high = axis.high,
          .ticks = axis.ticks};
}

io::Chart Begun(const std::string& title, const ChartAxis& x, int width) {
  io::Chart chart{.title = title, .legend = io::LegendPlace::Below, .width = width};
  chart.x = AxisOf(x);
  return chart;
}

void AddIntervals(io::Chart& chart, const ChartMark& mark) {
  const char* colour = StyleOf(mark.series).colour;
  const auto add = [&](const std::optional<Estimate>& range, bool along_x) {
    if (!range) return;
    chart.intervals.push_back(
        {.at = {mark.x, mark.y}, .low = range->low, .high = range->high, .colour = colour, .along_x = along_x});
  };
  add(mark.x_range, true);
  add(mark.y_range, false);
}

/// Named in the legend or, where another line looks the same, at its end.
io::ChartLine LineOf(const ChartLine& line, bool alone) {
  if (line.steps) {
    io::ChartLine front{.colour = kSoft, .width = 1.2};
    for (const ChartMark& mark : line.marks) {
      if (!front.points.empty()) front.points.push_back({mark.x, front.points.back().y});
      front.points.push_back({mark.x, mark.y});
    }
    return front;
  }
  const SeriesStyle& style = StyleOf(line.series);
  io::ChartLine drawn{.name = alone ? line.label : "",
                      .colour = style.colour,
                      .dashed = line.dashed,
                      .markers = true,
                      .marker = style.marker,
                      .label = alone ? "" : line.label};
  for (const ChartMark& mark : line.marks) {
    drawn.points.push_back({mark.x, mark.y});
    drawn.tips.push_back(mark.tip);
  }
  return drawn;
}

/// Where x equals y, as far as marks go.
io::ChartLine DiagonalOf(const ScatterChart& scatter) {
  double low = scatter.x.low.value_or(1e300), high = scatter.x.high.value_or(-1e300);
  for (const ChartMark& mark : scatter.marks) {
    low = std::min({low, mark.x, mark.y});
    high = std::max({high, mark.x, mark.y});
  }
  return {.points = {{low, low}, {high, high}}, .colour = kSoft, .width = 1.4, .dashed = true};
}

/// px to the left of the plot that names of rows take, and to the right what is said of them.
bool NamesAreWide(const DotChart& dots, int width) {
  double names = 0.0, figures = 0.0;
  for (const DotGroup& group : dots.groups) {
    for (const DotRow& row : group.rows) {
      names = std::max(names, io::ChartTextWidth(row.name));
      figures = std::max(figures, io::ChartTextWidth(row.figure));
    }
  }
  return names + figures > 0.55 * width;
}

/// One row at `y`, downward.
void AddRow(io::Chart& chart, const DotRow& row, double y, const ChartKey& key) {
  chart.y.ticks.emplace_back(y, row.name);
  if (!row.figure.empty()) chart.remarks.emplace_back(y, row.figure);
  for (const DotMark& mark : row.marks) {
    const SeriesStyle& style = StyleOf(mark.series);
    chart.intervals.push_back({.at = {mark.estimate.middle, y},
                               .low = mark.estimate.low,
                               .high = mark.estimate.high,
                               .colour = style.colour,
                               .along_x = true});
    chart.points.push_back({.name = KeyName(key, mark.series),
                            .points = {{{mark.estimate.middle, y}, "", mark.tip}},
                            .colour = style.colour,
                            .marker = style.marker});
  }
}

std::string TipOf(const std::string& regime, const std::string& method, const Outcomes& outcomes) {
  const auto part = [&](const char* name, int count) {
    const Estimate share = ShareOf(count, outcomes.runs());
    return std::string(name) + " " + std::to_string(count) + " (" + Short(100 * share.low, 3) + " to " +
           Short(100 * share.high, 3) + " %)";
  };
  return regime + ", " + method + ": of " + std::to_string(outcomes.runs()) + " runs " +
         part("within", outcomes.within) + ", " + part("off", outcomes.off) + ", " + part("refused", outcomes.refused) +
         ", " + part("false", outcomes.wrong) + "; 95 % intervals";
}

/// A cell of the table, one unit wide and high from `x` and `y` on, upward.
void AddCell(io::Chart& chart, double x, double y, const std::string& tip, const Outcomes& outcomes) {
  const double left = x + 0.04, width = 0.92;
  double at = left;
  // Lies stand out by more than their colour.
  const auto part = [&](int count, const char* name, const char* colour, double taller = 0.0) {
    if (count == 0) return;
    const double wide = width * count / outcomes.runs();
    chart.bars.push_back({.name = name,
                          .x_low = at,
                          .x_high = at + wide,
                          .y_low = y + 0.24 - taller,
                          .y_high = y + 0.84 + taller,
                          .colour = colour,
                          .opacity = 1.0,
                          .tip = tip,
                          .outlined = colour[1] == 'f'});
    at += wide;
  };
  part(outcomes.within, "within", "#0072b2");
  part(outcomes.off, "off by more", "#d55e00");
  part(outcomes.refused, "refused", "#ffffff");
  part(outcomes.wrong, "false", "#b3003b", 0.12);
  const Estimate share = ShareOf(outcomes.right_is_refusal ? outcomes.refused : outcomes.within, outcomes.runs());
  chart.lines.push_back({.name = "95 % interval of what ended rightly",
                         .points = {{left + width * share.low, y + 0.1}, {left + width * share.high, y + 0.1}},
                         .colour = kInk,
                         .width = 2.0});
}

/// How many methods stand side by side: names that are wider than a cell take turns on two lines.
std::size_t ColumnsOf(const OutcomeChart& table, int width) {
  double names = 0.0, widest = 0.0;
  for (const auto& [name, cells] : table.regimes) names = std::max(names, io::ChartTextWidth(name));
  for (const std::string& method : table.methods) widest = std::max(widest, io::ChartTextWidth(method) + 6.0);
  const double cell = std::max(kNarrowestCell, 0.5 * widest);
  const auto fit = static_cast<std::size_t>(std::max(1.0, std::floor((width - names - 46.0) / cell)));
  const std::size_t blocks = (table.methods.size() + fit - 1) / fit;
  return (table.methods.size() + blocks - 1) / blocks;
}

io::Chart TableOf(const OutcomeChart& table, const std::string& title, int width, std::size_t first,
                  std::size_t columns) {
  io::Chart chart = Begun(title, {.label = "", .low = 0.0, .high = static_cast<double>(columns)}, width);
  const std::size_t last = std::min(first + columns, table.methods.size());
  double names = 0.0, widest = 0.0;
  for (const auto& [name, cells] : table.regimes) names = std::max(names, io::ChartTextWidth(name));
  for (const std::string& method : table.methods) widest = std::max(widest, io::ChartTextWidth(method) + 6.0);
  const bool turns = widest > (width - names - 46.0) / static_cast<double>(columns);
  for (std::size_t i = first; i < last; ++i) {
    const auto column = static_cast<double>(i - first);
    chart.x.ticks.emplace_back(column + 0.5, (turns && (i - first) % 2 == 1 ? "\n" : "") + table.methods[i]);
  }
  const auto rows = static_cast<double>(table.regimes.size());
  chart.y.low = 0.0;
  chart.y.high = rows;
  chart.frame_height = kRow * rows;
  double y = rows;
  for (const auto& [regime, cells] : table.regimes) {
    y -= 1.0;
    chart.y.ticks.emplace_back(y + 0.5, regime);
    for (std::size_t i = first; i < last; ++i) {
      if (cells[i])
        AddCell(chart, static_cast<double>(i - first), y, TipOf(regime, table.methods[i], *cells[i]), *cells[i]);
    }
  }
  return chart;
}

std::string Cell(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

std::string Cells(double middle, const std::optional<Estimate>& range) {
  return "," + Cell(middle) + "," + (range ? Cell(range->low) : "") + "," + (range ? Cell(range->high) : "");
}

}  // namespace

std::vector<io::Chart> Drawn(const ScatterChart& scatter, const std::string& title, const ChartKey& key, int width) {
  io::Chart chart = Begun(title, scatter.x, width);
  chart.subtitle = "↑ " + scatter.y.label;  // a turned text would be longer than the frame is high
  chart.y = AxisOf(scatter.y);
  chart.y.label.clear();
  chart.frame_height = scatter.height;
  for (const ChartRule& rule : scatter.rules)
    chart.rules.push_back({.x = rule.x, .y = rule.y, .label = rule.label, .colour = kInk});
  if (scatter.diagonal) chart.lines.push_back(DiagonalOf(scatter));
  for (const ChartLine& line : scatter.lines) {
    const auto looks_so = [&](const ChartLine& other) {
      return !other.steps && other.series == line.series && other.dashed == line.dashed;
    };
    chart.lines.push_back(LineOf(line, std::ranges::count_if(scatter.lines, looks_so) == 1));
    if (line.steps) continue;
    for (const ChartMark& mark : line.marks) AddIntervals(chart, mark);
  }
  for (const ChartMark& mark : scatter.marks) {
    AddIntervals(chart, mark);
    const SeriesStyle& style = StyleOf(mark.series);
    chart.points.push_back({.name = KeyName(key, mark.series),
                            .points = {{{mark.x, mark.y}, mark.label, mark.tip}},
                            .colour = style.colour,
                            .marker = style.marker});
  }
  return {std::move(chart)};
}

std::vector<io::Chart> Drawn(const DotChart& dots, const std::string& title, const ChartKey& key, int width) {
  io::Chart chart = Begun(title, dots.x, width);
  chart.y.inside = NamesAreWide(dots, width);
  double y = 0.0;
  for (const DotGroup& group : dots.groups) {
    if (!group.name.empty()) {
      chart.bars.push_back({.y_low = y - 0.9, .y_high = y - 0.1, .colour = kInk, .opacity = 0.07, .label = group.name});
      y -= 1.0;
    }
    const double top = y;
    for (const DotRow& row : group.rows) {
      AddRow(chart, row, y - (chart.y.inside ? 0.75 : 0.5), key);
      y -= 1.0;
    }
    // Names that stand above their dots are not crossed.
    const double every = chart.y.inside ? 1.0 : top - y, gap = chart.y.inside ? 0.55 : 0.0;
    for (double from = top; group.floor && from > y; from -= every) {
      chart.lines.push_back({.name = dots.floor_label,
                             .points = {{*group.floor, from - gap}, {*group.floor, from - every}},
                             .colour = kInk,
                             .width = 1.4,
                             .dashed = true});
    }
  }
  chart.y.low = y;
  chart.y.high = 0.0;
  chart.frame_height = -y * (chart.y.inside ? kNarrowRow : kRow);
  return {std::move(chart)};
}

std::vector<io::Chart> Drawn(const OutcomeChart& table, const std::string& title, const ChartKey&, int width) {
  std::vector<io::Chart> charts;
  const std::size_t columns = ColumnsOf(table, width);
  for (std::size_t first = 0; first < table.methods.size(); first += columns) {
    charts.push_back(TableOf(table, first == 0 ? title : "", width, first, columns));
    if (first + columns < table.methods.size()) charts.back().legend = io::LegendPlace::None;
  }
  return charts;
}

std::string MarksCsv(const ScatterChart& chart) {
  std::string text =
      "name," + QuotedCell(chart.x.label) + ",low,high," + QuotedCell(chart.y.label) + ",low,high,remark\n";
  const auto add = [&](const std::string& name, const ChartMark& mark) {
    text += QuotedCell(name) + Cells(mark.x, mark.x_range) + Cells(mark.y, mark.y_range) + "," + QuotedCell(mark.tip) +
            "\n";
  };
  for (const ChartMark& mark : chart.marks) add(mark.label, mark);
  for (const ChartLine& line : chart.lines) {
    if (line.steps) continue;
    for (const ChartMark& mark : line.marks) add(line.label, mark);
  }
  return text;
}

std::string MarksCsv(const DotChart& chart) {
  std::string text = "group,name," + QuotedCell(chart.x.label) + ",low,high,remark\n";
  for (const DotGroup& group : chart.groups) {
    for (const DotRow& row : group.rows) {
      for (const DotMark& mark : row.marks) {
        text += QuotedCell(group.name) + "," + QuotedCell(row.name) + Cells(mark.estimate.middle, mark.estimate) + "," +
                QuotedCell(mark.tip) + "\n";
      }
    }
  }
  return text;
}

std::string MarksCsv(const OutcomeChart& chart) {
  std::string text = "regime,method,within,off,refused,false\n";
  for (const auto& [regime, cells] : chart.regimes) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (!cells[i]) continue;
      text += QuotedCell(regime) + "," + QuotedCell(chart.methods[i]);
      for (const int count : {cells[i]->within, cells[i]->off, cells[i]->refused, cells[i]->wrong})
        text += "," + std::to_string(count);
      text += "\n";
    }
  }
  return text;
}

}  // namespace lensd::bench
