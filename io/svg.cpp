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

namespace lensd::io {
namespace {

constexpr double kTitlePx = 17.0;
constexpr double kSwatchPx = 22.0;
constexpr double kLegendRowPx = 19.0;
constexpr double kLegendGapPx = 18.0;
constexpr const char* kGridColour = "#e4e4e4";
constexpr const char* kMinorGridColour = "#f2f2f2";

constexpr const char* kPalette[] = {"#0072b2", "#d55e00", "#009e73", "#b0479a",
                                    "#b8860b", "#3a9bd9", "#6b6b6b", "#8c3b2a"};

struct LegendEntry {
  std::string name;
  std::function<std::string(Pixel)> swatch;  // kSwatchPx wide, from x on, centred on y
};

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

/// One chart on its way to text.
class Painter {
 public:
  Painter(const Chart& chart, std::size_t index)
      : chart_(chart),
        id_(std::to_string(index)),
        x_(MapOf(chart.x, Extremes(chart), &ChartPoint::x)),
        y_(MapOf(chart.y, Extremes(chart), &ChartPoint::y)) {
    CollectLegend();
    LayOut();
  }

  std::string Paint() {
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

 private:
  std::string LineColour(std::size_t index) const {
    const std::string& own = chart_.lines[index].colour;
    return own.empty() ? PaletteColour(index) : own;
  }
  std::string PointsColour(std::size_t index) const {
    const std::string& own = chart_.points[index].colour;
    return own.empty() ? PaletteColour(chart_.lines.size() + index) : own;
  }
  static std::string FillColour(const std::string& own) { return own.empty() ? PaletteColour(0) : own; }

  Pixel At(const ChartPoint& point) const { return {x_.Pixel(point.x), y_.Pixel(point.y)}; }
  bool InPlot(const Pixel& at) const {
    return at.x >= plot_.left - 0.5 && at.x <= plot_.right + 0.5 && at.y >= plot_.top - 0.5 &&
           at.y <= plot_.bottom + 0.5;
  }

  void AddEntry(const std::string& name, std::function<std::string(Pixel)> swatch) {
    const bool known = std::ranges::find(legend_, name, &LegendEntry::name) != legend_.end();
    if (!name.empty() && !known) legend_.push_back({name, std::move(swatch)});
  }
  void CollectLegend();
  bool LegendAt(LegendPlace place) const { return chart_.legend == place && !legend_.empty(); }
  std::size_t LegendColumns() const;
  double LegendEntryWidth() const;
  void LayOut();
  void Titles();
  void Grid();
  void Frame();
  void PaintArea(const ChartArea& area);
  void PaintBar(const ChartBar& bar);
  void PaintRule(const ChartRule& rule);
  void PaintLine(const ChartLine& line, const std::string& colour);
  void BlockAlong(const Pixel& from, const Pixel& to);
  void AddLineLabel(const ChartLine& line, const std::string& colour, const std::vector<Pixel>& visible);
  void PaintInterval(const ChartInterval& interval);
  void PaintPoints(const ChartPoints& points, const std::string& colour);
  void AddNote(const ChartNote& note);
  void PaintLegend();
  std::string Filled(const Box& box, const std::string& colour, double opacity, bool hatched);

  const Chart& chart_;
  std::string id_;
  AxisMap x_, y_;
  Box plot_;
  std::vector<LegendEntry> legend_;
  std::vector<Label> labels_;
  std::vector<Box> blocked_;
  std::string svg_;
  int patterns_ = 0;
};

void Painter::CollectLegend() {
  const auto fill = [this](const std::string& colour, double opacity, bool hatched) {
    return [=, this](Pixel at) {
      return Filled({at.x, at.y - 6.0, at.x + kSwatchPx, at.y + 6.0}, FillColour(colour), opacity, hatched);
    };
  };
  for (const ChartArea& area : chart_.areas) AddEntry(area.name, fill(area.colour, area.opacity, false));
  for (const ChartBar& bar : chart_.bars) AddEntry(bar.name, fill(bar.colour, bar.opacity, bar.hatched));
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
    plot_.bottom -= kLegendRowPx * static_cast<double>((legend_.size() - 1) / LegendColumns() + 1) + 8.0;
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

std::string Painter::Filled(const Box& box, const std::string& colour, double opacity, bool hatched) {
  const std::string shape = "<rect x=\"" + Number(box.left) + "\" y=\"" + Number(box.top) + "\" width=\"" +
                            Number(box.right - box.left) + "\" height=\"" + Number(box.bottom - box.top) + "\"";
  const std::string plain = shape + " fill=\"" + colour + "\" fill-opacity=\"" + Number(opacity) + "\"/>\n";
  if (!hatched) return plain;
  const std::string name = "hatch" + id_ + "-" + std::to_string(patterns_++);
  return plain + "<pattern id=\"" + name +
         "\" width=\"7\" height=\"7\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\"><line x1=\"0\" "
         "y1=\"0\" x2=\"0\" y2=\"7\" stroke=\"" +
         colour + "\" stroke-width=\"1.6\" stroke-opacity=\"0.5\"/></pattern>\n" + shape + " fill=\"url(#" + name +
         ")\"/>\n";
}

void Painter::PaintArea(const ChartArea& area) {
  std::vector<Pixel> corners;
  for (const ChartPoint& corner : area.corners) {
    const Pixel at = At(corner);
    if (std::isfinite(at.x + at.y)) corners.push_back(at);
  }
  corners = ClipPolygon(plot_, std::move(corners));
  if (corners.empty()) return;
  const std::string colour = FillColour(area.colour);
  svg_ += "<polygon points=\"" + PointList(corners) + "\" fill=\"" + colour + "\" fill-opacity=\"" +
          Number(area.opacity) + "\" stroke=\"" + (area.outlined ? colour : "none") + "\" stroke-width=\"1.6\"/>\n";
}

void Painter::PaintBar(const ChartBar& bar) {
  const auto pixel = [](const AxisMap& axis, std::optional<double> value, double missing, double least, double most) {
    const double at = value ? axis.Pixel(*value) : missing;
    return std::isfinite(at) ? std::clamp(at, least, most) : missing;
  };
  Box box{pixel(x_, bar.x_low, plot_.left, plot_.left, plot_.right),
          pixel(y_, bar.y_high, plot_.top, plot_.top, plot_.bottom),
          pixel(x_, bar.x_high, plot_.right, plot_.left, plot_.right),
          pixel(y_, bar.y_low, plot_.bottom, plot_.top, plot_.bottom)};
  if (box.left > box.right) std::swap(box.left, box.right);
  if (box.top > box.bottom) std::swap(box.top, box.bottom);
  if (box.right - box.left < 1.5) box.right = box.left + 1.5;
  if (box.bottom - box.top < 1.5) box.top = box.bottom - 1.5;
  const std::string colour = FillColour(bar.colour);
  svg_ += Filled(box, colour, bar.opacity, bar.hatched);
  if (bar.label.empty()) return;
  Label label{.text = bar.label, .colour = colour, .places = {}};
  const double half = 0.5 * TextWidth(bar.label) + 3.0;
  const double middle = 0.5 * (box.left + box.right);
  const double centre = std::clamp(middle, std::min(plot_.left + half, middle), std::max(plot_.right - half, middle));
  for (double y = box.top + 15.0; y < std::max(box.bottom, box.top + 16.0); y += 8.0) {
    label.places.push_back(
        {{std::clamp(centre, plot_.left + half, std::max(plot_.right - half, plot_.left + half)), y}, "middle"});
  }
  labels_.push_back(std::move(label));
}

void Painter::PaintRule(const ChartRule& rule) {
  const bool upright = rule.x.has_value();
  const double at = upright ? x_.Pixel(*rule.x) : y_.Pixel(rule.y.value_or(0.0));
  const double low = upright ? plot_.left : plot_.top, high = upright ? plot_.right : plot_.bottom;
  if (!(at >= low && at <= high)) return;
  Label label{.text = rule.label, .colour = rule.colour, .places = {}};
  if (upright) {
    svg_ += DrawLine({at, plot_.top}, {at, plot_.bottom}, rule.colour, 1.4, rule.dashed);
    for (double y = plot_.top + 15.0; y < plot_.bottom; y += 16.0) {
      label.places.push_back({{at + 5.0, y}, "start"});
      label.places.push_back({{at - 5.0, y}, "end"});
    }
  } else {
    svg_ += DrawLine({plot_.left, at}, {plot_.right, at}, rule.colour, 1.4, rule.dashed);
    for (double x = plot_.right - 6.0; x > plot_.left; x -= 40.0) {
      label.places.push_back({{x, at - 5.0}, "end"});
      label.places.push_back({{x, at + 14.0}, "end"});
    }
  }
  if (!rule.label.empty()) labels_.push_back(std::move(label));
}

/// Keeps labels off a line.
void Painter::BlockAlong(const Pixel& from, const Pixel& to) {
  constexpr double kStepPx = 6.0;
  const int steps = static_cast<int>(std::hypot(to.x - from.x, to.y - from.y) / kStepPx) + 1;
  for (int i = 0; i < steps; ++i) {
    const double part = (i + 0.5) / steps;
    const Pixel at{from.x + part * (to.x - from.x), from.y + part * (to.y - from.y)};
    blocked_.push_back({at.x - 2.0, at.y - 2.0, at.x + 2.0, at.y + 2.0});
  }
}

void Painter::PaintLine(const ChartLine& line, const std::string& colour) {
  std::string path;
  std::vector<Pixel> visible;
  std::optional<Pixel> pen;
  for (std::size_t i = 1; i < line.points.size(); ++i) {
    const auto segment = ClipSegment(plot_, At(line.points[i - 1]), At(line.points[i]));
    if (!segment) continue;
    const auto& [from, to] = *segment;
    if (!pen || pen->x != from.x || pen->y != from.y) path += "M" + Number(from.x) + " " + Number(from.y);
    path += "L" + Number(to.x) + " " + Number(to.y);
    pen = to;
    if (visible.empty()) visible.push_back(from);
    visible.push_back(to);
    BlockAlong(from, to);
  }
  if (!path.empty()) {
    svg_ += "<path d=\"" + path + "\" fill=\"none\" stroke=\"" + colour + "\" stroke-width=\"" + Number(line.width) +
            "\" stroke-linejoin=\"round\" stroke-linecap=\"round\"" + (line.dashed ? " stroke-dasharray=\"6 5\"" : "") +
            "/>\n";
  }
  for (const ChartPoint& point : line.points) {
    const Pixel at = At(point);
    if (line.markers && InPlot(at)) svg_ += DrawMarker(at, Marker::Dot, 3.2, colour);
  }
  AddLineLabel(line, colour, visible);
}

void Painter::AddLineLabel(const ChartLine& line, const std::string& colour, const std::vector<Pixel>& visible) {
  if (line.label.empty() || visible.empty()) return;
  Label label{.text = line.label, .colour = colour, .places = {}};
  const auto add = [&label](const Pixel& at) {
    for (const char* anchor : {"end", "start"}) {
      label.places.push_back({{at.x, at.y - 6.0}, anchor});
      label.places.push_back({{at.x, at.y + 15.0}, anchor});
    }
  };
  constexpr int kTries = 12;
  for (int attempt = kTries; attempt-- > 0;) {
    const double along = static_cast<double>(visible.size() - 1) * (attempt + 0.5) / kTries;
    const auto index = std::min(static_cast<std::size_t>(along), visible.size() - 2 + (visible.size() < 2 ? 1 : 0));
    const Pixel& a = visible[index];
    const Pixel& b = visible[std::min(index + 1, visible.size() - 1)];
    const double part = along - static_cast<double>(index);
    add({a.x + part * (b.x - a.x), a.y + part * (b.y - a.y)});
  }
  labels_.push_back(std::move(label));
}

void Painter::PaintInterval(const ChartInterval& interval) {
  const std::string colour = interval.colour.empty() ? PaletteColour(0) : interval.colour;
  const bool along_x = interval.along_x;
  const Pixel low = At(along_x ? ChartPoint{interval.low, interval.at.y} : ChartPoint{interval.at.x, interval.low});
  const Pixel high = At(along_x ? ChartPoint{interval.high, interval.at.y} : ChartPoint{interval.at.x, interval.high});
  const auto segment = ClipSegment(plot_, low, high);
  if (!segment) return;
  svg_ += DrawLine(segment->first, segment->second, colour, 1.6);
  const Pixel cap = along_x ? Pixel{0.0, 4.0} : Pixel{4.0, 0.0};
  for (const Pixel& end : {low, high}) {
    if (InPlot(end)) svg_ += DrawLine({end.x - cap.x, end.y - cap.y}, {end.x + cap.x, end.y + cap.y}, colour, 1.6);
  }
}

void Painter::PaintPoints(const ChartPoints& points, const std::string& colour) {
  for (const auto& [point, text] : points.points) {
    const Pixel at = At(point);
    if (!InPlot(at)) continue;
    svg_ += DrawMarker(at, points.marker, points.size, colour);
    const double size = points.size + 1.0;
    blocked_.push_back({at.x - size, at.y - size, at.x + size, at.y + size});
    if (text.empty()) continue;
    const double away = points.size + 5.0;
    labels_.push_back({.text = text,
                       .colour = colour,
                       .places = {{{at.x + away, at.y + 4.0}, "start"},
                                  {{at.x - away, at.y + 4.0}, "end"},
                                  {{at.x, at.y - away}, "middle"},
                                  {{at.x, at.y + away + 9.0}, "middle"},
                                  {{at.x + away, at.y - 10.0}, "start"},
                                  {{at.x + away, at.y + 18.0}, "start"},
                                  {{at.x - away, at.y - 10.0}, "end"},
                                  {{at.x - away, at.y + 18.0}, "end"}}});
  }
}

void Painter::AddNote(const ChartNote& note) {
  const Pixel at = At(note.at);
  if (!InPlot(at)) return;
  const bool moved = note.dx != 0.0 || note.dy != 0.0;
  const Pixel text{at.x + note.dx, at.y + note.dy};
  Label label{.text = note.text, .colour = note.colour, .places = {}};
  if (moved) label.leader = at;
  const char* first = note.dx < 0.0 ? "end" : "start";
  for (const double shift : {0.0, -16.0, 16.0, -32.0, 32.0, -48.0, 48.0}) {
    for (const char* anchor : {first, "middle", first[0] == 'e' ? "start" : "end"}) {
      label.places.push_back({{text.x, text.y + shift}, anchor});
    }
  }
  labels_.push_back(std::move(label));
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

std::string Document(double width, double height, const std::string& body) {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + Number(width) + "\" height=\"" + Number(height) +
         "\" viewBox=\"0 0 " + Number(width) + " " + Number(height) +
         "\" font-family=\"Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif\">\n" + body + "</svg>\n";
}

}  // namespace

std::string PaletteColour(std::size_t index) {
  return kPalette[index % std::size(kPalette)];
}

std::string ChartSvg(const Chart& chart) {
  return ChartsSvg({chart}, 1);
}

std::string ChartsSvg(const std::vector<Chart>& charts, int columns) {
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
  return Document(width, y + row_height, body);
}

Result<void> WriteSvg(const std::string& path, const std::string& svg) {
  return WriteFileAtomically(path, svg.data(), svg.size());
}

}  // namespace lensd::io
