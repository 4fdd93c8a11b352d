// Regimes down, methods across, in each cell a bar of how the runs ended with the interval of those that ended well.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "bench/report/chart.h"

namespace lensd::bench {
namespace {

constexpr double kCell = 24.0;  // px, height
constexpr double kNarrowest = 46.0;

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

void DrawCell(Drawing& drawing, const Box& cell, const std::string& tip, const Outcomes& outcomes) {
  const Box bar{cell.x + 2, cell.y + 4, cell.width - 4, cell.height - 8};
  double at = bar.x;
  // Lies stand out by more than their colour.
  const auto part = [&](int count, const char* style, double taller = 0.0) {
    if (count == 0) return;
    const double wide = bar.width * count / outcomes.runs();
    drawing.Rect({at, bar.y - taller, wide, bar.height + 2 * taller}, style, tip);
    at += wide;
  };
  part(outcomes.within, "within");
  part(outcomes.off, "off");
  part(outcomes.refused, "refused");
  part(outcomes.wrong, "false", 3.0);
  const Estimate share = ShareOf(outcomes.right_is_refusal ? outcomes.refused : outcomes.within, outcomes.runs());
  const double y = bar.bottom() + 2;
  drawing.Line(bar.x + bar.width * share.low, y, bar.x + bar.width * share.high, y, "interval");
}

double NamesWidth(const OutcomeChart& chart) {
  double width = 0.0;
  for (const auto& [name, cells] : chart.regimes) width = std::max(width, TextWidth(name, kTextSize) + 8);
  return width;
}

/// Names of methods stand on slanted ground on a narrow screen: they take turns on two or more lines instead.
int LinesOfNames(const std::vector<std::string>& names, double cell) {
  double widest = 0.0;
  for (const std::string& name : names) widest = std::max(widest, TextWidth(name, kTextSize) + 6);
  return std::max(1, static_cast<int>(std::ceil(widest / cell)));
}

}  // namespace

Drawing Draw(const OutcomeChart& chart, double width) {
  Drawing drawing(width);
  const double names = NamesWidth(chart);
  const double room = width - names - 4;
  const auto fit = static_cast<std::size_t>(std::max(1.0, std::floor(room / kNarrowest)));
  const std::size_t columns = std::min(fit, chart.methods.size());
  double y = 4.0;
  // Where not all methods fit beside each other, the table goes on below.
  for (std::size_t first = 0; first < chart.methods.size(); first += columns) {
    const std::size_t last = std::min(first + columns, chart.methods.size());
    const double cell = std::min(room / static_cast<double>(columns), 110.0);
    const std::vector<std::string> shown(chart.methods.begin() + static_cast<std::ptrdiff_t>(first),
                                         chart.methods.begin() + static_cast<std::ptrdiff_t>(last));
    const int lines = LinesOfNames(shown, cell);
    for (std::size_t i = 0; i < shown.size(); ++i) {
      const int line = static_cast<int>(i) % lines;
      const double half = 0.5 * TextWidth(shown[i], kTextSize);
      const double middle = std::min(names + (static_cast<double>(i) + 0.5) * cell, width - half - 2);
      const double at = y + kLineHeight * (line + 0.5);
      drawing.Text(middle, at, shown[i], Align::Middle, "t d");
      if (lines > 1)
        drawing.Line(names + (static_cast<double>(i) + 0.5) * cell, at + 7,
                     names + (static_cast<double>(i) + 0.5) * cell, y + kLineHeight * lines + 2, "leader");
    }
    y += kLineHeight * lines + 3;
    for (const auto& [regime, cells] : chart.regimes) {
      drawing.Text(names - 6, y + 0.5 * kCell, regime, Align::End);
      for (std::size_t i = first; i < last; ++i) {
        if (!cells[i]) continue;
        const Box box{names + static_cast<double>(i - first) * cell, y, cell, kCell};
        DrawCell(drawing, box, TipOf(regime, chart.methods[i], *cells[i]), *cells[i]);
      }
      y += kCell;
    }
    y += 14;
  }
  drawing.SetHeight(y);
  return drawing;
}

}  // namespace lensd::bench
