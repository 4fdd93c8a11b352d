// A chart is laid out once (margins from the widths of its texts), then written element by element, backgrounds first.
// Labels come last: each tries a few places around its anchor and takes the one that covers least.

#include "io/svg.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <tuple>

#include "io/png.h"
#include "io/svg_colours.h"
#include "svg_axis.h"
#include "svg_clip.h"
#include "svg_draw.h"
#include "svg_painter.h"

namespace lensd::io {
namespace {

constexpr double kTitlePx = 17.0;
constexpr double kTitleRowPx = 22.0, kSubtitleRowPx = 18.0, kAxisTitlePx = 13.5, kAxisTitleRowPx = 17.0;
constexpr double kEdgePx = 14.0, kInsideEdgePx = 2.0;  // that of a frame with names inside is narrow
constexpr double kSwatchPx = 22.0;
constexpr double kLegendRowPx = 19.0;
constexpr double kLegendGapPx = 18.0;
constexpr double kCaptionRowPx = 17.0;
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
  placer_ = LabelPlacer(plot_);
}

std::string Painter::Paint() {
  svg_ = "<rect width=\"" + Number(chart_.width) + "\" height=\"" + Number(height_) + "\" fill=\"#ffffff\"/>\n";
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
  for (const Label& label : labels_) svg_ += placer_.Place(label);
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
    AddEntry(bar.name, fill(bar.colour, bar.opacity, FillOf(bar)));
  }
  for (std::size_t i = 0; i < chart_.lines.size(); ++i) {
    const ChartLine& line = chart_.lines[i];
    AddEntry(line.name, [&line, colour = LineColour(i)](Pixel at) {
      return DrawLine(at, {at.x + kSwatchPx, at.y}, colour, line.width, line.dashed) +
             (line.markers ? DrawMarker({at.x + 0.5 * kSwatchPx, at.y}, line.marker, kLineMarkerPx, colour) : "");
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

/// From the legend's first entry on: below each other at the right, as many a row as fit below the chart.
std::vector<Pixel> Painter::LegendPlaces() const {
  std::vector<Pixel> places;
  const double room = LegendAt(LegendPlace::Below) ? chart_.width - kEdgePx - titles_.left : 0.0;
  Pixel at{};
  for (const LegendEntry& entry : legend_) {
    const double width = kSwatchPx + 7.0 + TextWidth(entry.name);
    if (at.x > 0.0 && at.x + width > room) at = {0.0, at.y + kLegendRowPx};
    places.push_back(at);
    at.x += width + kLegendGapPx;
  }
  return places;
}

void Painter::LayOut() {
  double widest = 0.0;
  if (!chart_.y.inside) {
    for (const Tick& tick : y_.Ticks(7)) widest = std::max(widest, TextWidth(tick.label) + 8.0);
  }
  plot_.left = (chart_.y.inside ? kInsideEdgePx : kEdgePx + widest) + (chart_.y.label.empty() ? 0.0 : 20.0);
  plot_.right = chart_.width - (chart_.y.inside ? kInsideEdgePx : 22.0);
  if (LegendAt(LegendPlace::Right)) plot_.right -= LegendEntryWidth() + kLegendGapPx;
  double remarks = 0.0;
  for (const auto& [at, text] : chart_.remarks) remarks = std::max(remarks, TextWidth(text));
  if (!chart_.y.inside) plot_.right -= remarks;
  x_.SetPixels(plot_.left, plot_.right);
  LayOutTitles();
  plot_.top = 16.0 + kTitleRowPx * static_cast<double>(titles_.title.size()) +
              kSubtitleRowPx * static_cast<double>(titles_.subtitle.size()) + (titles_.title.empty() ? 0.0 : 2.0);
  double below = 24.0 + (titles_.x.empty() ? 6.0 : 9.0 + kAxisTitleRowPx * static_cast<double>(titles_.x.size())) +
                 SecondLinePx(chart_.x);
  if (LegendAt(LegendPlace::Below)) below += LegendPlaces().back().y + kLegendRowPx + 8.0;
  height_ = chart_.frame_height > 0.0 ? std::ceil(plot_.top + chart_.frame_height + below) : chart_.height;
  plot_.bottom = height_ - below;
  y_.SetPixels(plot_.bottom, plot_.top);
}

/// Titles that are too wide are broken; what is as wide as the chart, also of the legend, begins at its edge.
void Painter::LayOutTitles() {
  const double room = chart_.width - kEdgePx, bold = 1.05;
  double widest = std::max(bold * TextWidth(chart_.title, kTitlePx), TextWidth(chart_.subtitle));
  if (LegendAt(LegendPlace::Below)) widest = std::max(widest, LegendEntryWidth());
  titles_.left = widest <= room - plot_.left ? plot_.left : kEdgePx;
  const auto broken = [&](const std::string& text, double size, double width) {
    return text.empty() ? std::vector<std::string>{} : BrokenLines({text}, width * kTextPx / size);
  };
  titles_.title = broken(chart_.title, bold * kTitlePx, room - titles_.left);
  titles_.subtitle = broken(chart_.subtitle, kTextPx, room - titles_.left);
  if (!chart_.x.label.empty()) titles_.x = broken(AxisTitle(chart_.x), kAxisTitlePx, room - kEdgePx);
}

void Painter::Titles() {
  double y = 6.0;
  for (const std::string& line : titles_.title)
    svg_ += DrawText({titles_.left, y += kTitleRowPx}, line, {.size = kTitlePx, .bold = true});
  for (const std::string& line : titles_.subtitle)
    svg_ += DrawText({titles_.left, y += kSubtitleRowPx}, line, {.colour = "#555555"});
}

void Painter::Grid() {
  const int wanted_x = std::clamp(static_cast<int>((plot_.right - plot_.left) / 85.0), 2, 10);
  const int wanted_y = std::clamp(static_cast<int>((plot_.bottom - plot_.top) / 45.0), 2, 8);
  double free_from[] = {-1e9, -1e9};
  auto ticks = x_.Ticks(wanted_x);
  std::ranges::sort(ticks, {}, &Tick::value);
  for (const Tick& tick : ticks) {
    const double x = x_.Pixel(tick.value);
    svg_ += DrawLine({x, plot_.top}, {x, plot_.bottom}, tick.label.empty() ? kMinorGridColour : kGridColour, 1.0);
    const auto [upper, lower] = TwoLines(tick.label);
    const double half = 0.5 * std::max(TextWidth(upper), TextWidth(lower));
    const double middle = std::clamp(x, 4.0 + half, std::max(4.0 + half, chart_.width - 4.0 - half));
    const auto fits = [&](const std::string& text, double from) { return text.empty() || middle - half >= from + 4.0; };
    if (!fits(upper, free_from[0]) || !fits(lower, free_from[1])) continue;
    for (const auto& [text, line, colour] : {std::tuple{&upper, 0, kInk}, {&lower, 1, "#555555"}}) {
      if (text->empty()) continue;
      svg_ += DrawText({middle, plot_.bottom + 18.0 + 15.0 * line}, *text, {.colour = colour, .anchor = "middle"});
      free_from[line] = middle + half;
    }
  }
  TickLabelsOfY(wanted_y);
}

void Painter::TickLabelsOfY(int wanted) {
  const bool inside = chart_.y.inside;
  for (const Tick& tick : y_.Ticks(wanted)) {
    const double y = y_.Pixel(tick.value);
    svg_ += DrawLine({plot_.left, y}, {plot_.right, y}, tick.label.empty() ? kMinorGridColour : kGridColour, 1.0);
    if (tick.label.empty()) continue;
    svg_ += inside ? DrawText({plot_.left + 4.0, y - 9.0}, tick.label, {.halo = true})
                   : DrawText({plot_.left - 8.0, y + 4.3}, tick.label, {.anchor = "end"});
  }
  for (const auto& [at, text] : chart_.remarks) {
    const double y = y_.Pixel(at);
    svg_ += inside ? DrawText({plot_.right - 4.0, y - 9.0}, text, {.anchor = "end", .halo = true})
                   : DrawText({plot_.right + 8.0, y + 4.3}, text);
  }
}

void Painter::Frame() {
  svg_ += "<rect x=\"" + Number(plot_.left) + "\" y=\"" + Number(plot_.top) + "\" width=\"" +
          Number(plot_.right - plot_.left) + "\" height=\"" + Number(plot_.bottom - plot_.top) +
          "\" fill=\"none\" stroke=\"#444444\"/>\n";
  const double middle_y = 0.5 * (plot_.top + plot_.bottom);
  double y = plot_.bottom + 23.0 + SecondLinePx(chart_.x);
  for (const std::string& line : titles_.x) {
    const double half = 0.5 * TextWidth(line, kAxisTitlePx);
    const double middle = std::clamp(0.5 * (plot_.left + plot_.right), std::min(half, 0.5 * chart_.width),
                                     std::max(chart_.width - half, 0.5 * chart_.width));
    svg_ += DrawText({middle, y += kAxisTitleRowPx}, line, {.size = kAxisTitlePx, .anchor = "middle"});
  }
  if (!chart_.y.label.empty()) {
    svg_ +=
        DrawText({20.0, middle_y}, AxisTitle(chart_.y), {.size = kAxisTitlePx, .anchor = "middle", .rotate = -90.0});
  }
}

void Painter::PaintLegend() {
  if (legend_.empty() || chart_.legend == LegendPlace::None) return;
  const std::vector<Pixel> places = LegendPlaces();
  const bool right = chart_.legend == LegendPlace::Right;
  const Pixel first = right ? Pixel{plot_.right + kLegendGapPx, plot_.top + 10.0}
                            : Pixel{titles_.left, height_ - kLegendRowPx - places.back().y + 4.0};
  for (std::size_t i = 0; i < legend_.size(); ++i) {
    const Pixel at{first.x + places[i].x, first.y + places[i].y};
    svg_ += legend_[i].swatch(at);
    svg_ += DrawText({at.x + kSwatchPx + 7.0, at.y + 4.3}, legend_[i].name);
  }
}

namespace {

std::string Document(double width, double height, const std::string& title, const std::string& body) {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + Number(width) + "\" height=\"" + Number(height) +
         "\" viewBox=\"0 0 " + Number(width) + " " + Number(height) + "\" role=\"img\" aria-label=\"" + Escaped(title) +
         "\" font-family=\"Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif\">\n<rect width=\"100%\" "
         "height=\"100%\" fill=\"#ffffff\"/>\n" +
         body + "</svg>\n";
}

/// The chart and its height, once it has grown as far as it must.
std::pair<std::string, double> Painted(Chart chart, std::size_t index) {
  const double most = 5.0 * chart.frame_height;
  for (;; chart.frame_height *= 1.15) {
    Painter painter(chart, index);
    std::string svg = painter.Paint();
    if (!painter.crowded() || 1.15 * chart.frame_height >= most) return {std::move(svg), painter.height()};
  }
}

}  // namespace

double ChartTextWidth(const std::string& text) {
  return TextWidth(text);
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
    const auto [svg, height] = Painted(charts[i], i);
    body += "<g transform=\"translate(" + Number(x) + " " + Number(y) + ")\">\n" + svg + "</g>\n";
    x += charts[i].width;
    width = std::max(width, x);
    row_height = std::max(row_height, height);
  }
  y += row_height;
  const std::vector<std::string> lines = BrokenLines(captions, width - 2.0 * kEdgePx);
  for (const std::string& line : lines) body += DrawText({kEdgePx, y += kCaptionRowPx}, line);
  return Document(width, y + (lines.empty() ? 0.0 : kEdgePx), charts.empty() ? "" : charts.front().title, body);
}

Result<void> WriteSvg(const std::string& path, const std::string& svg) {
  const std::string text = InTheme(svg, Theme::Viewer);
  return WriteFileAtomically(path, text.data(), text.size());
}

}  // namespace lensd::io
