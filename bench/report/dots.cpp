// Names down, figures across: dots with intervals on one axis.
#include <algorithm>
#include <cmath>

#include "bench/report/axis.h"
#include "bench/report/chart.h"

namespace lensd::bench {
namespace {

constexpr double kRow = 22.0;        // px
constexpr double kNarrowRow = 36.0;  // with the name above its dot

struct DotLayout {
  bool narrow = false;
  double names = 0.0;    ///< px to the left for them; 0 where they stand above
  double figures = 0.0;  ///< px to the right
  double row = kRow;
};

DotLayout LayoutOf(const DotChart& chart, double width) {
  DotLayout layout;
  for (const DotGroup& group : chart.groups) {
    for (const DotRow& row : group.rows) {
      layout.names = std::max(layout.names, TextWidth(row.name, kTextSize) + 10);
      layout.figures = std::max(layout.figures, TextWidth(row.figure, kTextSize) + 12);
    }
  }
  layout.narrow = layout.names + layout.figures > 0.55 * width;
  if (layout.narrow) {
    layout.names = 8.0;
    layout.row = kNarrowRow;
  }
  return layout;
}

std::vector<double> ValuesOf(const DotChart& chart) {
  std::vector<double> values;
  for (const DotGroup& group : chart.groups) {
    if (group.floor) values.push_back(*group.floor);
    for (const DotRow& row : group.rows) {
      for (const DotMark& mark : row.marks) {
        values.insert(values.end(), {mark.estimate.low, mark.estimate.middle, mark.estimate.high});
      }
    }
  }
  return values;
}

void DrawRow(Drawing& drawing, const DotRow& row, const Scale& scale, double y, const DotLayout& layout) {
  const double dot = layout.narrow ? y + 9 : y;
  if (layout.narrow)
    drawing.Text(2, y - 9, row.name, Align::Start, "t d");
  else
    drawing.Text(layout.names - 8, y, row.name, Align::End);
  for (const DotMark& mark : row.marks) {
    drawing.Line(scale.Px(mark.estimate.low), dot, scale.Px(mark.estimate.high), dot,
                 "i l" + std::to_string(mark.series % kSeries));
  }
  for (const DotMark& mark : row.marks) drawing.Mark(scale.Px(mark.estimate.middle), dot, mark.series, mark.tip);
  drawing.Text(drawing.width() - 2, layout.narrow ? y - 9 : y, row.figure, Align::End);
}

/// Ticks and the axis' name below `bottom`; returns the height then.
double DrawFoot(Drawing& drawing, const DotChart& chart, const Scale& scale, double top, double bottom) {
  double free_from = 0.0;
  for (const auto& [value, text] : scale.Ticks(70.0)) {
    const double x = scale.Px(value), half = 0.5 * TextWidth(text, kTextSize);
    drawing.Line(x, top, x, bottom, "grid");
    const double middle = std::clamp(x, half + 1, drawing.width() - half - 1);
    if (middle - half < free_from) continue;
    drawing.Text(middle, bottom + 12, text, Align::Middle);
    free_from = middle + half + 4;
  }
  double y = bottom + 12 + kLineHeight + 2;
  std::string label = chart.x.label;
  if (!chart.floor_label.empty()) label += "; dashed: " + chart.floor_label;
  for (const std::string& line : WrappedText(label, drawing.width() - 12)) {
    drawing.Text(0.5 * drawing.width(), y, line, Align::Middle, "t a");
    y += kLineHeight;
  }
  return y - 0.5 * kLineHeight + 4;
}

}  // namespace

Drawing Draw(const DotChart& chart, double width) {
  const DotLayout layout = LayoutOf(chart, width);
  Drawing drawing(width);
  Scale scale(chart.x, ValuesOf(chart));
  const double right = layout.narrow ? width - 10 : width - layout.figures;
  scale.Lay(layout.names + 4, right - 4);
  double bottom = 6.0;
  for (const DotGroup& group : chart.groups) {
    bottom += (group.name.empty() ? 0.0 : kRow) + layout.row * static_cast<double>(group.rows.size()) + 6;
  }
  drawing.SetHeight(DrawFoot(drawing, chart, scale, 4, bottom));
  double y = 4.0;
  for (const DotGroup& group : chart.groups) {
    if (!group.name.empty()) {
      drawing.Text(2, y + 0.5 * kRow, group.name, Align::Start, "t h");
      y += kRow;
    }
    const double rows = layout.row * static_cast<double>(group.rows.size());
    for (double at = y; group.floor && at < y + rows - 1; at += layout.row) {
      // Names that stand above their dots are not crossed.
      drawing.Line(scale.Px(*group.floor), layout.narrow ? at + 0.5 * layout.row : at, scale.Px(*group.floor),
                   at + layout.row, "floor");
    }
    for (const DotRow& row : group.rows) {
      DrawRow(drawing, row, scale, y + 0.5 * layout.row, layout);
      y += layout.row;
    }
    y += 6;
  }
  return drawing;
}

}  // namespace lensd::bench
