// What a chart shows inside its frame: areas, bars, rules, lines, intervals, points, notes.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "svg_painter.h"

namespace lensd::io {
namespace {

/// Places around a mark, farther and farther off, each with a leader.
void AddRings(Label& label, const Pixel& mark) {
  constexpr int kDirections = 24;
  const double half = 0.5 * TextWidth(label.text);
  for (const double distance : {14.0, 24.0, 36.0, 50.0, 70.0, 95.0, 130.0, 170.0, 220.0, 300.0}) {
    for (int direction = 0; direction < kDirections; ++direction) {
      const double angle = 2.0 * std::numbers::pi * direction / kDirections;
      // The text's middle lies on a rounded rectangle around the mark.
      const double dx = std::cos(angle), dy = std::sin(angle);
      label.places.push_back({{mark.x + std::clamp(1.5 * dx, -1.0, 1.0) * (half + 8.0) + dx * distance,
                               mark.y + std::clamp(1.5 * dy, -1.0, 1.0) * 12.0 + dy * distance + 4.0},
                              "middle"});
    }
  }
}

}  // namespace

std::string Painter::Filled(const Box& box, const std::string& colour, double opacity, Fill fill,
                            const std::string& tip) {
  const std::string shape = "<rect x=\"" + Number(box.left) + "\" y=\"" + Number(box.top) + "\" width=\"" +
                            Number(box.right - box.left) + "\" height=\"" + Number(box.bottom - box.top) + "\"";
  const std::string outline = fill == Fill::Outlined ? "\" stroke=\"#777777" : "";
  std::string plain =
      WithTip(shape + " fill=\"" + colour + "\" fill-opacity=\"" + Number(opacity) + outline + "\"/>\n", tip);
  if (fill != Fill::Hatched) return plain;
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
  svg_ += Filled(box, colour, bar.opacity, FillOf(bar), bar.tip);
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
    BlockAlong({at, plot_.top}, {at, plot_.bottom});
    for (double y = plot_.top + 15.0; y < plot_.bottom; y += 16.0) {
      label.places.push_back({{at + 5.0, y}, "start"});
      label.places.push_back({{at - 5.0, y}, "end"});
    }
  } else {
    svg_ += DrawLine({plot_.left, at}, {plot_.right, at}, rule.colour, 1.4, rule.dashed);
    BlockAlong({plot_.left, at}, {plot_.right, at});
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
    placer_.BlockLine({at.x - 2.0, at.y - 2.0, at.x + 2.0, at.y + 2.0});
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
  for (std::size_t i = 0; line.markers && i < line.points.size(); ++i) {
    const Pixel at = At(line.points[i]);
    const std::string tip = i < line.tips.size() ? line.tips[i] : "";
    if (InPlot(at)) svg_ += DrawMarker(at, line.marker, kLineMarkerPx, colour, tip);
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
  BlockAlong(segment->first, segment->second);
  const Pixel cap = along_x ? Pixel{0.0, 4.0} : Pixel{4.0, 0.0};
  for (const Pixel& end : {low, high}) {
    if (!InPlot(end)) continue;
    svg_ += DrawLine({end.x - cap.x, end.y - cap.y}, {end.x + cap.x, end.y + cap.y}, colour, 1.6);
    BlockAlong({end.x - cap.x, end.y - cap.y}, {end.x + cap.x, end.y + cap.y});
  }
}

void Painter::PaintPoints(const ChartPoints& points, const std::string& colour) {
  for (const auto& [point, text, tip] : points.points) {
    const Pixel at = At(point);
    if (!InPlot(at)) continue;
    svg_ += DrawMarker(at, points.marker, points.size, colour, tip);
    const double size = points.size + 1.0;
    placer_.Block({at.x - size, at.y - size, at.x + size, at.y + size});
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
                                  {{at.x - away, at.y + 18.0}, "end"}},
                       .leader = at});
    for (Label::Place& place : labels_.back().places) place.led = false;
    AddRings(labels_.back(), at);
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

}  // namespace lensd::io
