// SVG elements as text, and a place for each label where it covers least of what is drawn. Widths of text are
// estimated: no font is loaded.
#include "svg_draw.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <sstream>
#include <string_view>

namespace lensd::io {
namespace {

/// In parts of the size.
double WidthOf(char c) {
  constexpr std::string_view kThin = "ijlI.,:;'|!", kNarrow = "()[]{}frt/- \"", kWide = "mwMW%@";
  if (kThin.contains(c)) return 0.34;
  if (kNarrow.contains(c)) return 0.43;
  if (kWide.contains(c)) return 0.99;
  return c >= 'A' && c <= 'Z' ? 0.74 : 0.64;
}

Box TextBox(const std::string& text, const Label::Place& place) {
  const double width = TextWidth(text);
  const std::string_view anchor = place.anchor;
  const double left = place.at.x - (anchor == "middle" ? 0.5 * width : anchor == "end" ? width : 0.0);
  return {left - 2.0, place.at.y - 0.85 * kTextPx, left + width + 2.0, place.at.y + 0.25 * kTextPx};
}

double Overlap(const Box& a, const Box& b) {
  const double width = std::min(a.right, b.right) - std::max(a.left, b.left);
  const double height = std::min(a.bottom, b.bottom) - std::max(a.top, b.top);
  return width > 0.0 && height > 0.0 ? width * height : 0.0;
}

std::string Polygon(Pixel at, std::initializer_list<Pixel> corners, const std::string& colour) {
  std::vector<Pixel> moved;
  for (const Pixel& corner : corners) moved.push_back({at.x + corner.x, at.y + corner.y});
  return "<polygon points=\"" + PointList(moved) + "\" fill=\"" + colour + "\" stroke=\"#ffffff\"/>\n";
}

}  // namespace

std::string Number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char character : text) {
    const std::string_view special = "&<>\"";
    static constexpr const char* kEntities[] = {"&amp;", "&lt;", "&gt;", "&quot;"};
    const auto found = special.find(character);
    if (found == std::string_view::npos) {
      escaped += character;
    } else {
      escaped += kEntities[found];
    }
  }
  return escaped;
}

double TextWidth(const std::string& text, double size) {
  double width = 0.0;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0) != 0x80) width += byte >= 0x80 ? 0.84 : WidthOf(c);
  }
  return width * size;
}

std::vector<std::string> BrokenLines(const std::vector<std::string>& paragraphs, double width) {
  std::vector<std::string> lines;
  for (const std::string& paragraph : paragraphs) {
    lines.emplace_back();
    std::istringstream words(paragraph);
    for (std::string word; words >> word;) {
      const std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
      if (lines.back().empty() || TextWidth(longer) <= width)
        lines.back() = longer;
      else
        lines.push_back(word);
    }
  }
  return lines;
}

std::string DrawText(Pixel at, const std::string& text, const TextStyle& style) {
  std::string svg = "<text x=\"" + Number(at.x) + "\" y=\"" + Number(at.y) + "\" font-size=\"" + Number(style.size) +
                    "\" fill=\"" + style.colour + "\" text-anchor=\"" + style.anchor + "\"";
  if (style.bold) svg += " font-weight=\"bold\"";
  if (style.halo) svg += " stroke=\"#ffffff\" stroke-width=\"3.5\" stroke-linejoin=\"round\" paint-order=\"stroke\"";
  if (style.rotate != 0.0) {
    svg += " transform=\"rotate(" + Number(style.rotate) + " " + Number(at.x) + " " + Number(at.y) + ")\"";
  }
  return svg + ">" + Escaped(text) + "</text>\n";
}

std::string DrawLine(Pixel a, Pixel b, const std::string& colour, double width, bool dashed) {
  std::string svg = "<line x1=\"" + Number(a.x) + "\" y1=\"" + Number(a.y) + "\" x2=\"" + Number(b.x) + "\" y2=\"" +
                    Number(b.y) + "\" stroke=\"" + colour + "\" stroke-width=\"" + Number(width) + "\"";
  if (dashed) svg += " stroke-dasharray=\"6 4\"";
  return svg + "/>\n";
}

std::string PointList(const std::vector<Pixel>& corners) {
  std::string list;
  for (const Pixel& corner : corners) {
    list += (list.empty() ? "" : " ") + Number(corner.x) + "," + Number(corner.y);
  }
  return list;
}

std::string WithTip(std::string element, const std::string& tip) {
  if (tip.empty()) return element;
  const std::string name = element.substr(1, element.find(' ') - 1);
  return element.erase(element.rfind("/>")) + "><title>" + Escaped(tip) + "</title></" + name + ">\n";
}

std::string DrawMarker(Pixel at, Marker marker, double size, const std::string& colour, const std::string& tip) {
  const std::string circle =
      "<circle cx=\"" + Number(at.x) + "\" cy=\"" + Number(at.y) + "\" r=\"" + Number(size) + "\"";
  switch (marker) {
    case Marker::Dot:
      return WithTip(circle + " fill=\"" + colour + "\" stroke=\"#ffffff\"/>\n", tip);
    case Marker::Ring:
      return WithTip(circle + " fill=\"#ffffff\" stroke-width=\"2\" stroke=\"" + colour + "\"/>\n", tip);
    case Marker::Square:
      return WithTip(Polygon(at, {{-size, -size}, {size, -size}, {size, size}, {-size, size}}, colour), tip);
    case Marker::Diamond:
      return WithTip(Polygon(at, {{0, -1.4 * size}, {1.4 * size, 0}, {0, 1.4 * size}, {-1.4 * size, 0}}, colour), tip);
    case Marker::Triangle:
      return WithTip(Polygon(at, {{0, -1.3 * size}, {1.2 * size, size}, {-1.2 * size, size}}, colour), tip);
    case Marker::Cross:
      return WithTip(DrawLine({at.x - size, at.y - size}, {at.x + size, at.y + size}, colour, 2.0), tip) +
             WithTip(DrawLine({at.x - size, at.y + size}, {at.x + size, at.y - size}, colour, 2.0), tip);
  }
  return {};
}

double LabelPlacer::Covered(const Box& box) const {
  double area = 0.0;
  for (const Box& taken : taken_) area += Overlap(box, taken);
  return area;
}

double LabelPlacer::Cost(const Box& box) const {
  double cost = frame_.Holds(box) ? 0.0 : 1e6 * (1.0 - Overlap(frame_, box) / Overlap(box, box)) + 1.0;
  const double covered = Covered(box);
  if (covered > 0.0) cost += 1e3 + covered;
  for (const Box& line : lines_) cost += Overlap(box, line);
  return cost;
}

std::string LabelPlacer::Place(const Label& label) {
  const Label::Place* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Label::Place& place : label.places) {
    const double cost = Cost(TextBox(label.text, place));
    if (cost >= least) continue;
    least = cost;
    best = &place;
    if (cost == 0.0) break;
  }
  if (best == nullptr) return {};
  const Box box = TextBox(label.text, *best);
  crowded_ = crowded_ || !frame_.Holds(box) || Covered(box) > 0.0;
  Block(box);
  std::string svg;
  if (label.leader && best->led) {
    const Pixel near = {std::clamp(label.leader->x, box.left, box.right),
                        std::clamp(label.leader->y, box.top, box.bottom)};
    svg += DrawLine(*label.leader, near, "#888888", 1.0);
  }
  return svg + DrawText(best->at, label.text,
                        {.colour = label.colour, .anchor = best->anchor, .bold = label.bold, .halo = true});
}

}  // namespace lensd::io
