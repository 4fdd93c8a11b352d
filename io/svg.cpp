// A chart is laid out once (margins from the widths of its texts), then written element by element, backgrounds first.
// Labels come last: each tries a few places around its anchor and takes the one that covers least.

#include "io/svg.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "io/png.h"
#include "svg_axis.h"
#include "svg_clip.h"
#include "svg_draw.h"
#include "svg_painter.h"

namespace lensd::io {
namespace {

constexpr double kTitlePx = 17.0;
constexpr double kSwatchPx = 22.0;
constexpr double kLegendRowPx = 19.0;
constexpr double kLegendGapPx = 18.0;
constexpr double kCaptionRowPx = 17.0;
constexpr double kCaptionEdgePx = 14.0;
constexpr const char* kGridColour = "#e4e4e4";
constexpr const char* kMinorGridColour = "#f2f2f2";

constexpr const char* kPalette[] = {"#0072b2", "#d55e00", "#009e73", "#b0479a",
                                    "#b8860b", "#3a9bd9", "#6b6b6b", "#8c3b2a"};

std::string AxisTitle(const Axis& axis) {
  return axis.unit.empty() ? axis.label : axis.label + " [" + axis.unit + "]";
}

/// Everything the chart shows, as points: what automatic axis ends must enclose. Missing coordinates are NaN.
std::vector<ChartPoint> Extremes(const Chart& chart) {
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  std::vector<ChartPoint> all;
  for (const auto& line : chart.lines) all.insert(all.end(), line.points.begin(), line.points.end());
  for (const auto& area : chart.areas) all.insert(all.end(), area.corners.begin(), area.corners.end());
  for (const auto& points : chart.points) {
    for (const auto& point : points.points) all.push_back(point.at);
  }
  for (const auto& bar : chart.bars) {
    all.push_back({bar.x_low.value_or(nothing), bar.y_low.value_or(nothing)});
    all.push_back({bar.x_high.value_or(nothing), bar.y_high.value_or(nothing)});
  }
  for (const auto& rule : chart.rules) all.push_back({rule.x.value_or(nothing), rule.y.value_or(nothing)});
  for (const auto& interval : chart.intervals) {
    for (const double end : {interval.low, interval.high}) {
      all.push_back(interval.along_x ? ChartPoint{end, interval.at.y} : ChartPoint{interval.at.x, end});
    }
  }
  for (const auto& note : chart.notes) all.push_back(note.at);
  return all;
}

/// A tick label in its one or two lines.
std::pair<std::string, std::string> TwoLines(const std::string& label) {
  const auto end = label.find('\n');
  if (end == std::string::npos) return {label, ""};
  return {label.substr(0, end), label.substr(end + 1)};
}

/// Room that second lines of the x axis's own ticks take.
double SecondLinePx(const Axis& axis) {
  const bool two = std::ranges::any_of(axis.ticks, [](const auto& tick) { return tick.second.contains('\n'); });
  return two ? 15.0 : 0.0;
}

AxisMap MapOf(const Axis& axis, const std::vector<ChartPoint>& points, double ChartPoint::* coordinate) {
  std::vector<double> data;
  for (const ChartPoint& point : points) data.push_back(point.*coordinate);
  return AxisMap(axis, std::move(data));
}

}  // namespace

Painter::Painter(const Chart& chart, std::size_t index)
    : chart_(chart),
      id_(std::to_string(index)),
      x_(MapOf(chart.x, Extremes(chart), &ChartPoint::x)),
      y_(MapOf(chart.y, Extremes(chart), &ChartPoint::y)) {
  CollectLegend();
  LayOut();
}

std::string Painter::Paint() {
  svg_ = "<rect width=\"" + Number(chart_.width) + "\" height=\"" + Number(chart_.height) + "\" fill=\"#ffffff\"/>\n";
  Titles();
  Grid();
  for (const ChartArea& area : chart_.areas) PaintArea(area);
  for (const ChartBar& bar : chart_.bars) PaintBar(bar);
  Frame();
  for (const ChartRule& rule : chart_.rules) PaintRule(rule);
  for (std::size_t i = 0; i < chart_.lines.size(); ++i) PaintLine(chart_.lines[i], LineColour(i));
  for (const ChartInterval& interval : chart_.intervals) PaintInterval(interval);
  for (std::size_t i = 0; i < chart_.points.size(); ++i) PaintPoints(chart_.points[i], PointsColour(i));
  for (const ChartNote& note : chart_.notes) AddNote(note);
  LabelPlacer placer(plot_);
  for (const Box& box : blocked_) placer.Block(box);
  for (const Label& label : labels_) svg_ += placer.Place(label);
  PaintLegend();
  return svg_;
}

void Painter::CollectLegend() {
  const auto fill = [this](const std::string& colour, double opacity, Fill pattern) {
    return [=, this](Pixel at) {
      return Filled({at.x, at.y - 6.0, at.x + kSwatchPx, at.y + 6.0}, FillColour(colour), opacity, pattern);
    };
  };
  for (const ChartArea& area : chart_.areas) AddEntry(area.name, fill(area.colour, area.opacity, Fill::Plain));
  for (const ChartBar& bar : chart_.bars) {
    AddEntry(bar.name, fill(bar.colour, bar.opacity, bar.hatched ? Fill::Hatched : Fill::Plain));
  }
  for (std::size_t i = 0; i < chart_.lines.size(); ++i) {
    const ChartLine& line = chart_.lines[i];
    AddEntry(line.name, [&line, colour = LineColour(i)](Pixel at) {
      return DrawLine(at, {at.x + kSwatchPx, at.y}, colour, line.width, line.dashed) +
             (line.markers ? DrawMarker({at.x + 0.5 * kSwatchPx, at.y}, Marker::Dot, 3.2, colour) : "");
    });
  }
  for (std::size_t i = 0; i < chart_.points.size(); ++i) {
    const ChartPoints& points = chart_.points[i];
    AddEntry(points.name, [&points, colour = PointsColour(i)](Pixel at) {
      return DrawMarker({at.x + 0.5 * kSwatchPx, at.y}, points.marker, points.size, colour);
    });
  }
}

double Painter::LegendEntryWidth() const {
  double width = 0.0;
  for (const LegendEntry& entry : legend_) width = std::max(width, TextWidth(entry.name));
  return kSwatchPx + 7.0 + width;
}

std::size_t Painter::LegendColumns() const {
  const double room = chart_.width - 40.0;
  return std::max<std::size_t>(1, static_cast<std::size_t>(room / (LegendEntryWidth() + kLegendGapPx)));
}

void Painter::LayOut() {
  plot_.top = 16.0 + (chart_.title.empty() ? 0.0 : 24.0) + (chart_.subtitle.empty() ? 0.0 : 18.0);
  plot_.bottom = chart_.height - 24.0 - (chart_.x.label.empty() ? 6.0 : 26.0) - SecondLinePx(chart_.x);
  if (LegendAt(LegendPlace::Below)) {
    const std::size_t rows = (legend_.size() - 1) / LegendColumns() + 1;
    plot_.bottom -= kLegendRowPx * static_cast<double>(rows) + 8.0;
  }
  y_.SetPixels(plot_.bottom, plot_.top);
  double widest = 0.0;
  for (const Tick& tick : y_.Ticks(7)) widest = std::max(widest, TextWidth(tick.label));
  plot_.left = 14.0 + widest + 8.0 + (chart_.y.label.empty() ? 0.0 : 20.0);
  plot_.right = chart_.width - 22.0;
  if (LegendAt(LegendPlace::Right)) plot_.right -= LegendEntryWidth() + kLegendGapPx;
  x_.SetPixels(plot_.left, plot_.right);
}

void Painter::Titles() {
  double y = 16.0;
  if (!chart_.title.empty()) {
    y += 12.0;
    svg_ += DrawText({plot_.left, y}, chart_.title, {.size = kTitlePx, .bold = true});
    y += 18.0;
  }
  if (!chart_.subtitle.empty()) svg_ += DrawText({plot_.left, y}, chart_.subtitle, {.colour = "#555555"});
}

void Painter::Grid() {
  const int wanted_x = std::clamp(static_cast<int>((plot_.right - plot_.left) / 85.0), 2, 10);
  const int wanted_y = std::clamp(static_cast<int>((plot_.bottom - plot_.top) / 45.0), 2, 8);
  double last_end = -1e9;
  auto ticks = x_.Ticks(wanted_x);
  std::ranges::sort(ticks, {}, &Tick::value);
  for (const Tick& tick : ticks) {
    const double x = x_.Pixel(tick.value);
    svg_ += DrawLine({x, plot_.top}, {x, plot_.bottom}, tick.label.empty() ? kMinorGridColour : kGridColour, 1.0);
    const auto [upper, lower] = TwoLines(tick.label);
    const double half = 0.5 * std::max(TextWidth(upper), TextWidth(lower));
    if (tick.label.empty() || x - half < last_end + 4.0) continue;
    const double middle = std::min(x, chart_.width - 4.0 - half);
    svg_ += DrawText({middle, plot_.bottom + 18.0}, upper, {.anchor = "middle"});
    if (!lower.empty())
      svg_ += DrawText({middle, plot_.bottom + 33.0}, lower, {.colour = "#555555", .anchor = "middle"});
    last_end = middle + half;
  }
  for (const Tick& tick : y_.Ticks(wanted_y)) {
    const double y = y_.Pixel(tick.value);
    svg_ += DrawLine({plot_.left, y}, {plot_.right, y}, tick.label.empty() ? kMinorGridColour : kGridColour, 1.0);
    if (!tick.label.empty()) svg_ += DrawText({plot_.left - 8.0, y + 4.3}, tick.label, {.anchor = "end"});
  }
}

void Painter::Frame() {
  svg_ += "<rect x=\"" + Number(plot_.left) + "\" y=\"" + Number(plot_.top) + "\" width=\"" +
          Number(plot_.right - plot_.left) + "\" height=\"" + Number(plot_.bottom - plot_.top) +
          "\" fill=\"none\" stroke=\"#444444\"/>\n";
  const double middle_x = 0.5 * (plot_.left + plot_.right), middle_y = 0.5 * (plot_.top + plot_.bottom);
  if (!chart_.x.label.empty()) {
    svg_ += DrawText({middle_x, plot_.bottom + 40.0 + SecondLinePx(chart_.x)}, AxisTitle(chart_.x),
                     {.size = 13.5, .anchor = "middle"});
  }
  if (!chart_.y.label.empty()) {
    svg_ += DrawText({20.0, middle_y}, AxisTitle(chart_.y), {.size = 13.5, .anchor = "middle", .rotate = -90.0});
  }
}

void Painter::PaintLegend() {
  if (legend_.empty() || chart_.legend == LegendPlace::None) return;
  const bool right = chart_.legend == LegendPlace::Right;
  const std::size_t columns = right ? 1 : LegendColumns();
  const double step = LegendEntryWidth() + kLegendGapPx;
  const double left = right ? plot_.right + kLegendGapPx : plot_.left;
  double y = right ? plot_.top + 10.0 : plot_.bottom + SecondLinePx(chart_.x) + (chart_.x.label.empty() ? 36.0 : 62.0);
  for (std::size_t i = 0; i < legend_.size(); ++i) {
    const Pixel at{left + step * static_cast<double>(i % columns), y};
    svg_ += legend_[i].swatch(at);
    svg_ += DrawText({at.x + kSwatchPx + 7.0, at.y + 4.3}, legend_[i].name);
    if ((i + 1) % columns == 0) y += kLegendRowPx;
  }
}

namespace {

std::string Document(double width, double height, const std::string& body) {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + Number(width) + "\" height=\"" + Number(height) +
         "\" viewBox=\"0 0 " + Number(width) + " " + Number(height) +
         "\" font-family=\"Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif\">\n<rect width=\"100%\" "
         "height=\"100%\" fill=\"#ffffff\"/>\n" +
         body + "</svg>\n";
}

}  // namespace

std::string PaletteColour(std::size_t index) {
  return kPalette[index % std::size(kPalette)];
}

std::string ChartSvg(const Chart& chart) {
  return ChartsSvg({chart}, 1, chart.captions);
}

std::string ChartsSvg(const std::vector<Chart>& charts, int columns, const std::vector<std::string>& captions) {
  const auto in_a_row = static_cast<std::size_t>(std::max(columns, 1));
  double x = 0.0, y = 0.0, width = 0.0, row_height = 0.0;
  std::string body;
  for (std::size_t i = 0; i < charts.size(); ++i) {
    if (i > 0 && i % in_a_row == 0) {
      y += std::exchange(row_height, 0.0);
      x = 0.0;
    }
    body +=
        "<g transform=\"translate(" + Number(x) + " " + Number(y) + ")\">\n" + Painter(charts[i], i).Paint() + "</g>\n";
    x += charts[i].width;
    width = std::max(width, x);
    row_height = std::max(row_height, static_cast<double>(charts[i].height));
  }
  y += row_height;
  const std::vector<std::string> lines = BrokenLines(captions, width - 2.0 * kCaptionEdgePx);
  for (const std::string& line : lines) body += DrawText({kCaptionEdgePx, y += kCaptionRowPx}, line);
  return Document(width, y + (lines.empty() ? 0.0 : kCaptionEdgePx), body);
}

Result<void> WriteSvg(const std::string& path, const std::string& svg) {
  return WriteFileAtomically(path, svg.data(), svg.size());
}

}  // namespace lensd::io
