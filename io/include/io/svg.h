// Charts as SVG text: axes with units, lines, areas, points, bars, notes and a legend, on a white ground, in one
// self-contained file. Describe a Chart, then call ChartSvg; the layout (margins, ticks, legend, clipping) is its own.
//
//   io::Chart chart;
//   chart.title = "Blur against distance";
//   chart.x = {.label = "distance", .unit = "m", .scale = io::Scale::Log};
//   chart.y = {.label = "blur diameter", .unit = "px", .low = 0.0};
//   chart.lines.push_back({.name = "planned", .points = {{1.0, 3.2}, {2.0, 0.1}}});
//   auto done = io::WriteSvg("blur.svg", io::ChartSvg(chart));
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"

namespace lensd::io {

/// A place in the chart, in the units of its axes. Points that are not finite (or not > 0 on a log axis) break a line
/// and are left out elsewhere; nothing beyond ±1e100 widens an axis.
struct ChartPoint {
  double x = 0.0;
  double y = 0.0;
};

enum class Scale { Linear, Log };

/// One axis. Ends that are not given enclose the data (linear ends widen to whole ticks). Labels of own ticks on the x
/// axis may have a second line after a newline; those on the y axis stand above their lines inside the frame where
/// `inside` is set, for narrow charts with long names.
struct Axis {
  std::string label = {};
  std::string unit = {};  ///< shown in brackets after the label; empty: a plain number
  Scale scale = Scale::Linear;
  std::optional<double> low = {};
  std::optional<double> high = {};
  std::vector<std::pair<double, std::string>> ticks = {};  ///< own ticks; empty: chosen
  bool inside = false;                                     ///< y only
};

/// Colours that stay apart for colour-blind readers; names "#rrggbb" may be given instead wherever a colour is asked.
/// Colour `index` of the palette, wrapping around.
std::string PaletteColour(std::size_t index);

enum class Marker { Dot, Ring, Square, Diamond, Triangle, Cross };

/// A polyline, drawn over areas and bars. Empty colours take the palette in the order of `lines`.
struct ChartLine {
  std::string name = {};  ///< in the legend; empty: not there
  std::vector<ChartPoint> points = {};
  std::string colour = {};
  double width = 1.8;  ///< px
  bool dashed = false;
  bool markers = false;  ///< one on every point
  Marker marker = Marker::Dot;
  std::vector<std::string> tips = {};  ///< shown under the pointer, point by point; empty: none
  std::string label = {};              ///< written along the line's last visible end, in its colour
};

/// A filled polygon, drawn first.
struct ChartArea {
  std::string name = {};
  std::vector<ChartPoint> corners = {};
  std::string colour = {};
  double opacity = 0.18;  ///< of the fill
  bool outlined = false;
};

/// Points with or without labels, drawn last. Labels keep clear of each other where there is room.
struct ChartPoints {
  struct Labelled {
    ChartPoint at = {};
    std::string label = {};
    std::string tip = {};  ///< shown under the pointer
  };
  std::string name = {};
  std::vector<Labelled> points = {};
  std::string colour = {};
  Marker marker = Marker::Dot;
  double size = 4.0;  ///< radius in px
};

/// A rectangle from `low` to `high` on both axes (an end that is not given reaches the frame): intervals, limits,
/// histogram bars. The label stands inside it.
struct ChartBar {
  std::string name = {};
  std::optional<double> x_low = {}, x_high = {}, y_low = {}, y_high = {};
  std::string colour = {};
  double opacity = 0.15;
  std::string label = {};
  bool hatched = false;  ///< slanted lines: "must not enter"
  std::string tip = {};  ///< shown under the pointer
  bool outlined = false;
};

/// An interval with caps at `at`: an error bar along y (or along x where `along_x`).
struct ChartInterval {
  ChartPoint at = {};
  double low = 0.0, high = 0.0;
  std::string colour = {};
  bool along_x = false;
};

/// A straight line across the whole frame, with a label at its end.
struct ChartRule {
  std::optional<double> x = {}, y = {};  ///< exactly one of them
  std::string label = {};
  std::string colour = "#777777";
  bool dashed = true;
};

/// A remark beside a place, with a thin leader line to it where `dx`, `dy` (px, y downward) move it away.
struct ChartNote {
  ChartPoint at = {};
  std::string text = {};
  double dx = 0.0, dy = 0.0;
  std::string colour = "#333333";
};

enum class LegendPlace { Right, Below, None };

/// One chart.
struct Chart {
  std::string title = {};
  std::string subtitle = {};
  Axis x = {};
  Axis y = {};
  std::vector<ChartArea> areas = {};
  std::vector<ChartBar> bars = {};
  std::vector<ChartRule> rules = {};
  std::vector<ChartLine> lines = {};
  std::vector<ChartInterval> intervals = {};
  std::vector<ChartPoints> points = {};
  std::vector<ChartNote> notes = {};
  std::vector<std::pair<double, std::string>> remarks = {};  ///< at the right of the frame, each at its y
  std::vector<std::string> captions = {};   ///< paragraphs that ChartSvg() writes below, beyond `height`
  LegendPlace legend = LegendPlace::Right;  ///< drawn only where something has a name
  int width = 860;                          ///< px
  int height = 480;                         ///< px
  /// px of the frame alone, and `height` does not count; it grows, at most fivefold, until no label covers another.
  double frame_height = 0.0;
};

/// `text` as it may stand in elements and attributes of SVG and HTML.
std::string Escaped(const std::string& text);

/// px, at least as wide as this text is in a chart.
double ChartTextWidth(const std::string& text);

/// The chart as a complete SVG document (UTF-8). Never contains NaN or infinity.
std::string ChartSvg(const Chart& chart);

/// Charts side by side in `columns` columns as one document, in reading order, and below them `captions`: paragraphs,
/// broken into lines where they must be. Captions of the charts themselves are not written.
std::string ChartsSvg(const std::vector<Chart>& charts, int columns, const std::vector<std::string>& captions = {});

/// Writes the document, dark where its viewer prefers that, through a temporary file and a rename. Code::Io.
Result<void> WriteSvg(const std::string& path, const std::string& svg);

}  // namespace lensd::io
